"""Feeds a supervisor tick by tick with samples made by hand; nothing is simulated."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from run_plans import limits_for, stvf_plan

from stepload.engine.supervisor import Supervisor
from stepload.feasibility.limits import RunLimits
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.rig.samples import ArmSample, ForceSample

PERIOD_S = 1e-3
PLANNED = limits_for(stvf_plan())


def force_sample(index: int, newton: float, **changes: Any) -> ForceSample:
    """The `index`-th sample of a sensor pressed along -fz; no two have the same wrench."""
    time_s = index * PERIOD_S
    wrench = (1e-9 * index, 0.0, -newton, 0.0, 0.0, 0.0)
    return ForceSample(index, time_s, time_s, 0, wrench, math.nan)._replace(**changes)


def arm_sample(index: int, metre: float, newton: float = 0.0, **changes: Any) -> ArmSample:
    """The `index`-th sample of an arm; no two have the same force."""
    time_s = index * PERIOD_S
    pose = (0.0, 0.0, -metre, 0.0, 0.0, 0.0)
    sample = ArmSample(index, time_s, time_s, 0, metre, newton + 1e-9 * index, pose)
    return sample._replace(**changes)


class Feed:
    """A supervisor with its tared channels, fed in ticks of 1 ms.

    `limits` are those of the paper's machine with `changes`. Rules that a test is not about are
    kept out of its way by samples that break none. `at_n` is the force, tared, at which both
    channels have been for long.
    """

    def __init__(self, second_axis: str = "", *, at_n: float = 0.0, **changes: Any) -> None:
        self.limits: RunLimits = replace(PLANNED, **changes)
        self.supervisor = Supervisor(self.limits, "-fz", second_axis)
        self.index = 0
        self.target_m = 0.0
        self._zero_n = at_n
        self.tick(at_n)
        self.supervisor.tare(-at_n, -at_n)

    @property
    def now_s(self) -> float:
        """Time of the newest tick."""
        return self.index * PERIOD_S

    def tick(
        self,
        force_n: float = 0.0,
        *,
        second_n: float | None = None,
        target_m: float | None = None,
        position_m: float | None = None,
        phase: Phase = Phase.HOLD,
        c_m_per_n: float = 0.0,
        skip: int = 0,
    ) -> Cause | None:
        """One tick, `skip` periods late; the arm is where its target is unless it is said."""
        self.index += 1 + skip
        self.target_m = self.target_m if target_m is None else target_m
        at_m = self.target_m if position_m is None else position_m
        arm_n = (force_n if second_n is None else second_n) - self._zero_n
        second = [force_sample(self.index, arm_n)] if self.supervisor.second else []
        return self.supervisor.check(
            self.now_s, [force_sample(self.index, force_n - self._zero_n)],
            [arm_sample(self.index, at_m, arm_n)], second, self.target_m, c_m_per_n, phase,
        )  # fmt: skip

    def ticks(self, count: int, force_n: float = 0.0, **options: Any) -> Cause | None:
        """The same tick so often."""
        for _ in range(count):
            self.tick(force_n, **options)
        return self.supervisor.cause

    def moving(self, count: int, speed_m_s: float, force_n: float = 0.0, **options: Any) -> None:
        """So many ticks in which the target moves at this speed."""
        for _ in range(count):
            self.tick(force_n, target_m=self.target_m + speed_m_s * PERIOD_S, **options)

    def until(self, rule: str, longest_s: float, force_n: float = 0.0, **options: Any) -> float:
        """Time in s until this rule trips."""
        begin_s = self.now_s
        while self.supervisor.cause is None:
            assert self.now_s - begin_s < longest_s, f"{rule} did not trip within {longest_s} s"
            self.tick(force_n, **options)
        assert self.supervisor.cause.rule == rule, self.supervisor.cause
        return self.now_s - begin_s
