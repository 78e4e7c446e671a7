"""Reads a record back into numpy columns, whole chunks at a time, every checksum checked."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mcap import records
from mcap.opcode import Opcode
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.record import layout
from stepload.record.layout import MESSAGE_HEAD, MESSAGE_OPCODE, RECORD_HEAD, STREAMS, Topic
from stepload.record.rows import ArmColumns, DisplacementColumns, ForceColumns, TickColumns
from stepload.record.scan import (
    DamageError,
    RawRecord,
    Run,
    Scan,
    open_scan,
    parse,
    parse_attachment,
    runs,
)

BATCH_BYTES = 1 << 22
"""Message bytes gathered before they are turned into columns."""
MOST_EVENTS = 200_000
"""A run has some ten events for each step; each takes memory of its own."""
COLUMNS: Mapping[str, Any] = {
    "force": ForceColumns,
    "second_force": ForceColumns,
    "arm": ArmColumns,
    "displacement": DisplacementColumns,
    "tick": TickColumns,
}
"""The columns of each stream."""
_TEXT_AT = RECORD_HEAD + MESSAGE_HEAD + 4


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
        self._parts: dict[str, list[NDArray[np.generic]]] = {f: [] for f in topic.fields}

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
        if self._topic.name == "/tick" or values.dtype.kind == "i":
            return np.ascontiguousarray(blocks[:, -1])
        return np.asarray(blocks.mean(axis=1))

    def columns(self) -> dict[str, NDArray[np.generic]]:
        """Name → array of the messages since the last call; frees the memory of the batches."""
        self._flush()
        names = list(self._parts)
        found = {name: np.concatenate(self._parts.pop(name)) for name in names}
        self._parts = {name: [] for name in names}
        return found


def events_in(texts: list[tuple[int, bytes]]) -> tuple[Event, ...]:
    """The events that texts of a record hold, each with its place for errors."""
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


class Reading:
    """State while a file is walked."""

    def __init__(self, scan: Scan, mean_of: int = 1) -> None:
        self._scan = scan
        self._mean_of = mean_of
        self.schemas: dict[int, tuple[str, bytes]] = {}
        self.topics: dict[int, Topic] = {}
        self._columns: dict[str, _Columns] = {}
        self.texts: list[tuple[int, bytes]] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}

    def take(self, record: RawRecord) -> None:
        if record.opcode == Opcode.CHUNK:
            raw = self._scan.chunk(record).raw
            for run in runs(record.at, raw):
                if run.opcode == MESSAGE_OPCODE:
                    self.take_run(record.at, raw, run)
                else:
                    self.define(run.record(record.at, raw))
        elif record.opcode == Opcode.METADATA:
            metadata = parse(records.Metadata, record)
            self.metadata[metadata.name] = metadata.metadata
        elif record.opcode == Opcode.ATTACHMENT:
            attachment = parse_attachment(record)
            self.attachments[attachment.name] = attachment.data
        else:
            self.define(record)

    def define(self, record: RawRecord) -> None:
        """Take in a schema or a channel."""
        if record.opcode == Opcode.SCHEMA:
            schema = parse(records.Schema, record)
            self.schemas[schema.id] = schema.name, schema.data
        elif record.opcode == Opcode.CHANNEL:
            channel = parse(records.Channel, record)
            if (known := layout.TOPICS.get(channel.topic)) is None:
                return
            name, definition = self.schemas.get(channel.schema_id, ("", b""))
            if name != known.schema or channel.message_encoding != "cdr":
                raise DamageError(
                    record.at,
                    f"{channel.topic} is {name!r} in {channel.message_encoding!r}, "
                    f"not {known.schema!r} in 'cdr'",
                )
            topic = self.topics[channel.id] = _as_defined(record.at, known, definition)
            if topic.fields:
                self._columns.setdefault(topic.name, _Columns(topic, self._mean_of))

    def take_run(self, at: int, raw: bytes, run: Run) -> None:
        """Take in messages of one channel in a row."""
        topic = self.topics.get(run.channel)
        if topic is None:
            return
        if topic is layout.EVENTS:
            if len(self.texts) + run.number > MOST_EVENTS:
                raise DamageError(at, f"more than {MOST_EVENTS} events, which no run has")
            for i in range(run.number):
                start = run.at + i * run.stride
                self.texts.append((at, _text(memoryview(raw)[start : start + run.stride], at)))
        else:
            self._columns[topic.name].take(raw, run, at)

    def has(self, stream: str) -> bool:
        """Whether the file has the stream's topics."""
        return STREAMS[stream].topics[0].name in self._columns

    def stream(self, name: str, path: Path) -> Any:
        """The `COLUMNS` of a stream: all its topics, row by row together."""
        found: dict[str, NDArray[np.generic]] = {}
        numbers = {}
        for topic in STREAMS[name].topics:
            part = self._columns.get(topic.name, _Columns(topic, 1)).columns()
            numbers[topic.name] = len(next(iter(part.values())))
            found |= part
        if len(set(numbers.values())) > 1:
            told = ", ".join(f"{count} messages on {topic}" for topic, count in numbers.items())
            raise BadInputError(
                f"{path}: {told}; they belong together",
                hint="use the file as stepload wrote it, or `stepload recover` it",
            )
        number = next(iter(numbers.values()))
        fields = layout.fields_of(STREAMS[name].row)
        for field in fields.keys() - found.keys():  # declared after the file was made
            value = 0 if fields[field].numpy == "<i8" else np.nan
            found[field] = np.full(number, value, fields[field].numpy)
        return COLUMNS[name](**{field: found[field] for field in fields})


