"""Runs the supervisor over a record, with the limits of the run or with others."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stepload.engine.supervisor import Supervisor
from stepload.errors import BadInputError, DomainError, printable
from stepload.feasibility.limits import RunLimits
from stepload.record.outcome import Cause
from stepload.record.reader import Event, Recording, read_recording
from stepload.record.rows import Phase, TickRow, rows_of
from stepload.record.untrusted import untrusted
from stepload.rig.samples import ArmSample, ForceSample
from stepload.units import parse_quantity

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


FILE = "limits.json"
MOST_DELAYED = 100_000
"""Longest delay of a command or between the channels, in ticks; the supervisor stores that many."""


def limits_to_bytes(limits: RunLimits) -> bytes:
    """Every threshold of a run with its source, as a file of the record."""
    return json.dumps({**asdict(limits), "terms": [asdict(term) for term in limits.terms]}).encode()


def limits_from(attachments: Mapping[str, bytes]) -> RunLimits:
    """The thresholds a run was made with, from a record that is not trusted.

    Raises:
        BadInputError: not there, or not what they should be.
    """
    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        data = json.loads(raw)
        del data["terms"]  # names, units and sources for readers; they follow from the names
        limits = RunLimits(**data)
        _check_kept(limits)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError, DomainError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return limits


def _check_kept(limits: RunLimits) -> None:
    """Raises ValueError where the supervisor would have to keep too many ticks."""
    most_s = MOST_DELAYED * limits.period_s
    for name in ("command_delay_s", "channel_skew_s"):
        if not getattr(limits, name) <= most_s:
            raise ValueError(
                f"{name} is {getattr(limits, name):g} s, more than {MOST_DELAYED} ticks of"
                f" {limits.period_s:g} s"
            )


def zero_of(event: Event) -> Zero:
    """The zero given by an event "tare" of a record, which is not trusted.

    Raises:
        KeyError, TypeError, ValueError: the event holds no valid zero.
    """
    wrench = tuple(float(value) for value in event.data.get("wrench", ()))  # type: ignore[attr-defined]
    if len(wrench) not in (0, 6):
        raise ValueError(f"a wrench of {len(wrench)} components")
    return Zero(
        event.time_s,
        float(event.data["mean_n"]),  # type: ignore[arg-type]
        float(event.data["second_mean_n"]),  # type: ignore[arg-type]
        wrench,
    )


def _changes(recording: Recording, limits: RunLimits) -> list[tuple[float, RunLimits]]:
    """Limits that the run switched to, with their times, after those it began with."""
    events = [event for event in recording.events if event.kind == "limits"]
    return [(event.time_s, changed_limits(limits, event)) for event in events[1:]]


def changed_limits(limits: RunLimits, event: Event) -> RunLimits:
    """The limits that the run switched to according to an event.

    Raises:
        TypeError, ValueError, DomainError: the event holds no valid limits.
    """
    return replace(limits, **event.data)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class Judged:
    """A record that was judged: the result, when the run began, and notes on what is missing."""

    replayed: Replayed
    start_s: float
    notes: tuple[str, ...]


def _others(limits: RunLimits, stated: Mapping[str, str]) -> dict[str, Any]:
    """Other thresholds by name, read from text with units.

    Raises:
        BadInputError: no such threshold, or no valid value.
    """
    units = {term.name: term.unit for term in limits.terms}
    others: dict[str, Any] = {}
    for name, text in stated.items():
        if name not in units:
            near = get_close_matches(name, units, n=1)
            guess = f"did you mean {near[0]}? " if near else ""
            raise BadInputError(
                f"no threshold is called {name!r}",
                hint=f"{guess}one of {', '.join(sorted(units))}",
            )
        unit = units[name]
        try:
            others[name] = _value(text, unit)
            _check_kept(replace(limits, **others))
        except (ValueError, BadInputError) as error:
            told = error.message if isinstance(error, BadInputError) else str(error)
            raise BadInputError(
                f"{name}={text}: {told}", hint=f'such as --limit "{name}=1 {unit}"'
            ) from None
    return others


def _value(text: str, unit: str) -> float:
    """Read a threshold of this unit; a count of samples is an int.

    Raises:
        BadInputError, ValueError: the text is no such value.
    """
    if unit and unit != "samples":
        return parse_quantity(text, unit)
    value = float(text)
    return int(value) if unit and value.is_integer() else value


def _notes(recording: Recording) -> tuple[str, ...]:
    if recording.damage:
        return (f"the record is damaged, and was judged up to there: {recording.damage}",)
    if recording.partial:
        return ("the record is partial: its run was not finished, or it was recovered",)
    return ()


def _ended(recording: Recording, start_s: float) -> tuple[str, ...]:
    """Why the run itself ended early, where it did: the order of a run has rules of its own."""
    return tuple(
        f"the run itself was ended by {printable(str(event.data.get('rule')))} at"
        f" {event.time_s - start_s:.3f} s: {printable(str(event.data.get('message')), 400)}"
        for event in recording.events
        if event.kind == "trip"
    )


def _whole_ticks(recording: Recording) -> int:
    """The number of ticks whose samples are complete: in a record that was cut, streams end apart.

    A stream that ended in the run itself would have tripped a rule there, and ended in safing.
    """
    ticks = recording.ticks
    if not recording.partial or (ticks.phase == Phase.SAFING).any():
        return len(ticks.time_s)
    times_s = [recording.force.receive_time_s, recording.arm.receive_time_s]
    if recording.second_force is not None:
        times_s.append(recording.second_force.receive_time_s)
    ends_s = [times[-1] if len(times) else -np.inf for times in times_s]
    return int(np.searchsorted(ticks.time_s, min(ends_s), side="right"))


def replay_file(path: Path, stated: Mapping[str, str] | None = None) -> Judged:
    """Judge a record tick by tick.

    Args:
        path: the record.
        stated: other thresholds than the run's: values with units by name of `RunLimits.terms`.

    Raises:
        BadInputError: not a record of stepload, nothing in it to judge, or an invalid limit.
    """
    recording = read_recording(path)
    whole = _whole_ticks(recording)
    if not whole:
        raise BadInputError(f"{path}: not one tick is whole in it, there is nothing to judge")
    limits = limits_from(recording.attachments)
    try:
        tares = [zero_of(event) for event in recording.events if event.kind == "tare"]
        changes = _changes(recording, limits)
    except (KeyError, TypeError, ValueError, DomainError):
        raise BadInputError(f"{path}: tares or limits in the record have no numbers") from None
    others = _others(limits, stated or {})
    limits = replace(limits, **others)
    changes = [(time_s, replace(changed, **others)) for time_s, changed in changes]
    with untrusted(path):
        ticks = group_by_tick(
            rows_of(TickRow, recording.ticks)[:whole],
            rows_of(ForceSample, recording.force),
            rows_of(ArmSample, recording.arm),
            rows_of(ForceSample, recording.second_force),
        )
        found = replay(
            ticks,
            tares,
            limits,
            force_axis=recording.metadata.get("force_axis", ""),
            second_axis=recording.metadata.get("second_force_axis", ""),
            changes=changes,
        )
    start_s = float(recording.ticks.time_s[0])
    notes = _notes(recording)
    if found.cause is None:
        notes += _ended(recording, start_s)
    return Judged(found, start_s, notes)
