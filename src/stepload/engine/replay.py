"""The supervisor over a recording: where would it have tripped, also with other limits?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

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


def replay(
    ticks: Iterable[ReplayTick],
    tares: Sequence[tuple[float, float, float]],
    limits: RunLimits,
    *,
    force_axis: str,
    second_axis: str = "",
    changes: Sequence[tuple[float, RunLimits]] = (),
) -> Replayed:
    """Judge a recording tick by tick, up to where it was made safe.

    Args:
        ticks: in order of time.
        tares: (time_s, zero_n, second_zero_n) of the tares of the run, in order of time.
        limits: the run's own, or others.
        force_axis, second_axis: components of the wrenches, as in the plan.
        changes: (time_s, limits) from when on others were in force, in order of time.
    """
    supervisor = Supervisor(limits, force_axis, second_axis)
    ahead, to_come = list(reversed(tares)), list(reversed(changes))
    target_m = compliance = float("nan")
    phase = int(Phase.WARM_UP)
    count = late = 0
    for tick in ticks:
        row = tick.row
        count += 1
        cause = supervisor.check(
            row.time_s, tick.force, tick.arm, tick.second, target_m, compliance, phase
        )
        if cause is not None:
            return Replayed(cause, Phase(phase), count)
        if row.phase == Phase.SAFING:
            late += 1
            if late > LATE_TICKS:
                break
            continue
        while ahead and ahead[-1][0] <= row.time_s:
            _, zero_n, second_zero_n = ahead.pop()
            supervisor.tare(zero_n, second_zero_n)
        while to_come and to_come[-1][0] <= row.time_s:
            supervisor.adopt(to_come.pop()[1])
        target_m, compliance, phase = row.target_m, row.compliance_m_per_n, row.phase
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
