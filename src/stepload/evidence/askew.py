"""What a contact that is not square, slips or is touched off the axis leaves in a result."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from stepload.estimators.across import CROSS_COMPLIANCE, Across
from stepload.estimators.contact_point import OFF_AXIS_M
from stepload.estimators.contact_quality import NOT_IN_DATA, ContactQuality
from stepload.estimators.missing import Missing
from stepload.evidence.gates import HARMLESS, Gate, gate
from stepload.evidence.quantity import Line
from stepload.units import format_quantity

TILT_RAD = math.radians(3.0)
"""A tilt of the plate that is not excluded where nobody has measured it."""
SIDEWAYS_OVER_ALONG = 3.3
"""Compliance of an arm's tip across the press over that along it: at most this in 90 % of tool-down
poses of a UR5e (2.9) and a UR10e (3.2); median 1.4 and 1.2, a UR3e 3.0 and 8.1. Joint stiffnesses
assumed. A guided axis whose lateral stiffness is 2e6 N/m beside 3.5e6 N/m along has 1.7."""
TANGENTIAL_OVER_NORMAL = 0.8
"""Mindlin: stiffness of a contact across over that along it."""
UNKNOWN_SHARE = 0.3
"""Force across over force along where the data do not tell: friction of 0.3 that slides."""
TURN_RAD_PER_N = 3e-5
"""Standard deviation of how far an arm's tool turns about an axis across the press. The size over
tool-down poses has a median and a 90th percentile of 35 and 69 µrad/N (UR3), 23 and 45 (UR5), 27
and 47 (UR10); two alike axes of this deviation would have 35 and 64 (six axes, item 1)."""
SHARE_CHANGE = 0.05
"""By how much the share across may change from the first loading to the second."""
SIGMAS = 4.0
ANY_WAY = math.sqrt(1.0 / 6.0)
"""Standard deviation of what an angle of up to 1 in an unknown direction makes along a given one:
all angles alike likely (1/3), all directions too (1/2)."""

Compliance = Callable[[float], float]
"""dδ/dF of the payload in m/N at a force in N."""


@dataclass(frozen=True, slots=True)
class Askew:
    """The contact of one run, and how well rig and plate are aligned.

    Attributes:
        quality: what the run says of it; `Missing` where the sensor tells nothing across.
        arm: whether a serial arm presses: it turns, and nobody has squared its plate.
        share: size of the force across over that along near the top; None where it is not known.
        coupling: travel across over travel along of a tip that may slide, along each axis (1 σ).
        misalignment_rad: largest angle between sensor and press.
        tilt_rad: tilt of the plate that is not excluded.
        yields_m_per_n: how the rig gives way along the press per newton.
        gauge_offset_m: how far beside the contact a gauge on an arm measures; 0 without one.
    """

    quality: ContactQuality | Missing = field(default_factory=lambda: Missing(NOT_IN_DATA))
    arm: bool = False
    share: float | None = None
    coupling: float = CROSS_COMPLIANCE
    misalignment_rad: float = 0.0
    tilt_rad: float = TILT_RAD
    yields_m_per_n: float = 0.0
    gauge_offset_m: float = 0.0

    def lines(self, power: float, from_n: float, to_n: float, span_m: float) -> list[Line]:
        """The lines of the budget that do not depend on what happened in the run.

        Args:
            power: how a share of the force changes the deformation.
            from_n, to_n: forces of the chord in N.
            span_m: its deformation in m.
        """
        found = []
        angle = math.hypot(self.misalignment_rad, self.tilt_rad if self.arm else 0.0)
        if angle > 0.0:
            share = UNKNOWN_SHARE if self.share is None else self.share
            force = math.hypot(
                ANY_WAY * share * math.sin(angle), (1.0 - math.cos(angle)) / math.sqrt(3.0)
            )
            moved_m = self.coupling * self.yields_m_per_n * (to_n - from_n) if self.arm else 0.0
            relative = math.hypot(power * force, moved_m * self._climb / span_m)
            size = f"{math.degrees(angle):.2g} deg"
            found.append(Line("misalignment of sensor and plate", size, relative))
        if self.gauge_offset_m > 0.0:
            turned_m = self.gauge_offset_m * TURN_RAD_PER_N * (to_n - from_n)
            size = f"{format_quantity(self.gauge_offset_m, 'm')} beside the contact"
            found.append(Line("gauge off the axis of an arm that turns", size, turned_m / span_m))
        return found

    @property
    def _climb(self) -> float:
        """Rise of a plate per way along it, in a direction that nobody knows (1 σ)."""
        return math.tan(self.tilt_rad) / math.sqrt(3.0)

    def slip_m(self, from_n: float, to_n: float, payload: Compliance) -> tuple[float, float]:
        """By how much slips between the chord's forces may have moved the tip along the axis.

        Of the first loading, which the chord is read from. Seen ones together, and one that could
        not be seen at the top force.

        Args:
            from_n, to_n: forces of the chord in N.
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
        unseen_m = self._moved_m(self.quality.unseen_n, payload(to_n)) if self.arm else 0.0
        return seen_m, unseen_m

    def _moved_m(self, jump_n: float, payload_m_per_n: float) -> float:
        """What a jump of the force across in N lets the tip move along the axis."""
        across = SIDEWAYS_OVER_ALONG * self.yields_m_per_n
        across += payload_m_per_n / TANGENTIAL_OVER_NORMAL
        return jump_n * across * math.tan(self.tilt_rad)

    def gates(self, slipped_m: float, span_m: float) -> list[Gate]:
        """What must be quiet; `slipped_m` is the first figure of `slip_m`."""
        if isinstance(self.quality, Missing):
            return []
        found = [_slip_gate(slipped_m, span_m, self.tilt_rad)]
        if self.quality.change is not None:
            found.append(_change_gate(*self.quality.change))
        point = self.quality.eccentric
        if point is not None and self.gauge_offset_m > 0.0:
            allowed_m = OFF_AXIS_M + 2.0 * point.sigma_m
            text = f"{_off(point.size_m, allowed_m)}: the gauge does not measure where it presses"
            found.append(gate("eccentric", point.size_m, allowed_m, "m", "all", text))
        return found

    @property
    def notes(self) -> list[str]:
        """What is to be known beside the figures; empty where there is nothing to say."""
        if isinstance(self.quality, Missing):
            return []
        point = self.quality.eccentric
        if point is None or self.gauge_offset_m > 0.0:
            return []
        allowed_m = OFF_AXIS_M + 2.0 * point.sigma_m
        return [_off(point.size_m, allowed_m)] if point.size_m > allowed_m else []


