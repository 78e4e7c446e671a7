"""When a fault begins: in a phase of the run, or at a force of the loading.

The most harmful moment depends on phase and force, not on the clock. So the run is first looked at
without the fault; up to its beginning both runs are the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from random import Random
from statistics import NormalDist
from typing import Any

from stepload.engine.tick import Engine
from stepload.errors import DomainError
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import WorldView
from stepload_verify.campaign.scenario import Scenario
from stepload_verify.campaign.single import run_scenario
from stepload_verify.falsify.strata import ANY, BACK, FREE, HOLD, LOAD, PHASES, TOUCH

_NORMAL = NormalDist()
_EDGE = 1e-9


class Tape(Random):
    """A `Random` whose draws are the numbers of a vector, each between 0 and 1, one after another.

    Every draw is monotone in its number, so that a small step of the vector is a small step of the
    figure that is drawn, and a choice goes to its neighbour.

    Args:
        point: the numbers, shape (n,).
        name: what the tape is for, in messages.
    """

    def __init__(self, point: Sequence[float], name: str = "") -> None:
        super().__init__(0)
        self._point = point
        self._name = name
        self.used = 0
        """How many numbers have been read."""

    def random(self) -> float:
        """The next number of the vector.

        Raises:
            DomainError: there is none left.
        """
        if self.used >= len(self._point):
            raise DomainError(f"tape {self._name!r}: all {len(self._point)} numbers are used")
        value = float(self._point[self.used])
        self.used += 1
        return min(max(value, 0.0), 1.0 - _EDGE)

    def choice(self, seq: Any) -> Any:
        return seq[int(self.random() * len(seq))]

    def randrange(self, start: int, stop: int | None = None, step: int = 1) -> int:
        low, high = (0, start) if stop is None else (start, stop)
        return low + step * int(self.random() * -(-(high - low) // step))

    def gauss(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        return mu + sigma * _NORMAL.inv_cdf(min(max(self.random(), _EDGE), 1.0 - _EDGE))

    def getrandbits(self, k: int, /) -> int:
        return int(self.random() * 2**k)


NUMBERS = 4
"""Numbers that an onset reads."""
EARLY_S, LATE_S = 0.1, 0.4
"""A fault about the touch begins within this time before or after it."""
LATER_S = (1e-3, 1.0)
"""Range of the delay after the force of a load step, which half of the faults have."""
BACK_EARLY_S = 0.05
STEP_N = 0.01
"""Share of the top force by which a force must be larger than the one noted before it."""
_PRESSING = (Phase.LOAD, Phase.HOLD)


class Look:
    """A run without its faults: when it touched, held, went back, and passed a force."""

    def __init__(self, scenario: Scenario) -> None:
        self.touch_s = self.back_s = self.end_s = math.inf
        self.holds_s: list[float] = []
        self._times_s: list[float] = []
        self._forces_n: list[float] = []
        self._top_n = scenario.plan.procedure.top_force_n
        self._phase = -1
        self._world: WorldView | None = None
        plain = replace(scenario, truth=replace(scenario.truth, faults=()), incidents=())
        result, _ = run_scenario(plain, None, self._at_tick, self._at_begin)
        self.end_s = result.end_s

    def _at_begin(self, _engine: Engine, world: WorldView) -> None:
        self._world = world

    def _at_tick(self, row: TickRow) -> None:
        assert self._world is not None
        if row.phase != self._phase:
            pressed = self._phase in _PRESSING
            self._phase = row.phase
            if row.phase == Phase.HOLD:
                self.holds_s.append(row.time_s)
            elif pressed and row.phase not in _PRESSING and self.back_s == math.inf:
                self.back_s = row.time_s
        force_n = self._world.true_peak_force_n
        if force_n > 0.0 and self.touch_s == math.inf:
            self.touch_s = row.time_s
        last_n = self._forces_n[-1] if self._forces_n else 0.0
        if self._phase in _PRESSING and force_n > last_n + STEP_N * self._top_n:
            self._forces_n.append(force_n)
            self._times_s.append(row.time_s)

    def passed_s(self, share: float) -> float:
        """When this share of the top force was passed; inf where it was not."""
        for force_n, time_s in zip(self._forces_n, self._times_s, strict=True):
            if force_n > share * self._top_n:
                return time_s
        return math.inf

    def onset_s(self, phase: str, tape: Tape, hold_s: float) -> float:
        """A moment of this phase; inf where the run did not come so far."""
        first, second, third, fourth = (tape.random() for _ in range(NUMBERS))
        if phase == ANY:
            phase = PHASES[1 + int(fourth * (len(PHASES) - 1))]
        if phase == FREE:
            return max(0.0, (1.1 * first - 0.1) * min(self.touch_s, self.end_s))
        if phase == TOUCH:
            return max(0.0, self.touch_s - EARLY_S + first * (EARLY_S + LATE_S))
        if phase == LOAD:
            low, high = map(math.log, LATER_S)
            later_s = 0.0 if second < 0.5 else math.exp(low + third * (high - low))
            return self.passed_s(first) + later_s
        if phase == HOLD:
            if not self.holds_s:
                return math.inf
            begun_s = self.holds_s[int(first * len(self.holds_s))]
            return begun_s + second * min(hold_s, self.end_s - begun_s)
        assert phase == BACK, phase
        return self.back_s - BACK_EARLY_S + first * (self.end_s + BACK_EARLY_S - self.back_s)


def starts_of(scenario: Scenario) -> list[float]:
    """When its faults begin, each cause once."""
    starts = [fault.start_s for fault in scenario.faults]
    starts += [one.start_s for one in scenario.incidents[:1]]
    return list(dict.fromkeys(starts))


def placed(scenario: Scenario, moved: Mapping[float, float]) -> Scenario:
    """The same run with each cause beginning at another time; those after it as long after it."""
    faults = tuple(
        replace(fault, start_s=moved.get(fault.start_s, fault.start_s)) for fault in scenario.faults
    )
    incidents = scenario.incidents
    if incidents:
        first_s = incidents[0].start_s
        by_s = moved.get(first_s, first_s) - first_s
        incidents = tuple(replace(one, start_s=one.start_s + by_s) for one in incidents)
    return replace(scenario, truth=replace(scenario.truth, faults=faults), incidents=incidents)
