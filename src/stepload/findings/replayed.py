"""The supervisor over a record, with the limits of the run or with others."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

from stepload.contact.press import Term
from stepload.errors import BadInputError, DomainError
from stepload.findings.untrusted import untrusted
from stepload.record.reader import ArmColumns, ForceColumns, Recording, TickColumns, read_recording
from stepload.record.rows import TickRow
from stepload.rig.samples import ArmSample, ForceSample
from stepload.run.limits import RunLimits
from stepload.run.replay import Replayed, group_by_tick, replay

FILE = "limits.json"


def limits_to_bytes(limits: RunLimits) -> bytes:
    """Every threshold of a run with its source, as a file of the record."""
    return json.dumps(asdict(limits)).encode()


def limits_from(attachments: Mapping[str, bytes]) -> RunLimits:
    """The thresholds a run was made with; the record may be anybody's.

    Raises:
        BadInputError: not there, or not what they should be.
    """
    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        data = json.loads(raw)
        terms = tuple(Term(**term) for term in data.pop("terms"))
        return RunLimits(**data, terms=terms)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError, DomainError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None


def _force_samples(columns: ForceColumns | None) -> list[ForceSample]:
    if columns is None:
        return []
    rows = zip(
        columns.sequence.tolist(), columns.device_time_s.tolist(), columns.time_s.tolist(),
        columns.status.tolist(), map(tuple, columns.wrench.tolist()),
        columns.temperature_c.tolist(), strict=True,
    )  # fmt: skip
    return [ForceSample(*row) for row in rows]


def _arm_samples(columns: ArmColumns) -> list[ArmSample]:
    rows = zip(
        columns.sequence.tolist(), columns.device_time_s.tolist(), columns.time_s.tolist(),
        columns.status.tolist(), columns.position_m.tolist(), columns.force_n.tolist(),
        map(tuple, columns.pose.tolist()), strict=True,
    )  # fmt: skip
    return [ArmSample(*row) for row in rows]


def _tick_rows(columns: TickColumns) -> list[TickRow]:
    by_name = [getattr(columns, name).tolist() for name in TickRow._fields]
    return [TickRow(*row) for row in zip(*by_name, strict=True)]


def _tares(recording: Recording) -> list[tuple[float, float, float]]:
    return [
        (
            event.time_s,
            float(event.data["mean_n"]),  # type: ignore[arg-type]
            float(event.data["second_mean_n"]),  # type: ignore[arg-type]
        )
        for event in recording.events
        if event.kind == "tare"
    ]


def _changes(recording: Recording, limits: RunLimits) -> list[tuple[float, RunLimits]]:
    """Limits that the run went over to, after those it began with."""
    events = [event for event in recording.events if event.kind == "limits"]
    return [
        (event.time_s, replace(limits, **event.data))  # type: ignore[arg-type]
        for event in events[1:]
    ]


def replay_file(path: Path, *, force_limit_n: float | None = None) -> Replayed:
    """Judge a record tick by tick.

    Args:
        path: the record.
        force_limit_n: another F_lim than the run's.

    Raises:
        BadInputError: no record of ours, or a limit that is none.
    """
    recording = read_recording(path)
    limits = limits_from(recording.attachments)
    try:
        tares, changes = _tares(recording), _changes(recording, limits)
    except (KeyError, TypeError, ValueError, DomainError):
        raise BadInputError(f"{path}: tares or limits in the record have no numbers") from None
    if force_limit_n is not None:
        limits = replace(limits, force_limit_n=force_limit_n)
        changes = [(time_s, replace(c, force_limit_n=force_limit_n)) for time_s, c in changes]
    with untrusted(path):
        ticks = group_by_tick(
            _tick_rows(recording.ticks),
            _force_samples(recording.force),
            _arm_samples(recording.arm),
            _force_samples(recording.second_force),
        )
        return replay(
            ticks,
            tares,
            limits,
            force_axis=recording.metadata.get("force_axis", ""),
            second_axis=recording.metadata.get("second_force_axis", ""),
            changes=changes,
        )