def _as_defined(at: int, known: Topic, definition: bytes) -> Topic:
    """The topic with its fields as the file's own message definition has them."""
    if not known.schema.startswith("stepload"):  # a standard type, which does not change
        return known
    try:
        fields = layout.read_definition(definition.decode())
        if any(fields[name] != known.fields[name] for name in fields.keys() & known.fields.keys()):
            raise ValueError("a field has another type than ours")
        return replace(known, fields=fields)
    except ValueError as error:
        raise DamageError(at, f"the message definition of {known.name}: {error}") from error


def read_recording(path: Path, mean_of: int = 1) -> Recording:
    """Read a record, also an unfinished or cut one up to where it is whole.

    Args:
        mean_of: samples averaged into one, to fit long runs into memory (an hour at 1 kHz takes
            700 MB as it is). Their status bits are united; of ticks the last of each is kept.

    Raises:
        BadInputError: not a record of stepload, or nothing readable in it.
    """
    file, scan = open_scan(path)
    reading = Reading(scan, mean_of)
    damage = ""
    with file:
        try:
            for record in scan.records():
                reading.take(record)
        except DamageError as error:
            damage = str(error)
    if "run" not in reading.metadata or not reading.has("tick"):
        raise BadInputError(
            f"{path}: no record of a run" + (f" ({damage})" if damage else ""),
            hint="`stepload recover` keeps what is whole of it"
            if damage
            else "`stepload run` writes such records; a CSV file must be named *.csv",
        )
    try:
        events = events_in(reading.texts)
        results = results_in(reading.attachments)
    except DamageError as error:
        raise BadInputError(f"{path}: {error}") from error
    outcome = reading.metadata.get("result", {})
    second = reading.stream("second_force", path)
    gauge = reading.stream("displacement", path)
    return Recording(
        path=path,
        force=reading.stream("force", path),
        second_force=second if reading.has("second_force") else None,
        arm=reading.stream("arm", path),
        displacement=gauge if reading.has("displacement") else None,
        ticks=reading.stream("tick", path),
        events=events,
        metadata=reading.metadata["run"],
        outcome=outcome,
        attachments=reading.attachments,
        results=results,
        partial=bool(damage) or "recovered" in reading.metadata or results is None,
        damage=damage,
    )


def results_in(attachments: Mapping[str, bytes]) -> Mapping[str, object] | None:
    """The object of results.json; None where it is not among the attachments.

    Raises:
        DamageError: it is no object.
    """
    if "results.json" not in attachments:
        return None
    try:
        found = json.loads(attachments["results.json"])
    except (ValueError, RecursionError) as error:
        raise DamageError(0, f"results.json: {error!r}") from error
    if not isinstance(found, dict):
        raise DamageError(0, "results.json: not a mapping")
    return found
