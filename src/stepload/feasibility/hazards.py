"""Hazards of a rig that host software cannot prevent, each with this rig's numbers.

They hold for every run of the rig, so they are read and signed once (`stepload hazards RIG`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from stepload.contact.lateral import SHARES, left_of_limit
from stepload.feasibility.bounds import (
    common_error,
    follow_travel,
    largest_stiffness,
    press_rig,
    stuck_ratio,
)
from stepload.feasibility.command_backlog import catch_up_force
from stepload.feasibility.lateral import UNMEASURED_TILT_RAD
from stepload.feasibility.press import IMPACT_FACTOR, PressRig
from stepload.feasibility.pressing import HARD_STOP_N_PER_M
from stepload.plan.model import SecondForceSource, Structure
from stepload.plan.rig import Rig
from stepload.units import format_quantity as f
from stepload.units import percent

HEAVIER = 10.0
"""Factor by which a moving arm is assumed to be heavier than stated."""
BOUNCING = 4.0
"""Factor on v sqrt(m k) of such an arm, which bounces and hits again before the next sample."""
LATERAL_SHARE = 0.3
"""Lateral share that R12 allows where a plan does not say."""
POISSON_RATIO = 0.3


@dataclass(frozen=True, slots=True)
class Hazard:
    """One hazard: its stable name, the fact with its number, what helps."""

    code: str
    message: str
    remedy: str
    value: float = math.nan
    unit: str = ""


def hazards_of(rig: Rig) -> tuple[Hazard, ...]:
    """The hazards that apply to this rig."""
    press = press_rig(rig, rig.force.noise_n)
    return (
        *_of_drives(rig, press),
        *_of_mounting(rig, press),
        *_of_channels(rig),
        *_of_friction(rig),
        Hazard(
            "two_faults",
            "Two independent faults in one run are not defended against.",
            "an independent force trip",
        ),
    )


def _of_drives(rig: Rig, press: PressRig) -> Iterator[Hazard]:
    stiffness, arm = press.stiffness_n_per_m, rig.arm
    fuse_n = rig.mechanical_fuse_n
    runaway_n = stiffness * arm.max_speed_m_s * press.reaction_s
    yield Hazard(
        "drive_runaway",
        f"A drive that runs away at {f(arm.max_speed_m_s, 'm/s')} adds up to {f(runaway_n, 'N')}"
        f" within the reaction time of {f(press.reaction_s, 's')}.",
        f"the declared mechanical fuse opens at {f(fuse_n, 'N')}"
        if fuse_n is not None
        else "a mechanical fuse or stop, or the machine's own force trip",
        runaway_n, "N",
    )  # fmt: skip
    travel_m = follow_travel(arm)
    impact_n = catch_up_force(press, travel_m, HARD_STOP_N_PER_M)
    yield Hazard(
        "held_back_commands",
        f"Commands that the network holds back and delivers at once move the arm by"
        f" {f(travel_m, 'm')}; on something rigid that is {f(impact_n, 'N')}.",
        "keep the way free, and the network quiet",
        impact_n, "N",
    )  # fmt: skip
    heavy = replace(press, mass_kg=HEAVIER * press.mass_kg)
    stated_n, heavy_n = (
        1e-3 * factor * math.sqrt(each.mass_kg * HARD_STOP_N_PER_M)
        for each, factor in ((press, IMPACT_FACTOR), (heavy, BOUNCING))
    )
    yield Hazard(
        "heavier_arm",
        f"A moving mass of {f(arm.effective_mass_kg, 'kg')} as stated hits a rigid obstacle with"
        f" {f(stated_n, 'N')} at 1 mm/s; {HEAVIER:g} times as heavy, with about {f(heavy_n, 'N')}.",
        "state as effective_mass all that moves with the tool",
        heavy_n, "N",
    )  # fmt: skip
    late_n = stiffness * 1e-6
    yield Hazard(
        "unstated_delays",
        f"Each millisecond of delay that is not stated adds up to {f(late_n, 'N')} at 1 mm/s.",
        "state every filter and link (delay, command_delay)",
        late_n, "N",
    )  # fmt: skip


def _of_mounting(rig: Rig, press: PressRig) -> Iterator[Hazard]:
    per_um = press.stiffness_n_per_m * 1e-6
    yield Hazard(
        "plate_moves",
        f"A plate or base that moves under load adds up to {f(per_um, 'N')} per micrometre"
        f" (K_s, upper bound: {f(press.stiffness_n_per_m, 'N/m')}).",
        "bolt plate and arm to one table; touch neither while it presses",
        per_um, "N",
    )  # fmt: skip
    tilt_rad = UNMEASURED_TILT_RAD if rig.plate_tilt_rad is None else rig.plate_tilt_rad
    yield Hazard(
        "plate_tilted",
        f"Plate tilt is not measured without procedure.alignment; {math.degrees(tilt_rad):.3g}° are"
        " allowed for.",
        "level the plate, state rig.plate_tilt, or let procedure.alignment measure it",
        tilt_rad, "rad",
    )  # fmt: skip


def _of_channels(rig: Rig) -> Iterator[Hazard]:
    if rig.second_force.source is SecondForceSource.NONE:
        gain = 3.0 * rig.force.gain_uncertainty
        yield Hazard(
            "one_force_channel",
            "One force channel: a wrong gain or a reading that hangs cannot be seen;"
            f" {percent(gain, 2)} of gain are allowed for.",
            "a second force channel, or the machine's own force trip",
            gain,
        )
    else:
        common, source = common_error(rig)
        yield Hazard(
            "both_channels_alike",
            "Both force channels wrong or late in the same way cannot be seen;"
            f" {percent(common, 2)} are allowed for ({source}).",
            "calibrate them separately, with different weights; give each a link of its own",
            common,
        )
    if rig.arm.structure is Structure.ARM and rig.force.components == "one":
        yield Hazard(
            "sideways_unseen",
            "A force sensor of one component does not see lateral force;"
            f" {percent(LATERAL_SHARE, 2)} of the axial force are allowed for.",
            "a six-axis force sensor, or a pose that pushes little sideways (stepload pose)",
            LATERAL_SHARE,
        )


def _of_friction(rig: Rig) -> Iterator[Hazard]:
    if rig.arm.structure is not Structure.ARM:
        return
    factor = max(
        LATERAL_SHARE * math.hypot(1.0, mu) / (mu * left_of_limit(POISSON_RATIO, mu))
        for mu in SHARES if mu > LATERAL_SHARE
    )  # fmt: skip
    yield Hazard(
        "clings_on_the_way_back",
        f"Retracting with high friction (µ = {SHARES[-1]:g}) can load the payload like"
        f" {factor:.2g} times the top force.",
        "state payload.friction if it is lower, grease the contact, or lower max_lateral_share",
        factor,
    )
    ratio, _ = stuck_ratio(rig)
    bound = largest_stiffness(rig)
    yield Hazard(
        "friction_stiffens",
        f"Friction that holds the tip makes the arm up to {ratio:.3g} times as stiff; every force"
        f" bound uses {f(bound, 'N/m')}.",
        "calibrate dry and greased: stepload calibrate --from DRY GREASED",
        ratio,
    )
