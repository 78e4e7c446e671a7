"""A course whose supervisor says what a test makes it say; nothing is simulated."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from run_plans import limits_for, stvf_plan

from stepload.engine.operator import Operator
from stepload.engine.phases import Exit, Steps
from stepload.engine.run_state import RunState

BACK_OFF_REST_S = 0.2
PERIOD_S = 1.0 / 1024.0
"""A power of two: so many of them add up without rounding."""
PLAN = stvf_plan().procedure
PLANNED = limits_for(stvf_plan())


class Stage:
    """A course with what happens on it: `events`, and `left`: each part's end and exit, with times.

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
        self.course = RunState(
            replace(PLAN, **(procedure or {})), replace(PLANNED, **(limits or {})),
            self.sup, self.operator, lambda *event: self.events.append(event), 1,
        )  # type: ignore[arg-type]  # fmt: skip
        self.course.target_m = 0.0
        self.now_s = 10.0
        self.position_m: float | None = None
        self.then: list[float] = []
        self.exits: list[Exit] = []
        self.zeroing: list[bool] = []
        self.zeroed: list[Exit | None] = []

    def begin(self, part: Steps) -> None:
        """Enter a part of a run in this tick; `then` has the time of its end, `exits` its exit."""
        self.course.now_s = self.now_s
        self.course.sequence = self._led(part)
        next(self.course.sequence)

    def _led(self, part: Steps) -> Generator[None]:
        left = yield from part
        if left is None:
            self.then.append(self.now_s)
        else:
            self.exits.append(left)
        while True:
            yield

    def take(self, on_the_way: bool = False) -> Steps:
        """In place of `Zeroing.take`: lasts until a test puts what comes of it into `zeroed`."""
        self.zeroing.append(on_the_way)
        while not self.zeroed:
            yield
        return self.zeroed.pop()

    def ticks(self, count: int = 1, force_n: float | None = None) -> None:
        """So many ticks; a force is told by all readings of it."""
        for _ in range(count):
            self.now_s += PERIOD_S
            if force_n is not None:
                self.sup.force_n = self.sup.smooth_n = self.sup.force.raw_n = force_n
            at_m = self.course.target_m if self.position_m is None else self.position_m
            self.sup.arm.position_m = at_m
            self.course.step(self.now_s, PERIOD_S)
            if self.then or self.exits or self.course.failure:
                return

    def readings(self, main: Sequence[float], second: Sequence[float] | None = None) -> None:
        """A tick for each reading of the channels, not tared."""
        for index, newton in enumerate(main):
            self.sup.force.raw_n = newton
            self.sup.second_raw_n = second[index] if second is not None else 0.0
            self.ticks()
            if self.then or self.exits or self.course.failure:
                return

    def back_off(self) -> None:
        """So many ticks until the arm has backed off and rested; readings go on as they are."""
        course = self.course
        ticks = 1 + round((BACK_OFF_REST_S + 4.0 * course.limits.loop_s) / PERIOD_S)
        for _ in range(5000):
            self.ticks()
            ticks = ticks - 1 if course.target_m == course.goal_m else ticks
            if not ticks:
                return
        raise AssertionError("did not back off")

    def find(self, kind: str) -> dict[str, Any]:
        """The data of the newest event of this kind."""
        return [data for _, name, data in self.events if name == kind][-1]


def swing(mean_n: float, sigma_n: float, count: int) -> list[float]:
    """Readings of this mean and standard deviation."""
    half = sigma_n * math.sqrt((count - 2) / count)
    return [mean_n + (half if index % 2 else -half) for index in range(count)]
