"""What is in a record: channels, their ROS 2 message types, and the bytes of each.

Every message of a channel but `/events` has one length (its strings are constant), so a whole chunk
is encoded and decoded as one numpy record array. CDR rule: a number is aligned to its own size,
counted from the end of the 4-byte encapsulation header.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple, get_type_hints

import numpy as np

from stepload.record.rows import TickRow
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample, Number, Six, Whole

CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
MESSAGE_OPCODE = 5
RECORD_HEAD = 9
"""Opcode and length in front of every MCAP record."""
MESSAGE_HEAD = 22
"""Channel id, sequence, log time and publish time in front of a message's data."""
LOG_TIME_AT = RECORD_HEAD + 6
"""Byte of a message record where its log time stands."""

_SEPARATOR = "=" * 80 + "\n"
HEADER = (
    _SEPARATOR
    + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + _SEPARATOR
    + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
_WRENCH = (
    "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n"
    + HEADER
    + _SEPARATOR
    + "MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"
    + _SEPARATOR
    + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
)


class Kind(NamedTuple):
    """A type of field: its name in a message definition, its numpy format, its struct format."""

    ros: str
    numpy: str
    packed: str

    @property
    def words(self) -> int:
        """How many words of 8 bytes it takes."""
        return np.dtype(self.numpy).itemsize // 8


KINDS: Mapping[object, Kind] = {
    Whole: Kind("int64", "<i8", "q"),
    Number: Kind("float64", "<f8", "d"),
    Six: Kind("float64[6]", "(6,)<f8", "6d"),
}
_LONGEST = 1 << 13
"""Characters of a message definition."""
Fields = Mapping[str, Kind]
"""Fields in the order of their bytes, by name."""


@cache
def fields_of(row: type) -> Fields:
    """The fields of a row type, in the order of its declaration."""
    return {name: KINDS[declared] for name, declared in get_type_hints(row).items()}


def row_dtype(row: type) -> np.dtype[np.void]:
    """A row with its fields one after the other, as numpy sees it."""
    return np.dtype([(name, kind.numpy) for name, kind in fields_of(row).items()])


def read_definition(definition: str) -> Fields:
    """The fields of a message definition that has no other types than a row's.

    Raises:
        ValueError: it has others, no fields, or more than any message of ours.
    """
    named = {kind.ros: kind for kind in KINDS.values()}
    lines = [line.partition("#")[0].split() for line in definition[:_LONGEST].splitlines()]
    try:
        fields = {name: named[kind] for kind, name in filter(None, lines)}
    except KeyError as error:
        raise ValueError(f"type {str(error)[:80]}") from error
    if not fields:
        raise ValueError("no fields")
    return fields


@dataclass(frozen=True, slots=True)
class Topic:
    """One channel of a record: where its numbers lie in an MCAP message record.

    `frame` is the constant frame_id of types with a std_msgs/Header, None for those without.
    `dtype` covers the whole record including its head, its field "words" all numbers of the
    message at once; None for the text channel.
    """

    channel: int
    name: str
    schema: str
    definition: str
    fields: Fields
    frame: str | None = None
    dtype: np.dtype[np.void] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        if self.fields:
            object.__setattr__(self, "dtype", _record_dtype(self.fields, self.frame))

    def template(self) -> bytes:
        """One record with every constant byte in place."""
        assert self.dtype is not None
        record = np.zeros(1, self.dtype)
        record["opcode"] = MESSAGE_OPCODE
        record["length"] = self.dtype.itemsize - RECORD_HEAD
        record["channel"] = self.channel
        record["cdr"] = int.from_bytes(CDR_LITTLE_ENDIAN, "little")
        if self.frame is not None:
            record["frame_length"] = len(self.frame) + 1
            record["frame"] = self.frame.encode()
        return record.tobytes()


def _record_dtype(fields: Fields, frame: str | None) -> np.dtype[np.void]:
    names = ["opcode", "length", "channel", "sequence_u4", "log_ns", "publish_ns", "cdr"]
    formats = ["u1", "<u8", "<u2", "<u4", "<u8", "<u8", "<u4"]
    offsets = [0, 1, 9, 11, 15, 23, 31]
    body = RECORD_HEAD + MESSAGE_HEAD + len(CDR_LITTLE_ENDIAN)
    at = 0
    if frame is not None:
        names += ["stamp_s", "stamp_ns", "frame_length", "frame"]
        formats += ["<i4", "<u4", "<u4", f"S{len(frame) + 1}"]
        offsets += [body, body + 4, body + 8, body + 12]
        at = 12 + len(frame) + 1
    at += -at % 8
    names.append("words")
    formats.append(f"({sum(kind.words for kind in fields.values())},)<u8")
    offsets.append(body + at)
    for name, kind in fields.items():
        names.append(name)
        formats.append(kind.numpy)
        offsets.append(body + at)
        at += 8 * kind.words
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": body + at})


def _rows(
    channel: int, name: str, schema: str, row: type, about: str = "", without: str = "",
    last: str = "",
) -> Topic:  # fmt: skip
    """A topic of a row type; its message definition has one line a field, with its comment.

    Args:
        about: a comment in front of all.
        without: a field that is left out.
        last: a field that stands behind those declared after it.
    """
    declared = get_type_hints(row, include_extras=True)
    fields = dict(sorted(fields_of(row).items(), key=lambda field: field[0] == last))
    fields.pop(without, None)
    lines = [f"# {about}\n"] if about else []
    for field_name, kind in fields.items():
        texts = getattr(declared[field_name], "__metadata__", ())
        lines.append(f"{kind.ros} {field_name}{''.join(f'  # {text}' for text in texts)}\n")
    return Topic(channel, name, f"stepload_msgs/msg/{schema}", "".join(lines), fields)


class Stream(NamedTuple):
    """What the loop pushes rows of one type into, and the topics made of each row."""

    row: type
    topics: tuple[Topic, ...]


def _force(first: int, name: str) -> Stream:
    about = "How the wrench with the same place in the stream was taken"
    wrench = {"wrench": KINDS[Six]}
    return Stream(
        ForceSample,
        (
            Topic(first, f"/{name}", "geometry_msgs/msg/WrenchStamped", _WRENCH, wrench, name),
            _rows(
                first + 1, f"/{name}/sample", "ForceSample", ForceSample, about, "wrench", "status"
            ),
        ),
    )


def _stream(channel: int, name: str, schema: str, row: type) -> Stream:
    return Stream(row, (_rows(channel, name, schema, row),))


STREAMS: Mapping[str, Stream] = {
    "force": _force(1, "force"),
    "second_force": _force(3, "second_force"),
    "arm": _stream(5, "/arm", "ArmSample", ArmSample),
    "displacement": _stream(6, "/displacement", "DisplacementSample", DisplacementSample),
    "tick": _stream(7, "/tick", "Tick", TickRow),
}
EVENTS = Topic(8, "/events", "std_msgs/msg/String", "string data\n", {})
TOPICS = {t.name: t for t in [t for stream in STREAMS.values() for t in stream.topics] + [EVENTS]}


def string_record(topic: Topic, sequence: int, time_ns: int, text: bytes) -> bytes:
    """A std_msgs/String message record."""
    head = struct.pack(
        "<BQHIQQ",
        MESSAGE_OPCODE,
        MESSAGE_HEAD + 4 + 4 + len(text) + 1,
        topic.channel,
        sequence & 0xFFFFFFFF,
        time_ns,
        time_ns,
    )
    return head + CDR_LITTLE_ENDIAN + struct.pack("<I", len(text) + 1) + text + b"\x00"
