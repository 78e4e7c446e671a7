"""Rules on the wrench: R12 lateral force, R13 near a rating, R14 contact off the pressing axis.

A payload that is dragged sideways yields at a smaller force along the axis than one that is not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload.engine.watch import ForceWatch, Found, Trip
from stepload.feasibility.limits import RunLimits
from stepload.units import percent

LATERAL_TIME_S = 0.02
"""Time in s for which the lateral share, already filtered, may be too large."""


class WrenchRules:
    """Rules R12 and R14, with their state.

    `share` is the filtered lateral force over the axial one, `off_m` the distance of the contact
    from the pressing axis; 0 where the force is too small to determine it.

    Args:
        limits: the thresholds; `adopt` replaces them.
        found: makes the `Trip` of a rule; see `stepload.engine.watch`.
    """

    def __init__(self, limits: RunLimits, found: Found) -> None:
        self._limits = limits
        self._found = found
        self._across_s = self._off_s = 0.0
        self.share = self.off_m = 0.0

    def adopt(self, limits: RunLimits) -> None:
        """Judge by these thresholds from now on."""
        self._limits = limits

    def judge_across(
        self,
        across_n: float,
        force_n: float,
        smooth_n: float,
        predicted_n: float,
        leaving: bool = False,
        by: str = "",
    ) -> Trip | None:
        """R12: the lateral share is too large, or the force too large for F_c with that share.

        Args:
            across_n: lateral force, filtered and tared.
            force_n, predicted_n: newest force along the axis, and R2's peak.
            smooth_n: axial force with the same filter as the lateral one: while a force falls,
                different lags would give a false share.
            leaving: the arm retracts, as it would after a stop. Static friction falls less than the
                force along the axis, so the share alone means nothing then.
            by: the source of the force, for the message; "" for the force sensor.
        """
        limits, along_n = self._limits, abs(smooth_n)
        if not limits.lateral_share or math.hypot(across_n, along_n) < limits.lateral_from_n:
            self.share = self._across_s = 0.0
            return None
        largest = limits.lateral_share
        self.share = share = across_n / along_n if along_n > 0.0 else math.inf
        if leaving or share <= largest:
            self._across_s = 0.0
        else:
            self._across_s += limits.period_s
        if self._across_s > LATERAL_TIME_S:
            return self._found(
                "R12", 100.0 * share, 100.0 * largest, "%",
                f"{by}the force across the pressing axis is {across_n:.4g} N, "
                f"{percent(share, 2)} of that"
                f" along it (allowed {percent(largest, 2)}): the tool slides or bends "
                f"sideways. Align"
                " tool and plate, or hold the arm another way",
            )  # fmt: skip
        counted = share if share < largest else largest
        worse = counted * (counted + 2.0 * limits.lateral_askew)
        allowed_n = limits.allowed_n * (1.0 - limits.lateral_weakening * worse)
        word, whole_n = "is", math.hypot(force_n, across_n)
        if not whole_n > allowed_n:
            word, whole_n = "would be", math.hypot(predicted_n, across_n)
        if not whole_n > allowed_n:
            return None
        return self._found(
            "R12", whole_n, allowed_n, "N",
            f"{by}the whole force {word} {whole_n:.4g} N, and with {percent(share, 2)} of it across"
            f" the axis only {allowed_n:.4g} N are allowed: a payload that is dragged sideways"
            " yields earlier",
        )  # fmt: skip

    def judge_centre(self, watch: ForceWatch, smooth_n: float) -> Trip | None:
        """R14: where the plate is touched, by the torques about the sensor's origin.

        With f the force, r = (0, 0, L) the point of the pressing axis at the contact's height and e
        the contact's distance from it, T = (r + e) × f, so that |e| = |T − r × f| / f_z, of the
        torques across the axis.
        """
        limits = self._limits
        if not limits.eccentricity_m or smooth_n < 2.0 * limits.lateral_from_n:
            self.off_m = self._off_s = 0.0
            return None
        torque = watch.torque_beside(limits.lever_m)
        if torque == 0.0:  # a sensor without torques
            return None
        self.off_m = off_m = torque / smooth_n
        if off_m <= limits.eccentricity_m:
            self._off_s = 0.0
            return None
        self._off_s += limits.period_s
        if self._off_s <= LATERAL_TIME_S:
            return None
        return self._found(
            "R14", off_m, limits.eccentricity_m, "m",
            f"the plate is touched {off_m * 1e3:.2g} mm beside the force sensor's pressing axis"
            f" (allowed {limits.eccentricity_m * 1e3:.2g} mm): look at payload, tool and start"
            " pose, or at rig.force.lever",
        )  # fmt: skip


OVERLOADED_SAMPLES = 2
"""Readings in a row beyond 80 % of the rating: one may be a spike."""
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


class OverloadWatch:
    """R13 of one force sensor; `used` is the largest reading as a share of its limit,
    `stated` the components with a rating, as (index, limit).

    Args:
        name: of the sensor.
        limits: largest reading of each component in N and N·m, inf where none is stated.
        found: makes the `Trip` of a rule; see `stepload.engine.watch`.
    """

    def __init__(self, name: str, limits: Sequence[float], found: Found) -> None:
        self._name, self._found = name, found
        self.stated = [(i, limit) for i, limit in enumerate(limits) if limit < math.inf]
        self._over = 0
        self.used = 0.0

    def judge(self, wrench: Sequence[float]) -> Trip | None:
        """Judge a fresh reading, not tared: the weight of the tool loads the sensor too."""
        # A component that is no number may be anything.
        shares = [
            abs(wrench[index]) / limit if wrench[index] == wrench[index] else math.inf
            for index, limit in self.stated
        ]
        self.used = used = max(shares, default=0.0)
        self._over = self._over + 1 if used > 1.0 else 0
        if self._over < OVERLOADED_SAMPLES:
            return None
        index, limit = self.stated[shares.index(used)]
        value, unit = abs(wrench[index]), "N" if index < 3 else "N m"
        return self._found(
            "R13", value, limit, unit,
            f"the {self._name}'s {COMPONENTS[index]} reads {value:.4g} {unit}, beyond {limit:.4g}"
            f" {unit}: 80 % of what it is rated for",
        )  # fmt: skip
