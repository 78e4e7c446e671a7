"""Reads a record while it is being written: the messages completed since the last call."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from mcap import records
from mcap.opcode import Opcode

from stepload.record.container import MAGIC
from stepload.record.layout import EVENTS, MESSAGE_HEAD, MESSAGE_OPCODE, RECORD_HEAD
from stepload.record.reader import Event, Reading, events_in
from stepload.record.rows import ArmColumns, ForceColumns, TickColumns
from stepload.record.scan import (
    MAX_RECORD_BYTES,
    DamageError,
    RawRecord,
    Run,
    Scan,
    parse,
    record_head,
)

_ANY_SIZE = 1 << 40
"""Size limit of a growing file: none."""


class Announced(NamedTuple):
    """One channel of the record, with its schema."""

    topic: str
    schema: str
    definition: bytes


class Message(NamedTuple):
    """The bytes of a message and its time in ns."""

    time_ns: int
    data: bytes


class _Newest(Reading):
    """Reader state: the channels, and the newest message of each."""

    def __init__(self, scan: Scan) -> None:
        super().__init__(scan)
        self.announced: dict[str, Announced] = {}
        self.newest: dict[str, Message] = {}
        self.events: list[Message] = []

    def define(self, record: RawRecord) -> None:
        super().define(record)
        if record.opcode == Opcode.CHANNEL:
            channel = parse(records.Channel, record)
            name, definition = self.schemas.get(channel.schema_id, ("", b""))
            self.announced[channel.topic] = Announced(channel.topic, name, definition)

    def take_run(self, at: int, raw: bytes, run: Run) -> None:
        super().take_run(at, raw, run)
        topic = self.topics.get(run.channel)
        if topic is None or run.opcode != MESSAGE_OPCODE:
            return
        if topic is EVENTS:
            self.events += [
                _message(raw, run.at + i * run.stride, run.stride) for i in range(run.number)
            ]
        else:
            self.newest[topic.name] = _message(raw, run.end - run.stride, run.stride)


def _message(raw: bytes, at: int, length: int) -> Message:
    time_at = at + RECORD_HEAD + 6
    time_ns = int.from_bytes(raw[time_at : time_at + 8], "little")
    return Message(time_ns, raw[at + RECORD_HEAD + MESSAGE_HEAD : at + length])


class Tail:
    """A record that grows.

    Attributes:
        ended: the record was finished.

    Raises:
        OSError: it cannot be opened.
        DamageError: from `read`: it is no record.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path.open("rb")
        self._reading = _Newest(Scan(self._file, _ANY_SIZE))
        self._rest = b""
        self._at = 0
        self.ended = False

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def read(self, most: int = -1) -> None:
        """Read what has been completed, at most so many bytes of it."""
        data = self._rest + self._file.read(most)
        at = 0
        if self._at == 0:
            if len(data) < len(MAGIC):
                self._rest = data
                return
            if not data.startswith(MAGIC):
                raise DamageError(0, "not an MCAP file")
            at = len(MAGIC)
        while not self.ended:
            opcode, end = record_head(data, at, self._at, MAX_RECORD_BYTES)
            if opcode == 0 or end > len(data):
                break
            if opcode == Opcode.DATA_END:
                self.ended = True
            elif opcode != Opcode.MESSAGE_INDEX:
                body = data[at + RECORD_HEAD : end]
                self._reading.take(RawRecord(self._at + at, opcode, body))
            at = end
        self._rest = data[at:]
        self._at += at

    @property
    def announced(self) -> tuple[Announced, ...]:
        """Every channel so far."""
        return tuple(self._reading.announced.values())

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata at the start of the run."""
        return self._reading.metadata.get("run", {})

    @property
    def attachments(self) -> dict[str, bytes]:
        """Files of the record."""
        return self._reading.attachments

    def newest(self) -> dict[str, Message]:
        """The newest message of each topic that has a new one; `/events` is not among them."""
        found, self._reading.newest = self._reading.newest, {}
        return found

    def events(self) -> tuple[list[Message], tuple[Event, ...]]:
        """Every event since the last call: the bytes, and the decoded events."""
        messages, self._reading.events = self._reading.events, []
        texts, self._reading.texts = self._reading.texts, []
        return messages, events_in(texts)

    def rows(self) -> tuple[TickColumns, ForceColumns, ArmColumns, ForceColumns]:
        """Ticks, force, arm and second force since the last call."""
        stream, path = self._reading.stream, self.path
        return (
            stream("tick", path), stream("force", path), stream("arm", path),
            stream("second_force", path),
        )  # fmt: skip
