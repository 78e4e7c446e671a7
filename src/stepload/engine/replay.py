"""Runs the supervisor over a recording: where would it trip, also with other limits?"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from stepload.engine.supervisor import Supervisor
from stepload.envelope.limits import RunLimits
from stepload.record.outcome import Cause
from stepload.record.rows import Phase, TickRow
from stepload.rig.samples import ArmSample, ForceSample

LATE_TICKS = 3
"""A sample may reach a tick before the tick's own time stamp: look this far past the trip."""


@dataclass(frozen=True, slots=True)
class ReplayTick:
    """A recorded tick with the samples that arrived since the one before; raw, not tared."""

    row: TickRow
    force: Sequence[ForceSample]
    arm: Sequence[ArmSample]
    second: Sequence[ForceSample] = ()


@dataclass(frozen=True, slots=True)
class Replayed:
    """The first cause (None: never tripped), its phase, and how many ticks were judged."""

    cause: Cause | None
    phase: Phase | None
    ticks: int


class Zero(NamedTuple):
    """Readings that count as zero from `time_s` on; `wrench` is () in records without it."""

    time_s: float
    force_n: float
    second_n: float
    wrench: tuple[float, ...] = ()


class Replayer:
    """The supervisor run over a recording, finished or still being made.

    Args:
        limits: the run's own, or others.
        force_axis, second_axis: components of the wrenches, as in the plan.
    """

    def __init__(self, limits: RunLimits, force_axis: str, second_axis: str = "") -> None:
        self.supervisor = Supervisor(limits, force_axis, second_axis)
        self.limits = limits
        self.phase = int(Phase.WARM_UP)
        self._target_m = self._compliance = float("nan")
        self._tares: deque[Zero] = deque()
        self._changes: deque[tuple[float, RunLimits]] = deque()

    def tare(self, zero: Zero) -> None:
        """Use this zero from its time on, which must be later than every tick judged so far."""
        self._tares.append(zero)

    def adopt(self, time_s: float, limits: RunLimits) -> None:
        """Use these thresholds from `time_s` on, which must be after every tick judged so far."""
        self._changes.append((time_s, limits))

    def judge(self, tick: ReplayTick) -> Cause | None:
        """The supervisor's verdict on a tick, with the target and limits in use before it."""
        return self.supervisor.check(
            tick.row.time_s, tick.force, tick.arm, tick.second, self._target_m, self._compliance,
            self.phase,
        )  # fmt: skip

    def follow(self, row: TickRow) -> None:
        """Apply what the tick has decided: zeros, limits, target, compliance and phase."""
        while self._tares and self._tares[0].time_s <= row.time_s:
            zero = self._tares.popleft()
            self.supervisor.tare(zero.force_n, zero.second_n, zero.wrench)
        while self._changes and self._changes[0][0] <= row.time_s:
            self.limits = self._changes.popleft()[1]
            self.supervisor.adopt(self.limits)
        self._target_m, self._compliance, self.phase = (
            row.target_m, row.compliance_m_per_n, row.phase,
        )  # fmt: skip


def replay(
    ticks: Iterable[ReplayTick],
    tares: Sequence[Zero],
    limits: RunLimits,
    *,
    force_axis: str,
    second_axis: str = "",
    changes: Sequence[tuple[float, RunLimits]] = (),
) -> Replayed:
    """Judge a recording tick by tick, up to where it was made safe.

    Args:
        ticks: in order of time.
        tares: the zeros of the run, in order of time.
        limits: the run's own, or others.
        force_axis, second_axis: components of the wrenches, as in the plan.
        changes: (time_s, limits) from when on others were in force, in order of time.
    """
    replayer = Replayer(limits, force_axis, second_axis)
    for tare in tares:
        replayer.tare(tare)
    for change in changes:
        replayer.adopt(*change)
    count = late = 0
    for tick in ticks:
        count += 1
        cause = replayer.judge(tick)
        if cause is not None:
            return Replayed(cause, Phase(replayer.phase), count)
        if tick.row.phase == Phase.SAFING:
            late += 1
            if late > LATE_TICKS:
                break
            continue
        replayer.follow(tick.row)
    return Replayed(None, None, count)


def group_by_tick(
    rows: Sequence[TickRow],
    force: Sequence[ForceSample],
    arm: Sequence[ArmSample],
    second: Sequence[ForceSample] = (),
) -> Iterable[ReplayTick]:
    """Give each tick the samples received up to it; all sequences in order of time."""
    force_at = arm_at = second_at = 0
    for row in rows:
        force_end = _received(force, force_at, row.time_s)
        arm_end = _received(arm, arm_at, row.time_s)
        second_end = _received(second, second_at, row.time_s)
        yield ReplayTick(
            row, force[force_at:force_end], arm[arm_at:arm_end], second[second_at:second_end]
        )
        force_at, arm_at, second_at = force_end, arm_end, second_end


def _received(samples: Sequence[ForceSample] | Sequence[ArmSample], at: int, time_s: float) -> int:
    while at < len(samples) and samples[at].receive_time_s <= time_s:
        at += 1
    return at
