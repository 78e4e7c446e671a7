"""Reads a record back into numpy columns, whole chunks at a time, every checksum checked."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap import records
from mcap.opcode import Opcode
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.record import layout
from stepload.record.layout import MESSAGE_HEAD, MESSAGE_OPCODE, RECORD_HEAD, Topic
from stepload.record.scan import DamageError, RawRecord, Run, Scan, open_scan, parse, runs

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

BATCH_BYTES = 1 << 22
"""Message bytes gathered before they are turned into columns."""
MOST_EVENTS = 200_000
"""A run has some ten events for each step; each takes memory of its own."""
_TEXT_AT = RECORD_HEAD + MESSAGE_HEAD + 4


@dataclass(frozen=True, slots=True)
class ForceColumns:
    """A force sensor's samples; `time_s` is the receive time, `wrench` (N, 6) in N and N·m."""

    time_s: FloatArray
    sequence: IntArray
    device_time_s: FloatArray
    status: IntArray
    temperature_c: FloatArray
    wrench: FloatArray


@dataclass(frozen=True, slots=True)
class ArmColumns:
    """The arm's samples; `time_s` is the receive time, `pose` (N, 6) in m and rad."""

    time_s: FloatArray
    sequence: IntArray
    device_time_s: FloatArray
    status: IntArray
    position_m: FloatArray
    force_n: FloatArray
    pose: FloatArray


@dataclass(frozen=True, slots=True)
class DisplacementColumns:
    """A displacement gauge's samples; `time_s` is the receive time."""

    time_s: FloatArray
    sequence: IntArray
    device_time_s: FloatArray
    status: IntArray
    displacement_m: FloatArray


@dataclass(frozen=True, slots=True)
class TickColumns:
    """What the engine decided, one row a tick; columns as in `rows.TickRow`."""

    time_s: FloatArray
    target_m: FloatArray
    force_n: FloatArray
    second_force_n: FloatArray
    predicted_peak_n: FloatArray
    limit_n: FloatArray
    compliance_m_per_n: FloatArray
    level_n: FloatArray
    late_s: FloatArray
    phase: IntArray
    cycle: IntArray
    step: IntArray


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened; non-finite numbers in `data` are the texts "nan", "inf", "-inf"."""

    time_s: float
    kind: str
    data: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class Recording:
    """One run. All times are on the run's clock (host monotonic, or virtual).

    `metadata` is what the run began with, `outcome` its end (verdict, recorded and dropped counts).
    `partial` says that the run never finished its record: interrupted, recovered or cut; `damage`
    where and why reading ended early, "" where it did not.
    """

    path: Path
    force: ForceColumns
    second_force: ForceColumns | None
    arm: ArmColumns
    displacement: DisplacementColumns | None
    ticks: TickColumns
    events: tuple[Event, ...]
    metadata: Mapping[str, str]
    outcome: Mapping[str, str]
    attachments: Mapping[str, bytes]
    results: Mapping[str, object] | None
    partial: bool
    damage: str


class _Columns:
    """Gathers one channel's messages and turns them into columns batch by batch."""

    def __init__(self, topic: Topic, mean_of: int) -> None:
        assert topic.dtype is not None
        self._mean_of = mean_of
        self._topic = topic
        self._dtype = topic.dtype
        self._waiting: list[memoryview] = []
        self._waiting_bytes = 0
        self._parts: dict[str, list[NDArray[np.generic]]] = {f: [] for f, _, _ in topic.fields}

    def take(self, raw: bytes, run: Run, at: int) -> None:
        if run.stride != self._dtype.itemsize:
            raise DamageError(
                at,
                f"{self._topic.name} has a message of {run.stride - RECORD_HEAD} bytes, "
                f"not {self._dtype.itemsize - RECORD_HEAD}",
            )
        self._waiting.append(memoryview(raw)[run.at : run.end])
        self._waiting_bytes += run.stride * run.number
        if self._waiting_bytes >= BATCH_BYTES:
            self._flush()

    def _flush(self) -> None:
        data = memoryview(b"".join(self._waiting))
        whole = len(data) // self._dtype.itemsize // self._mean_of * self._mean_of
        rows = np.frombuffer(data, self._dtype, whole)
        rest = data[rows.nbytes :]
        self._waiting = [rest]
        self._waiting_bytes = len(rest)
        for name, parts in self._parts.items():
            parts.append(self._condense(name, rows[name]))

    def _condense(self, name: str, values: NDArray[np.generic]) -> NDArray[np.generic]:
        k = self._mean_of
        if k == 1:
            return np.ascontiguousarray(values)
        blocks = values.reshape(-1, k, *values.shape[1:])
        if name == "status":
            return np.asarray(np.bitwise_or.reduce(blocks, axis=1))
        if self._topic is layout.TICK or values.dtype.kind == "i":
            return np.ascontiguousarray(blocks[:, -1])
        return np.asarray(blocks.mean(axis=1))

    def columns(self) -> dict[str, NDArray[np.generic]]:
        """Name → array of all messages; gives the batches' memory back as it goes."""
        self._flush()
        names = list(self._parts)
        return {name: np.concatenate(self._parts.pop(name)) for name in names}


