"""Which errors two runs have in common: by the rig, the calibration, the sensor and the place.

An error that two runs share is one and the same number in both: it stands in neither their spread
nor, as far as both feel it alike, in their difference. Whether it is shared is told by what the
records say of the devices. What they do not say is not guessed: it stays open, and whoever judges
has to look at both cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

REPEATS = 0.9
"""Correlation of the smooth error at one and the same place. It is never counted as repeating
wholly: gear play and lubricant are part of it and differ from run to run."""

ACROSS_ALIKE = 0.9
"""Correlation of what friction leaves in two runs of one share. Never counted as wholly the same:
how an arm gives way is not quite one number where one payload sticks and another slides (`python -m
stepload_verify.trials.coupling.compared`)."""
OF_CALIBRATION = 0.5
"""Correlation of what unknown friction leaves in two runs of one calibration: half of the variance
of (share of the run less that of the calibration) is the calibration's."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the errors of a run come from; "" and None where the record does not tell.

    Attributes:
        rig: name of the rig.
        arm, force_sensor: make, model and serial number; of the sensor its calibration too.
        axis: force axis with its sign.
        pose: the plan's name of the pose.
        kinematics: what else the errors of the travel depend on: the seed of a simulated rig.
        calibration: which calibration K_s comes from.
        stiffness_n_per_m: K_s and its standard uncertainty; None: no K_s in the chain.
        surface_m: travel of the arm at the touch before the loading.
        reach_m: travel over which the smooth error stays correlated.
        across: how what the force across the axis leaves points, one figure for each independent
            cause; empty where the share of the run or of the calibration is not known.
    """

    rig: str = ""
    arm: str = ""
    force_sensor: str = ""
    axis: str = ""
    pose: str = ""
    kinematics: str = ""
    calibration: str = ""
    stiffness_n_per_m: tuple[float, float] | None = None
    surface_m: float | None = None
    reach_m: float | None = None
    across: tuple[float, ...] = ()


class Common(NamedTuple):
    """Correlation of one source in two runs: between `least` and `most`, alike where known."""

    least: float
    most: float


OWN, SAME, OPEN = Common(0.0, 0.0), Common(1.0, 1.0), Common(0.0, 1.0)


def _same(*pairs: tuple[str, str]) -> Common:
    """SAME where all agree, OWN where one differs, OPEN where one is not told by both."""
    if any(one and other and one != other for one, other in pairs):
        return OWN
    return SAME if all(one and other for one, other in pairs) else OPEN


def _machine(one: Origin, other: Origin) -> Common:
    if one.pose != other.pose or one.axis != other.axis:
        return OWN
    return _same((one.rig, other.rig), (one.arm, other.arm))


def _stiffness(one: Origin, other: Origin, apart_m: float) -> Common:
    if one.stiffness_n_per_m is None or one.stiffness_n_per_m != other.stiffness_n_per_m:
        return OWN
    if one.calibration and other.calibration and one.calibration != other.calibration:
        return OWN
    return _machine(one, other)


def _gain(one: Origin, other: Origin, apart_m: float) -> Common:
    if one.axis != other.axis:
        return OWN
    return _same((one.force_sensor, other.force_sensor))


def _smooth(one: Origin, other: Origin, apart_m: float) -> Common:
    if one.kinematics != other.kinematics:
        return OWN
    machine = _machine(one, other)
    if machine is OWN:
        return OWN
    reaches = [each.reach_m for each in (one, other) if each.reach_m]
    place = None
    if one.surface_m is not None and other.surface_m is not None and len(reaches) == 2:
        away_m = abs(one.surface_m - other.surface_m) + apart_m
        place = REPEATS * math.exp(-0.5 * (away_m / min(reaches)) ** 2)
    if place is None:
        return Common(0.0, REPEATS)
    known = machine is SAME and bool(one.pose)
    return Common(place if known else 0.0, place)


def _across(one: Origin, other: Origin, apart_m: float) -> Common:
    """How the rig gives way sideways is the same in one pose, and so is the share of the
    calibration. Friction at the contact is the runs' own; of one payload it may be the same."""
    same = _stiffness(one, other, apart_m)
    if same is OWN:
        return OWN
    found = Common(OF_CALIBRATION, 1.0)
    if one.across or other.across:
        found = OPEN
        sizes = math.hypot(*one.across) * math.hypot(*other.across)
        if len(one.across) == len(other.across) and sizes > 0.0:
            product = sum(a * b for a, b in zip(one.across, other.across, strict=True))
            alike = ACROSS_ALIKE * product / sizes
            found = Common(alike, alike)
    if same is SAME and one.pose:
        return found
    return Common(min(found.least, 0.0), max(found.most, 0.0))


def _mounting(one: Origin, other: Origin, apart_m: float) -> Common:
    """The sensor is as askew in all runs of a rig; a payload that was put in anew is not."""
    return OWN if _machine(one, other) is OWN else OPEN


def _turning(one: Origin, other: Origin, apart_m: float) -> Common:
    return _machine(one, other)


_RULES: dict[str, Callable[[Origin, Origin, float], Common]] = {
    "system stiffness K_s": _stiffness,
    "force calibration": _gain,
    "force linearity": _gain,
    "smooth deformation error": _smooth,
    "force across the axis": _across,
    "misalignment of sensor and plate": _mounting,
    "gauge off the axis of an arm that turns": _turning,
}
"""Every other source is each run's own: noise, quanta, zero, lag, temperature, drift, creep and
what the choice of the model adds."""


def common(source: str, one: Origin, other: Origin, apart_m: float = 0.0) -> Common:
    """How far an error is one and the same in two runs.

    K_s: the same arm in the same pose and the same calibration. Gain: the same force sensor. Smooth
    error: the same arm in the same pose, as far as it pressed at the same place of its travel:
    0.9 exp(−½ (distance/reach)²). A pose without a name leaves K_s as one figure, but the smooth
    error open: the same travel may then be another place.

    Friction: as far as what it leaves points the same way in both, with one calibration; where the
    shares are not known, by half at the least.

    Args:
        source: name of the source in a budget.
        one, other: where the errors of the two runs come from.
        apart_m: how far the travels are apart at equal force, beside the surfaces.
    """
    rule = _RULES.get(source)
    return OWN if rule is None else rule(one, other, apart_m)