def coupling_of(across: Across, yields_m_per_n: float) -> float:
    """Travel across over travel along of a tip that may slide, along each axis (1 σ).

    The three numbers tell it: what a force across does along the axis, a force along does across.
    """
    if across.per_newton_m is None or not yields_m_per_n > 0.0:
        return CROSS_COMPLIANCE
    whole = math.hypot(*across.per_newton_m, *across.sigma_m_per_n)
    return whole / math.sqrt(2.0) / yields_m_per_n


def _off(size_m: float, allowed_m: float) -> str:
    return (
        f"the plate is touched {format_quantity(size_m, 'm', 2)} beside the force sensor's axis "
        f"(allowed {format_quantity(allowed_m, 'm', 2)})"
    )


def _slip_gate(moved_m: float, span_m: float, tilt_rad: float) -> Gate:
    text = (
        "the contact slipped while loading; on a plate tilted by as much as "
        f"{math.degrees(tilt_rad):.2g} degrees, which is not excluded, this may be "
        f"{format_quantity(moved_m, 'm', 2)} of the deformation (allowed "
        f"{format_quantity(HARMLESS * span_m, 'm', 2)}): square the plate, or reduce the friction"
    )
    return gate("slip", moved_m, HARMLESS * span_m, "m", "all", text)


def _change_gate(change: float, sigma: float) -> Gate:
    allowed = max(SHARE_CHANGE, SIGMAS * sigma)
    text = (
        f"the force across the axis differs by {change:.0%} of that along it between the first "
        f"loading and the second (allowed {allowed:.0%}): friction has changed, or the contact "
        "has slipped to another place"
    )
    return gate("share_change", change, allowed, "", "all", text)
