"""The check of an arm that can go across its approach: it goes there, and a retract keeps it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stepload.rig.contract_motion import ARRIVE_S, NEAR_SHARE, moving_arm, newest, refused
from stepload.rig.contract_trial import SkippedCheck, Trial, require
from stepload.rig.device import LARGEST_SHIFT_M, Arm

Vector = NDArray[np.float64]


def check_shift(trial: Trial) -> str:
    """An arm that says it can shift does so, along axes 1 and 2, and refuses what no arm may do."""
    kind = trial.make()
    if isinstance(kind, Arm) and not kind.can_shift:
        raise SkippedCheck("this arm cannot shift: plans with alignment or nulling are refused")
    with moving_arm(trial) as arm:
        if not arm.can_shift:
            raise SkippedCheck("this arm cannot shift as it is set up")
        start_m, begin = _rest(arm, trial)
        for shift_m in ((math.nan, 0.0), (0.0, math.inf), (2.0 * LARGEST_SHIFT_M, 0.0)):
            refused(f"a shift of {shift_m} m", arm.command, start_m, shift_m)
        refused("a jump to the largest shift", arm.command, start_m, (0.0, LARGEST_SHIFT_M))
        way_m = trial.move_m
        _ramp(arm, start_m, (0.0, 0.0), (way_m, 0.0), trial)
        first = _moved("axis 1", arm, begin, start_m, trial)
        _ramp(arm, start_m, (way_m, 0.0), (0.0, way_m), trial)
        second = _moved("axis 2", arm, begin, start_m, trial)
        before = _rest(arm, trial)[1]
        arm.retract(way_m, trial.speed_m_s, trial.open_timeout_s)
        back = before - _rest(arm, trial)[1]
        across_m = max(abs(float(back @ axis)) / way_m for axis in (first, second))
        require(
            across_m < NEAR_SHARE * way_m,
            f"a retract went {across_m * 1e3:.4f} mm across the approach: it must keep the shift",
        )
        turn = float(np.cross(first, second) @ back) / way_m**3
        require(
            turn > 0.5,
            "axes 1 and 2 and the approach are no right-handed frame by the arm's pose: a tilt "
            "would be corrected the wrong way",
        )
        arm.safe(trial.open_timeout_s)
    return f"{way_m * 1e3:g} mm along both axes"


def _moved(name: str, arm: Arm, begin: Vector, start_m: float, trial: Trial) -> Vector:
    """The measured change of the pose: it must be across the approach, and as far as asked."""
    position_m, pose = _rest(arm, trial)
    went, asked_m = pose - begin, trial.move_m
    along_m = position_m - start_m
    went_m = math.sqrt(max(0.0, float(went @ went) - along_m**2))
    require(
        abs(went_m - asked_m) < NEAR_SHARE * asked_m,
        f"shift along {name}: the pose went {went_m * 1e3:.4f} mm across the approach, asked were "
        f"{asked_m * 1e3:.4f} mm: it is ignored, or in another unit",
    )
    require(
        abs(along_m) < NEAR_SHARE * asked_m,
        f"shift along {name}: the position along the approach went {along_m * 1e3:+.4f} mm",
    )
    return went


def _ramp(
    arm: Arm,
    position_m: float,
    from_m: tuple[float, float],
    to_m: tuple[float, float],
    trial: Trial,
) -> None:
    steps = math.ceil(math.dist(from_m, to_m) / (trial.speed_m_s * arm.period_s))
    wait = round(ARRIVE_S / arm.period_s)
    for step in range(1, steps + wait):
        part = min(1.0, step / steps)
        x_m, y_m = (a + part * (b - a) for a, b in zip(from_m, to_m, strict=True))
        arm.command(position_m, (x_m, y_m))
        trial.wait(arm.period_s)


def _rest(arm: Arm, trial: Trial) -> tuple[float, Vector]:
    """Position along the approach and place of the TCP, of the newest sample."""
    sample = newest(arm, trial)
    return sample.position_m, np.array(sample.pose[:3])
