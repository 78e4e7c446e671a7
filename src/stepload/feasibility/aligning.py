"""Limits of sideways motion: speeds, clearances, and the uncertainty of a measured tilt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from stepload.contact.plane import tilt_error_rad
from stepload.errors import BadInputError
from stepload.feasibility.bounds import largest_stiffness, press_rig
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.press import largest_speed
from stepload.feasibility.reason import Reason, Severity
from stepload.plan.compose import SIMULATED
from stepload.plan.model import Plan, Rig
from stepload.rig.plugins import load_arm
from stepload.units import format_quantity

SIX_AXES_REMEDY = "describe the six axes of the simulated rig in rig.simulation.mount: {}"
"""Where the simulated arm is to go across its approach."""
GUESSED_FACTOR = 3.0
"""Lateral stiffness over the largest axial one, where none is stated: a UR5e in its median pose has
1.3 to 1.5 (assumed joint stiffnesses)."""
STEEPEST_RAD = math.radians(5.0)
"""Largest tilt at which the shifted tool meets the plate only once the approach is slow."""
FASTEST_M_S = 5e-3
ACCELERATION_SHARE = 0.25
FELT_SIGMAS = 8.0
"""Multiple of the noise: force on either axis that ends a shift in free air."""
HUMP_SIGMAS = 3.0
SURE = 2.0
"""Coverage factor of a tilt, in standard uncertainties (95 %)."""


@dataclass(frozen=True, slots=True)
class Aligning:
    """How the touches on a circle are made, in SI units.

    Attributes:
        radius_m, max_tilt_rad: of the plan.
        clear_m: distance from every surface seen so far at which the arm is shifted.
        early_m: distance before the surface seen last from which on a touch beside it is slow.
        speed_m_s, acceleration_m_s2: across the approach.
        felt_n: force that ends a shift.
        touch_error_m, tilt_error_rad: standard uncertainties of a touch, and of each angle.
    """

    radius_m: float
    max_tilt_rad: float
    clear_m: float
    early_m: float
    speed_m_s: float
    acceleration_m_s2: float
    felt_n: float
    touch_error_m: float
    tilt_error_rad: float


def aligning_of(plan: Plan, limits: RunLimits) -> Aligning | None:
    """How a plan's touches on a circle are made; None where it asks for none.

    A shift is so slow that F_lim is kept even if the tool runs into something, against the arm's
    largest lateral stiffness.
    """
    requested, rig = plan.procedure.alignment, plan.rig
    if requested is None:
        return None
    felt_n = max(limits.touch_force_n, FELT_SIGMAS * limits.noise_n)
    press = press_rig(rig, limits.noise_n)
    stated = rig.arm.lateral_stiffness_n_per_m
    stiffness = GUESSED_FACTOR * largest_stiffness(rig) if stated is None else stated
    sideways = replace(press, stiffness_n_per_m=stiffness)
    speed_m_s = largest_speed(
        sideways,
        force_n=limits.force_limit_n,
        threshold_n=felt_n,
        tangent_n_per_m=limits.tangent_n_per_m,
        delay_s=press.reaction_s,
    )
    sample_s = 1.0 / rig.force.rate_hz + limits.period_s
    error_m = max(
        requested.touch_error_m,
        math.hypot(
            limits.guarded_speed_m_s * sample_s / math.sqrt(12.0),
            rig.arm.position_resolution_m / math.sqrt(12.0),
            rig.arm.position_noise_m,
            rig.arm.lost_motion_m,
        ),
    )
    early_m = requested.radius_m * math.tan(STEEPEST_RAD)
    return Aligning(
        radius_m=requested.radius_m,
        max_tilt_rad=requested.max_tilt_rad,
        clear_m=early_m + plan.procedure.retract_m,
        early_m=early_m,
        speed_m_s=min(speed_m_s, limits.fast_speed_m_s, FASTEST_M_S),
        acceleration_m_s2=ACCELERATION_SHARE * limits.acceleration_m_s2,
        felt_n=felt_n,
        touch_error_m=error_m,
        tilt_error_rad=tilt_error_rad(requested.radius_m, error_m),
    )


def aligning_reasons(plan: Plan, limits: RunLimits | None) -> Iterator[Reason]:
    """Reasons against sideways motion with this rig."""
    procedure, rig = plan.procedure, plan.rig
    if procedure.alignment is None:
        return
    if not can_shift(rig):
        yield Reason(
            "arm_cannot_shift", Severity.REFUSE,
            f"Alignment needs an arm that moves laterally; the driver {rig.arm.driver!r} does not.",
            SIX_AXES_REMEDY
            if rig.arm.driver == SIMULATED
            else "leave it out; align by hand, with a dial gauge on the plate",
            key="procedure.alignment",
        )  # fmt: skip
    if limits is not None and (aligning := aligning_of(plan, limits)) is not None:
        yield from _alignment_reasons(plan, aligning)


def can_shift(rig: Rig) -> bool:
    """Whether the plan's arm can go across its approach; the simulated one has to have six axes."""
    if rig.arm.driver == SIMULATED and rig.simulation.mount is None:
        return False
    try:
        return load_arm(rig.arm.driver).can_shift
    except BadInputError:  # a plan that was made without a driver
        return False


def _alignment_reasons(plan: Plan, aligning: Aligning) -> Iterator[Reason]:
    procedure = plan.procedure
    sure_rad = SURE * aligning.tilt_error_rad
    if sure_rad >= aligning.max_tilt_rad:
        yield Reason(
            "tilt_unknown", Severity.REFUSE,
            f"Touches on a circle of {format_quantity(aligning.radius_m, 'm')} tell the tilt to "
            f"{math.degrees(sure_rad):.2g}°; {math.degrees(aligning.max_tilt_rad):.2g}° are "
            "allowed.",
            "a larger circle, or a larger max_tilt",
            sure_rad, aligning.max_tilt_rad, "rad", key="procedure.alignment",
        )  # fmt: skip
    near_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
    if near_m < aligning.clear_m:
        yield Reason(
            "alignment_room", Severity.REFUSE,
            f"The plate may be {format_quantity(near_m, 'm')} from the start pose; alignment needs "
            f"{format_quantity(aligning.clear_m, 'm')}.",
            "start farther away, or touch on a smaller circle",
            near_m, aligning.clear_m, "m", key="procedure.surface_distance",
        )  # fmt: skip