def _events(texts: list[tuple[int, bytes]]) -> tuple[Event, ...]:
    events = []
    for at, text in texts:
        try:
            found = json.loads(text)
            event = Event(float(found["time_s"]), str(found["kind"]), dict(found["data"]))
        except (ValueError, TypeError, KeyError, RecursionError, OverflowError) as error:
            raise DamageError(at, f"an event that is not ours: {error!r}") from error
        events.append(event)
    return tuple(events)


def _text(message: memoryview, at: int) -> bytes:
    """The text of a std_msgs/String message record."""
    length = int.from_bytes(message[_TEXT_AT : _TEXT_AT + 4], "little")
    text = bytes(message[_TEXT_AT + 4 : _TEXT_AT + 4 + length])
    if length < 1 or len(text) != length:
        raise DamageError(at, "an event's text goes beyond its message")
    return text[:-1]


class _Reading:
    """State while a file is walked."""

    def __init__(self, scan: Scan, mean_of: int) -> None:
        self._scan = scan
        self._schemas: dict[int, str] = {}
        self._topics: dict[int, Topic] = {}
        self.columns = {t.name: _Columns(t, mean_of) for t in layout.TOPICS if t.fields}
        self.present: set[str] = set()
        self.texts: list[tuple[int, bytes]] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}

    def take(self, record: RawRecord) -> None:
        if record.opcode == Opcode.CHUNK:
            raw = self._scan.chunk(record).raw
            for run in runs(record.at, raw):
                if run.opcode == MESSAGE_OPCODE:
                    self._take_run(record.at, raw, run)
                else:
                    self._take_definition(
                        RawRecord(record.at, run.opcode, raw[run.at + RECORD_HEAD : run.end])
                    )
        elif record.opcode == Opcode.METADATA:
            metadata = parse(records.Metadata, record)
            self.metadata[metadata.name] = metadata.metadata
        elif record.opcode == Opcode.ATTACHMENT:
            if int.from_bytes(record.body[-4:], "little") != zlib.crc32(record.body[:-4]):
                raise DamageError(record.at, "the checksum of an attachment is wrong")
            attachment = parse(records.Attachment, record)
            self.attachments[attachment.name] = attachment.data
        else:
            self._take_definition(record)

    def _take_definition(self, record: RawRecord) -> None:
        if record.opcode == Opcode.SCHEMA:
            schema = parse(records.Schema, record)
            self._schemas[schema.id] = schema.name
        elif record.opcode == Opcode.CHANNEL:
            channel = parse(records.Channel, record)
            known = {t.name: t for t in layout.TOPICS}.get(channel.topic)
            if known is None:
                return
            schema_name = self._schemas.get(channel.schema_id, "")
            if schema_name != known.schema or channel.message_encoding != "cdr":
                raise DamageError(
                    record.at,
                    f"{channel.topic} is {schema_name!r} in {channel.message_encoding!r}, "
                    f"not {known.schema!r} in 'cdr'",
                )
            self._topics[channel.id] = known
            self.present.add(known.name)

    def _take_run(self, at: int, raw: bytes, run: Run) -> None:
        topic = self._topics.get(run.channel)
        if topic is None:
            return
        if topic is layout.EVENTS:
            if len(self.texts) + run.number > MOST_EVENTS:
                raise DamageError(at, f"more than {MOST_EVENTS} events, which no run has")
            for i in range(run.number):
                start = run.at + i * run.stride
                self.texts.append((at, _text(memoryview(raw)[start : start + run.stride], at)))
        else:
            self.columns[topic.name].take(raw, run, at)

    def force(self, wrench: Topic, sample: Topic, path: Path) -> ForceColumns:
        """Both channels of a force sensor, row by row together."""
        values = self.columns[wrench.name].columns()["wrench"]
        about = self.columns[sample.name].columns()
        if len(values) != len(about["sequence"]):
            raise BadInputError(
                f"{path}: {len(values)} messages on {wrench.name}, "
                f"{len(about['sequence'])} on {sample.name}; they belong together",
                hint="use the file as stepload wrote it, or `stepload recover` it",
            )
        return ForceColumns(time_s=about.pop("receive_time_s"), wrench=values, **about)  # type: ignore[arg-type]


