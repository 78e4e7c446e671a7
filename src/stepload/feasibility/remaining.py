"""Estimates how long a run will still take."""

from __future__ import annotations

from collections.abc import Sequence

from stepload.feasibility.schedule import (
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


class Remaining:
    """Follows a run through its schedule; time in which it is paused does not count.

    Args:
        stages: of the plan, as `schedule` gives them.
        procedure: of the plan.
    """

    def __init__(self, stages: Sequence[Stage], procedure: Procedure) -> None:
        named = {stage.name: stage for stage in stages}
        before = {name: stage.total_s for name, stage in named.items() if name not in _STEPS}
        up_s, down_s = (
            named[name].parts_s if name in named else () for name in (LOAD_STEP, UNLOAD_STEP)
        )
        gap = named.get(BETWEEN) or named.get(UNLOAD_BETWEEN)
        cycle_s = [*up_s, *down_s, gap.each_s if gap else 0.0]
        self._names, self._first, self._cycle = list(before), len(before), len(cycle_s)
        self._levels, self._down = len(up_s), len(down_s)
        self._times_s = [*before.values(), *cycle_s * procedure.cycles]
        self._times_s[-1] = named[LAST].total_s if LAST in named else 0.0
        self._at = 0
        self._began_s = self.active_s = self._left_s = 0.0
        self._now_s: float | None = None

    def at(self, row: TickRow) -> float:
        """Seconds that are still to come after a tick; call it at every tick that is shown."""
        if row.phase != Phase.PAUSED:
            self.active_s += row.time_s - (row.time_s if self._now_s is None else self._now_s)
            place = self._place(row)
            if place > self._at:
                self._at, self._began_s = place, self.active_s
        self._now_s = row.time_s
        begins = max(self._at + 1, self._first + (max(row.cycle, 1) - 1) * self._cycle)
        left_s = max(self._times_s[self._at] - (self.active_s - self._began_s), 0.0)
        left_s += sum(self._times_s[self._at + 1 : self._first]) + sum(self._times_s[begins:])
        self._left_s = left_s
        return left_s

    @property
    def share(self) -> float:
        """How much of the run's time is over, from 0 to 1."""
        whole_s = self.active_s + self._left_s
        return self.active_s / whole_s if whole_s > 0.0 else 0.0

    def _place(self, row: TickRow) -> int:
        """The index of the time that a tick belongs to."""
        if row.phase in _UP or row.phase in _DOWN:
            way = row.step - 1
            if row.phase in _DOWN:
                way = self._levels + max(self._down - row.step, 0)
            return self._first + (row.cycle - 1) * self._cycle + min(way, self._cycle - 2)
        if self._at < self._first:
            name = _BEFORE.get(row.phase, "") if row.cycle else ALIGN
            return self._names.index(name) if name in self._names else self._at
        last_of_cycle = (self._at - self._first) % self._cycle == self._cycle - 2
        return self._at + last_of_cycle
