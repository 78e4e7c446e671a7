"""Which errors two runs have in common: by rig, calibration, sensor and place.

Whether an error is shared follows from the devices named in the records; what these do not state
stays open.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

REPEATS = 0.9
"""Correlation of the smooth error at the same place: gear play and lubricant differ from run to
run."""

ACROSS_ALIKE = 0.9
"""Correlation of the errors that friction leaves in two runs of one lateral share. Never counted as
fully repeatable: the compliance of an arm is not exactly one number where one payload sticks and
another slides."""
OF_CALIBRATION = 0.5
"""Correlation of the errors that unknown friction leaves in two runs of one calibration: half of
the variance of (share of the run less that of the calibration) is due to the calibration."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the errors of a run come from; "" and None where the record does not state it.

    Attributes:
        arm, force_sensor: make, model and serial number; of the sensor its calibration too.
        axis: force axis with its sign.
        pose: the plan's name of the pose.
        kinematics: what else the errors of the travel depend on: the seed of a simulated rig.
        calibration: the calibration that K_s comes from.
        stiffness_n_per_m: K_s and its standard uncertainty; None: no K_s in the chain.
        surface_m: travel of the arm at the touch before the loading.
        reach_m: travel over which the smooth error stays correlated.
        across: signed errors that lateral force leaves, one for each independent cause; empty where
            the share of the run or of the calibration is not known.
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
    """Correlation of a source in two runs: between `least` and `most`, equal where it is known."""

    least: float
    most: float


OWN, SAME, OPEN = Common(0.0, 0.0), Common(1.0, 1.0), Common(0.0, 1.0)


def _same(*pairs: tuple[str, str]) -> Common:
    """SAME where all agree, OWN where one differs, OPEN where one is not stated by both."""
    if any(one and other and one != other for one, other in pairs):
        return OWN
    return SAME if all(one and other for one, other in pairs) else OPEN


def _machine(one: Origin, other: Origin, apart_m: float = 0.0) -> Common:
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
    """The lateral coupling of a rig is the same in one pose, and so is the share of the
    calibration. Friction at the contact belongs to each run; with one payload it may be the
    same."""
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
    """The sensor's misalignment is the same in all runs of a rig; a remounted payload's is not."""
    return OWN if _machine(one, other) is OWN else OPEN


_RULES: dict[str, Callable[[Origin, Origin, float], Common]] = {
    "system stiffness K_s": _stiffness,
    "force calibration": _gain,
    "force linearity": _gain,
    "smooth deformation error": _smooth,
    "lateral force": _across,
    "misalignment of sensor and plate": _mounting,
    "gauge off the axis of an arm that turns": _machine,
}
"""Every other source is independent in each run: noise, quanta, zero, lag, temperature, drift,
creep and the choice of the model."""


def common(source: str, one: Origin, other: Origin, apart_m: float = 0.0) -> Common:
    """Correlation of an error in two runs.

    K_s: same arm, pose and calibration. Gain: same force sensor and axis. Smooth error: same arm
    and pose, 0.9 exp(−½ (distance/reach)²) of the places of the travel; open with an unnamed pose.
    Friction: with one calibration, as far as the errors have the same direction; at least by half.

    Args:
        one, other: where the errors of the two runs come from.
        apart_m: distance of the travels at equal force, in addition to that of the surfaces.
    """
    rule = _RULES.get(source)
    return OWN if rule is None else rule(one, other, apart_m)