def read_recording(path: Path, mean_of: int = 1) -> Recording:
    """Read a record, also an unfinished or cut one up to where it is whole.

    Args:
        mean_of: samples averaged into one, to fit long runs into memory (an hour at 1 kHz takes
            700 MB as it is). Their status bits are united; of ticks the last of each is kept.

    Raises:
        BadInputError: not a record of stepload, or nothing readable in it.
    """
    file, scan = open_scan(path)
    reading = _Reading(scan, mean_of)
    damage = ""
    with file:
        try:
            for record in scan.records():
                reading.take(record)
        except DamageError as error:
            damage = str(error)
    if "run" not in reading.metadata or layout.TICK.name not in reading.present:
        raise BadInputError(
            f"{path}: no record of a run" + (f" ({damage})" if damage else ""),
            hint="`stepload run` writes such records; a CSV file must be named *.csv",
        )
    try:
        events = _events(reading.texts)
        results = _results(reading.attachments)
    except DamageError as error:
        raise BadInputError(f"{path}: {error}") from error
    outcome = reading.metadata.get("result", {})
    arm, gauge = (reading.columns[t.name].columns() for t in (layout.ARM, layout.DISPLACEMENT))
    has_second = layout.SECOND.name in reading.present
    return Recording(
        path=path,
        force=reading.force(layout.FORCE, layout.FORCE_SAMPLE, path),
        second_force=reading.force(layout.SECOND, layout.SECOND_SAMPLE, path)
        if has_second
        else None,
        arm=ArmColumns(time_s=arm.pop("receive_time_s"), **arm),  # type: ignore[arg-type]
        displacement=DisplacementColumns(time_s=gauge.pop("receive_time_s"), **gauge)  # type: ignore[arg-type]
        if layout.DISPLACEMENT.name in reading.present
        else None,
        ticks=TickColumns(**reading.columns[layout.TICK.name].columns()),  # type: ignore[arg-type]
        events=events,
        metadata=reading.metadata["run"],
        outcome=outcome,
        attachments=reading.attachments,
        results=results,
        partial=bool(damage) or "recovered" in reading.metadata or results is None,
        damage=damage,
    )


def _results(attachments: Mapping[str, bytes]) -> Mapping[str, object] | None:
    if "results.json" not in attachments:
        return None
    try:
        found = json.loads(attachments["results.json"])
    except (ValueError, RecursionError) as error:
        raise DamageError(0, f"results.json: {error!r}") from error
    if not isinstance(found, dict):
        raise DamageError(0, "results.json: not a mapping")
    return found
