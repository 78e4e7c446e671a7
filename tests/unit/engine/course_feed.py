"""A course whose supervisor says what a test makes it say; nothing is simulated."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from run_plans import limits_for, stvf_plan

from stepload.engine.course import Course
from stepload.engine.operator import Operator

PERIOD_S = 1.0 / 1024.0
"""A power of two: so many of them add up without rounding."""
PLAN = stvf_plan().procedure
PLANNED = limits_for(stvf_plan())


class Stage:
    """A course with what happens on it: `events`, `then` (times at which what follows was called).

    `limits` and `procedure` change those of the paper's machine. The arm is where its target is
    unless `position_m` is set.
    """

    def __init__(
        self, limits: dict[str, Any] | None = None, procedure: dict[str, Any] | None = None
    ) -> None:
        self.zeros: list[tuple[float, float]] = []
        self.sup = SimpleNamespace(
            force=SimpleNamespace(fresh=True, raw_n=0.0, wrench=(0.0,) * 6),
            arm=SimpleNamespace(position_m=0.0),
            force_n=0.0, smooth_n=0.0, second_raw_n=0.0, second_n=0.0,
            tare=lambda zero_n, second_n, _wrench=(): self.zeros.append((zero_n, second_n)),
        )  # fmt: skip
        self.events: list[tuple[float, str, dict[str, Any]]] = []
        self.operator = Operator()
        self.course = Course(
            replace(PLAN, **(procedure or {})), replace(PLANNED, **(limits or {})),
            self.sup, self.operator, lambda *event: self.events.append(event), 1,
        )  # type: ignore[arg-type]  # fmt: skip
        self.course.target_m = 0.0
        self.now_s = 10.0
        self.position_m: float | None = None
        self.then: list[float] = []
        self.stopped: list[float] = []
        self.zeroing: list[Callable[[float], None]] = []
        self.touching: list[Callable[[float], None] | None] = []

    def zero(
        self, _now_s: float, then: Callable[[float], None], touching: Callable[[float], None] | None
    ) -> None:
        """Takes a zero for ever; what follows is in `zeroing`, or in `touching`."""
        self.zeroing.append(then)
        self.touching.append(touching)
        self.course.act = lambda _now_s, _step_s: None

    def ticks(self, count: int = 1, force_n: float | None = None) -> None:
        """So many ticks; a force is told by all readings of it."""
        for _ in range(count):
            self.now_s += PERIOD_S
            if force_n is not None:
                self.sup.force_n = self.sup.smooth_n = self.sup.force.raw_n = force_n
            at_m = self.course.target_m if self.position_m is None else self.position_m
            self.sup.arm.position_m = at_m
            self.course.step(self.now_s, PERIOD_S)
            if self.then or self.stopped or self.course.failure:
                return

    def readings(self, main: Sequence[float], second: Sequence[float] | None = None) -> None:
        """A tick for each reading of the channels, not tared."""
        for index, newton in enumerate(main):
            self.sup.force.raw_n = newton
            self.sup.second_raw_n = second[index] if second is not None else 0.0
            self.ticks()
            if self.then or self.stopped or self.course.failure:
                return

    def find(self, kind: str) -> dict[str, Any]:
        """The data of the newest event of this kind."""
        return [data for _, name, data in self.events if name == kind][-1]


def swing(mean_n: float, sigma_n: float, count: int) -> list[float]:
    """Readings of this mean and standard deviation."""
    half = sigma_n * math.sqrt((count - 2) / count)
    return [mean_n + (half if index % 2 else -half) for index in range(count)]
