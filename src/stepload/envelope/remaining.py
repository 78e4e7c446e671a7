"""Estimates how long a run will still take."""

from __future__ import annotations

from collections.abc import Sequence

from stepload.envelope.schedule import (
    ALIGN,
    BETWEEN,
    LAST,
    LOAD_STEP,
    UNLOAD_BETWEEN,
    UNLOAD_STEP,
    Stage,
)
from stepload.plan.model import Procedure
from stepload.record.rows import Phase, TickRow

_BEFORE: dict[int, str] = {
    Phase.WARM_UP: "warm up",
    Phase.FREE_AIR: "prove free air",
    Phase.TARE: "tare and drift check",
    Phase.DRIFT_CHECK: "tare and drift check",
    Phase.ALIGN: ALIGN,
    Phase.FAST_APPROACH: "fast approach",
    Phase.GUARDED_APPROACH: "guarded approach",
    Phase.DWELL: "touch again",
    Phase.TOUCH_RETRACT: "touch again",
}
_UP, _DOWN = (Phase.LOAD, Phase.HOLD), (Phase.UNLOAD, Phase.UNLOAD_HOLD)
_STEPS = (LOAD_STEP, UNLOAD_STEP, UNLOAD_BETWEEN, BETWEEN, LAST)
ENOUGH_STEPS = 2
"""Steps after which the schedule is scaled by the measured pace of the run."""


class Remaining:
    """Follows a run through its schedule.

    Time in which the run is paused does not count. The time of the steps to come is scaled by how
    much longer than planned those of this run have taken so far.

    Args:
        stages: of the plan, as `schedule` gives them.
        procedure: of the plan.
    """

    def __init__(self, stages: Sequence[Stage], procedure: Procedure) -> None:
        total_s = {stage.name: stage.total_s for stage in stages}
        each_s = {stage.name: stage.each_s for stage in stages}
        parts_s = {stage.name: stage.parts_s for stage in stages}
        self._before = {name: time for name, time in total_s.items() if name not in _STEPS}
        self._names = list(self._before)
        self._levels, self._cycles = len(procedure.levels_n), procedure.cycles
        self._down = self._levels - 1 if procedure.unload else 0
        self._up_s, self._down_s = parts_s.get(LOAD_STEP, ()), parts_s.get(UNLOAD_STEP, ())
        self._pace = 1.0
        between = each_s.get(BETWEEN, each_s.get(UNLOAD_BETWEEN, 0.0))
        self._between_s, self._last_s = between, total_s.get(LAST, 0.0)
        self._highest = 0
        self._at = 0
        self._step = -1
        self._first = -1
        self._steps_began_s = self._began_s = 0.0
        self._now_s = self.active_s = self._now_left_s = 0.0
        self._started = self._over = False

    def at(self, row: TickRow) -> float:
        """Seconds that are still to come after a tick; call it at every tick that is shown."""
        now_s, phase = row.time_s, row.phase
        if not self._started:
            self._started, self._now_s = True, now_s
        if phase != Phase.PAUSED:
            self.active_s += now_s - self._now_s
        self._now_s = now_s
        if phase in _UP or phase in _DOWN:
            self._loaded(row)
            self._press(self._index(row))
        elif self._step < 0:
            self._approach(_BEFORE.get(phase, "") if row.cycle else ALIGN)
        elif phase != Phase.PAUSED and self._step == self._steps_of_run - 1 and not self._over:
            self._over, self._began_s = True, self.active_s
        self._now_left_s = self._left_s(max(row.cycle, 1))
        return self._now_left_s

    @property
    def share(self) -> float:
        """How much of the run's time is over, from 0 to 1."""
        whole_s = self.active_s + self._now_left_s
        return self.active_s / whole_s if whole_s > 0.0 else 0.0

    @property
    def _steps_of_cycle(self) -> int:
        return self._levels + self._down

    @property
    def _steps_of_run(self) -> int:
        return self._steps_of_cycle * self._cycles

    def _loaded(self, row: TickRow) -> None:
        """Use a loading that ended early (`procedure.until`) as the pattern of the next ones."""
        if row.phase in _UP and row.step > self._highest:
            self._highest = row.step
        elif row.phase in _DOWN and 0 < self._highest < self._levels:
            self._levels = self._highest
            self._down = self._levels - 1 if self._down else 0

    def _planned_s(self, first: int, end: int) -> float:
        """Planned time of the steps from `first` to before `end`, of all steps of the run."""
        cycle = (*self._up_s[: self._levels], *self._down_s[len(self._down_s) - self._down :])
        return sum(cycle[step % len(cycle)] for step in range(first, end)) if cycle else 0.0

    def _index(self, row: TickRow) -> int:
        """Which of all steps of the run a tick belongs to, from 0."""
        way = row.step - 1
        if row.phase in _DOWN:
            way = self._levels + max(self._down - row.step, 0)
        return (row.cycle - 1) * self._steps_of_cycle + min(way, self._steps_of_cycle - 1)

    def _approach(self, name: str) -> None:
        place = self._names.index(name) if name in self._names else self._at
        if place > self._at:
            self._at, self._began_s = place, self.active_s

    def _press(self, step: int) -> None:
        if self._first < 0:
            self._first, self._steps_began_s = step, self.active_s
        if step > self._step:
            done = step - self._first
            between = step // self._steps_of_cycle - self._first // self._steps_of_cycle
            if done >= ENOUGH_STEPS:
                took_s = self.active_s - self._steps_began_s - between * self._between_s
                planned_s = self._planned_s(self._first, step)
                self._pace = max(took_s / planned_s, 0.0) if planned_s > 0.0 else 1.0
            self._step, self._began_s = step, self.active_s

    def _left_s(self, cycle: int) -> float:
        in_it_s = self.active_s - self._began_s
        if self._over:
            return max(self._last_s - in_it_s, 0.0)
        after_s = self._last_s
        if self._step >= 0:
            now_s = self._pace * self._planned_s(self._step, self._step + 1)
            steps_s = self._pace * self._planned_s(self._step + 1, self._steps_of_run)
            between_s = (self._cycles - cycle) * self._between_s
            return max(now_s - in_it_s, 0.0) + steps_s + between_s + after_s
        cycles = self._cycles - cycle + 1  # fewer from the beginning where a run is resumed
        after_s += cycles * self._planned_s(0, self._steps_of_cycle)
        after_s += (cycles - 1) * self._between_s
        after_s += sum(self._before[name] for name in self._names[self._at + 1 :])
        now_s = self._before[self._names[self._at]] if self._names else 0.0
        return max(now_s - in_it_s, 0.0) + after_s
