"""Speed of the plate towards the arm: drift of the load path, and a plate that moves."""

from __future__ import annotations

import math

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.faults import Schedule
from stepload_drivers.sim.slow import PLATE_MOVES_S


class MovingPlate:
    """Speed of the plate towards the arm, one base step at a time."""

    def __init__(self, spec: WorldSpec, faults: Schedule, step_s: float) -> None:
        self._drift_m_s = spec.drift_m_s
        self._faults = faults
        self._step_s = step_s
        self._moved_m = self._largest_m = 0.0

    def speed_m_s(self, time_s: float) -> float:
        """In the base step that begins at `time_s`."""
        if time_s < self._faults.next_s and self._moved_m == 0.0:
            return self._drift_m_s
        goal_m = self._faults.active(time_s).get("plate_moves", 0.0)
        self._largest_m = max(abs(goal_m), self._largest_m)
        most_m = self._largest_m * self._step_s / PLATE_MOVES_S
        change_m = max(-most_m, min(most_m, goal_m - self._moved_m))
        last = change_m == goal_m - self._moved_m
        self._moved_m = goal_m if last else self._moved_m + change_m
        return self._drift_m_s + change_m / self._step_s


def moving_plate(spec: WorldSpec, step_s: float) -> MovingPlate | None:
    """The plate of a rig; None where it stands for good."""
    faults = Schedule.for_plate(spec.faults)
    if spec.drift_m_s == 0.0 and faults.next_s == math.inf:
        return None
    return MovingPlate(spec, faults, step_s)
