"""Errors of force across the press: friction, tilt, slip, and a contact off the axis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from stepload.identification.conditions import Conditions
from stepload.identification.contact_quality import NOT_IN_DATA, OFF_AXIS_M, ContactQuality
from stepload.identification.fit import FloatArray, Missing
from stepload.identification.inelastic_signs import Compliance
from stepload.identification.lateral_coupling import CROSS_COMPLIANCE, Across
from stepload.identification.quantity import Line
from stepload.identification.smooth import NORMAL_95
from stepload.units import beside_limit, format_quantity, percent

GUIDED_COMPLIANCE = 0.3
"""C_xz/C_zz of a guided axis, or of a rig of unstated structure."""
LEFT_OVER = 0.05
"""Standard uncertainty of a correction with three numbers, as a share of it: in simulation 1/18 to
1/20 of the bias of one number remained, a tenth on a plate tilted by 3 degrees."""
UNKNOWN_FRICTION = 0.9 * 0.5 / math.sqrt(3.0)
"""Standard uncertainty of a deflection, as a share of it, on a serial arm where the payload's
friction is not known relative to that of the calibration: coupling C_xz/C_zz of 0.9 (90th
percentile of poses) times a difference of the lateral shares of up to 0.5 either way, uniform."""

STATED_FRICTION = 0.33 * 0.3 / math.sqrt(3.0)
"""The same where a person states K_s for a press without lateral force: the median coupling, and a
lateral share of up to 0.3 either way, uniformly distributed."""

Rule = Literal["guided", "unknown", "one number", "three numbers"]
TILT_RAD = math.radians(3.0)
"""Tilt of the plate that is allowed for where none was measured."""
CLIMB = math.tan(TILT_RAD) / math.sqrt(3.0)
"""Slope of the plate along an unknown direction (1 σ)."""
LATERAL_OVER_AXIAL = 3.3
"""Compliance of an arm's tip across the press over that along it: at most this in 90 % of tool-down
poses of a UR5e (2.9) and a UR10e (3.2), joint stiffnesses assumed."""
TANGENTIAL_OVER_NORMAL = 0.8
"""Lateral over axial stiffness of a contact (Mindlin)."""
UNKNOWN_SHARE = 0.3
"""Lateral over axial force where the data do not give it: sliding with a friction of 0.3."""
TURN_RAD_PER_N = 3e-5
"""Standard deviation of how far an arm's tool turns about an axis across the press. The size over
tool-down poses has a 90th percentile of 69 µrad/N (UR3), 45 (UR5), 47 (UR10); two independent axes
with this deviation have 64 (six axes, item 1)."""
ANY_WAY = math.sqrt(1.0 / 6.0)
"""Standard deviation of the component along a given direction of an angle of up to 1 in an unknown
direction: sizes uniform (1/3), directions uniform (1/2)."""
NOT_KNOWN = Missing(NOT_IN_DATA)


@dataclass(frozen=True, slots=True)
class LateralForce:
    """The lateral force of one run.

    Attributes:
        rule: "guided": a guided axis; of an arm "three numbers": the effect was corrected; "one
            number": the difference of its share from that of the calibration is known; "unknown".
        share: size of lateral over axial force; None where the sensor does not measure it.
        away: the same less the share that K_s was measured at.
        relative: standard uncertainty of the deflection that it leaves, as a share of it.
        taken: the correction by the three numbers, as a share of the deflection.
        errors: signed independent parts of `relative`; empty where they are not known.
    """

    rule: Rule
    share: float | None = None
    away: float = 0.0
    relative: float = 0.0
    taken: float = 0.0
    errors: tuple[float, ...] = ()

    @property
    def size(self) -> str:
        """Its size, as shown in the budget."""
        if self.rule == "unknown":
            return "friction of the contact, not measured"
        if self.rule == "one number":
            return f"{percent(self.away, 2)} away from that of K_s"
        if self.share is None:
            return "share not known, counted as none"
        taken = f", {percent(self.taken, 2)} of the deflection taken out"
        return percent(self.share, 2) + (taken if self.rule == "three numbers" else "")

    @property
    def note(self) -> str:
        """What this run cannot show because of it; "" where nothing is missing."""
        if self.rule == "unknown":
            return (
                f"unknown friction: ±{percent(NORMAL_95 * self.relative, 2)} of the system's "
                "deflection; measure K_s with the same contact, or add a displacement gauge"
            )
        return "no lateral force recorded"


def expected_lateral_force(told: Conditions) -> LateralForce:
    """Expectation before a run: no contribution where its share can be compared with that of the
    calibration, otherwise that of unknown friction."""
    known = told.across.at_share is not None and not told.across.stated
    if known or told.across.per_newton_m is not None:
        return LateralForce("guided")
    return lateral_force(told, None, None, 0.0)


def lateral_force(
    told: Conditions, share: FloatArray | None, size: float | None, away: float
) -> LateralForce:
    """Choose the rule for a run, and evaluate it.

    Args:
        told: the conditions, with what is known of the arm.
        share: (2,) signed lateral over axial force; None where the sensor does not measure it.
        size: its size, noise taken out.
        away: size of the share less that of the calibration, noise taken out.
    """
    across, stiffness_n_per_m = told.across, told.sources.system_stiffness_n_per_m
    if stiffness_n_per_m is None:
        return LateralForce("guided", size)
    if share is not None:
        if across.per_newton_m is not None:
            taken = stiffness_n_per_m * float(across.away(share) @ across.per_newton_m)
            own = across.errors_m_per_n(share, stiffness_n_per_m)
            errors = (*(stiffness_n_per_m * each for each in own), LEFT_OVER * taken)
            left = math.hypot(*errors)
            return LateralForce("three numbers", size, away, left, abs(taken), errors=errors)
        if told.arm and across.at_share is not None:
            errors = tuple(across.away(share).tolist())
            return LateralForce("one number", size, away, CROSS_COMPLIANCE * away, errors=errors)
    if told.arm:
        relative = STATED_FRICTION if across.stated else UNKNOWN_FRICTION
        return LateralForce("unknown", size, relative=relative)
    errors = () if share is None else tuple(share.tolist())
    return LateralForce("guided", size, relative=GUIDED_COMPLIANCE * (size or 0.0), errors=errors)


@dataclass(frozen=True, slots=True)
class ContactAlignment:
    """The contact of one run, and how well rig and plate are aligned.

    Attributes:
        quality: evaluation of the contact; `Missing` where the sensor has no lateral axes.
        arm: whether a serial arm presses, which turns under load and whose plate was not squared.
        share: size of lateral over axial force near the top; None where it is not known.
        coupling: travel across over travel along of a tip that may slide, along each axis (1 σ).
        misalignment_rad: largest angle between sensor and press.
        yields_m_per_n: how the rig gives way along the press per newton.
        gauge_offset_m: lateral distance of a gauge on an arm from the contact; 0 without one.
    """

    quality: ContactQuality | Missing = NOT_KNOWN
    arm: bool = False
    share: float | None = None
    coupling: float = CROSS_COMPLIANCE
    misalignment_rad: float = 0.0
    yields_m_per_n: float = 0.0
    gauge_offset_m: float = 0.0

    def lines(self, power: float, from_n: float, to_n: float, span_m: float) -> list[Line]:
        """Lines of the budget that do not depend on the events of the run.

        Args:
            power: relative change of the deformation over that of the force.
        """
        found = []
        angle = math.hypot(self.misalignment_rad, TILT_RAD if self.arm else 0.0)
        if angle > 0.0:
            share = UNKNOWN_SHARE if self.share is None else self.share
            force = math.hypot(
                ANY_WAY * share * math.sin(angle), (1.0 - math.cos(angle)) / math.sqrt(3.0)
            )
            moved_m = self.coupling * self.yields_m_per_n * (to_n - from_n) if self.arm else 0.0
            relative = math.hypot(power * force, moved_m * CLIMB / span_m)
            size = f"{math.degrees(angle):.2g} deg"
            found.append(Line("misalignment of sensor and plate", size, relative))
        if self.gauge_offset_m > 0.0:
            turned_m = self.gauge_offset_m * TURN_RAD_PER_N * (to_n - from_n)
            size = f"{format_quantity(self.gauge_offset_m, 'm')} beside the contact"
            found.append(Line("gauge off the axis of an arm that turns", size, turned_m / span_m))
        return found

    def slip_m(self, from_n: float, to_n: float, payload: Compliance) -> tuple[float, float]:
        """Possible axial motion of the tip in m due to slips between the chord's forces.

        Of the first loading, from which the chord is read: the sum over detected slips, and for an
        arm one slip that is just too small to be detected at the top force.

        Args:
            payload: dδ/dF of the payload.
        """
        if isinstance(self.quality, Missing):
            return 0.0, 0.0
        first = self.quality.branches[0].cycle
        seen_m = sum(
            self._moved_m(slip.jump_n, payload(slip.force_n))
            for slip in self.quality.slips
            if slip.rising and slip.cycle == first and from_n <= slip.force_n <= to_n
        )
        undetected_m = self._moved_m(self.quality.undetected_n, payload(to_n)) if self.arm else 0.0
        return seen_m, undetected_m

    def _moved_m(self, jump_n: float, payload_m_per_n: float) -> float:
        """Axial motion of the tip in m that a jump of the lateral force in N allows."""
        across = LATERAL_OVER_AXIAL * self.yields_m_per_n
        across += payload_m_per_n / TANGENTIAL_OVER_NORMAL
        return jump_n * across * math.tan(TILT_RAD)

    @property
    def notes(self) -> list[str]:
        """Remarks for the reader of the figures; empty where there are none."""
        place = self.quality if isinstance(self.quality, Missing) else self.quality.place
        if isinstance(place, Missing):
            return []
        allowed_m = OFF_AXIS_M + 2.0 * place.sigma_m
        if place.size_m <= allowed_m:
            return []
        size, limit = beside_limit(place.size_m, allowed_m, "m")
        return [f"the plate is touched {size} beside the force sensor's axis (allowed {limit})"]


def alignment_of(
    told: Conditions, quality: ContactQuality | Missing = NOT_KNOWN, share: float | None = None
) -> ContactAlignment:
    """The contact of a run, and how well its conditions say that rig and plate are aligned."""
    return ContactAlignment(
        quality, told.arm, share, coupling_of(told.across, told.yields_m_per_n),
        told.misalignment_rad, told.yields_m_per_n, told.gauge_offset_m,
    )  # fmt: skip


def coupling_of(across: Across, yields_m_per_n: float) -> float:
    """Travel across over travel along of a tip that may slide, along each axis (1 σ).

    It follows from the three numbers by reciprocity: the axial motion per lateral force equals the
    lateral motion per axial force.
    """
    if across.per_newton_m is None or not yields_m_per_n > 0.0:
        return CROSS_COMPLIANCE
    whole = math.hypot(*across.per_newton_m, *across.sigma_m_per_n)
    return whole / math.sqrt(2.0) / yields_m_per_n
