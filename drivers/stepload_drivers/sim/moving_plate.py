"""Speed of the plate towards the arm: drift of the load path, and a plate that moves."""

from __future__ import annotations

import math

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.faults import PLATE, Schedule

PLATE_MOVES_S = 0.02
"""Time in which a plate moves by the magnitude of its fault."""


class MovingPlate:
    """Speed of the plate towards the arm, one base step at a time."""

    def __init__(self, spec: WorldSpec, faults: Schedule, step_s: float) -> None:
        self._drift_m_s = spec.drift_m_s
        self._faults = faults
        self._step_s = step_s
        self._moved_m = self._largest_m = 0.0

    def change_m(self, time_s: float) -> float:
        """How far a fault moves it in the base step that begins at `time_s`."""
        if time_s < self._faults.next_s and self._moved_m == 0.0:
            return 0.0
        goal_m = self._faults.active(time_s).get("plate_moves", 0.0)
        self._largest_m = max(abs(goal_m), self._largest_m)
        most_m = self._largest_m * self._step_s / PLATE_MOVES_S
        change_m = max(-most_m, min(most_m, goal_m - self._moved_m))
        last = change_m == goal_m - self._moved_m
        self._moved_m = goal_m if last else self._moved_m + change_m
        return change_m

    def speed_m_s(self, time_s: float) -> float:
        """In the base step that begins at `time_s`, with the drift."""
        return self._drift_m_s + self.change_m(time_s) / self._step_s


def moving_plate(spec: WorldSpec, step_s: float) -> MovingPlate | None:
    """The plate of a rig; None where it stands for good."""
    faults = Schedule(spec.faults, kinds=PLATE)
    if spec.drift_m_s == 0.0 and faults.next_s == math.inf:
        return None
    return MovingPlate(spec, faults, step_s)
