"""What is in a record: channels, their ROS 2 message types, and the bytes of each.

Every message of a channel but `/events` has one length (its strings are constant), so a whole chunk
is encoded and decoded as one numpy record array. CDR rule: a number is aligned to its own size,
counted from the end of the 4-byte encapsulation header.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np

CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
MESSAGE_OPCODE = 5
RECORD_HEAD = 9
"""Opcode and length in front of every MCAP record."""
MESSAGE_HEAD = 22
"""Channel id, sequence, log time and publish time in front of a message's data."""
LOG_TIME_AT = RECORD_HEAD + 6
"""Byte of a message record where its log time stands."""

_SEPARATOR = "=" * 80 + "\n"
_HEADER = (
    _SEPARATOR
    + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + _SEPARATOR
    + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
_WRENCH = (
    "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n"
    + _HEADER
    + _SEPARATOR
    + "MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"
    + _SEPARATOR
    + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
)
_SAMPLE = (
    "# How the wrench with the same place in the stream was taken\n"
    "int64 sequence\n"
    "float64 device_time_s  # the device's own clock, NaN: none\n"
    "float64 receive_time_s  # the host's monotonic clock\n"
    "float64 temperature_c  # NaN: not told\n"
    "int64 status  # bits: 1 overrange, 2 saturated, 4 invalid, 8 device fault\n"
)
_ARM = (
    "int64 sequence\n"
    "float64 device_time_s  # the controller's own clock\n"
    "float64 receive_time_s  # the host's monotonic clock\n"
    "int64 status  # bits as in ForceSample, 16: not able to follow commands\n"
    "float64 position_m  # travel towards the plate\n"
    "float64 force_n  # the arm's own force channel, NaN: none\n"
    "float64[6] pose  # x, y, z in m, rotation vector in rad\n"
)
_DISPLACEMENT = (
    "int64 sequence\n"
    "float64 device_time_s\n"
    "float64 receive_time_s\n"
    "int64 status\n"
    "float64 displacement_m  # positive when the gap closes\n"
)
_TICK = (
    "float64 time_s  # the host's monotonic clock\n"
    "float64 target_m  # commanded travel\n"
    "float64 force_n  # tared, positive when pressing\n"
    "float64 second_force_n\n"
    "float64 predicted_peak_n\n"
    "float64 limit_n\n"
    "float64 compliance_m_per_n\n"
    "float64 level_n\n"
    "float64 late_s\n"
    "int64 phase\n"
    "int64 cycle\n"
    "int64 step\n"
)

Fields = tuple[tuple[str, str, int], ...]
"""(name, numpy kind of 8 bytes, count) of each number."""

WRENCH_FIELDS: Fields = (("wrench", "<f8", 6),)
SAMPLE_FIELDS: Fields = (
    ("sequence", "<i8", 1),
    ("device_time_s", "<f8", 1),
    ("receive_time_s", "<f8", 1),
    ("temperature_c", "<f8", 1),
    ("status", "<i8", 1),
)
ARM_FIELDS: Fields = (
    ("sequence", "<i8", 1),
    ("device_time_s", "<f8", 1),
    ("receive_time_s", "<f8", 1),
    ("status", "<i8", 1),
    ("position_m", "<f8", 1),
    ("force_n", "<f8", 1),
    ("pose", "<f8", 6),
)
DISPLACEMENT_FIELDS: Fields = (
    ("sequence", "<i8", 1),
    ("device_time_s", "<f8", 1),
    ("receive_time_s", "<f8", 1),
    ("status", "<i8", 1),
    ("displacement_m", "<f8", 1),
)
TICK_FIELDS: Fields = (
    ("time_s", "<f8", 1),
    ("target_m", "<f8", 1),
    ("force_n", "<f8", 1),
    ("second_force_n", "<f8", 1),
    ("predicted_peak_n", "<f8", 1),
    ("limit_n", "<f8", 1),
    ("compliance_m_per_n", "<f8", 1),
    ("level_n", "<f8", 1),
    ("late_s", "<f8", 1),
    ("phase", "<i8", 1),
    ("cycle", "<i8", 1),
    ("step", "<i8", 1),
)


@dataclass(frozen=True, slots=True)
class Topic:
    """One channel of a record: where its numbers lie in an MCAP message record.

    `frame` is the constant frame_id of types with a std_msgs/Header, None for those without.
    `first_word` says where the fields begin in a ring row, both in words of 8 bytes.
    `dtype` covers the whole record including its head, its field "words" all numbers of the
    message at once; None for the text channel.
    """

    channel: int
    name: str
    schema: str
    definition: str
    fields: Fields
    frame: str | None = None
    first_word: int = 0
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
    formats.append(f"({sum(count for _, _, count in fields)},)<u8")
    offsets.append(body + at)
    for name, kind, count in fields:
        names.append(name)
        formats.append(kind if count == 1 else f"({count},){kind}")
        offsets.append(body + at)
        at += 8 * count
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": body + at})


_WRENCH_AT = len(SAMPLE_FIELDS)
FORCE = Topic(
    1, "/force", "geometry_msgs/msg/WrenchStamped", _WRENCH, WRENCH_FIELDS, "force", _WRENCH_AT
)
FORCE_SAMPLE = Topic(2, "/force/sample", "stepload_msgs/msg/ForceSample", _SAMPLE, SAMPLE_FIELDS)
SECOND = Topic(
    3,
    "/second_force",
    "geometry_msgs/msg/WrenchStamped",
    _WRENCH,
    WRENCH_FIELDS,
    "second_force",
    _WRENCH_AT,
)
SECOND_SAMPLE = Topic(
    4, "/second_force/sample", "stepload_msgs/msg/ForceSample", _SAMPLE, SAMPLE_FIELDS
)
ARM = Topic(5, "/arm", "stepload_msgs/msg/ArmSample", _ARM, ARM_FIELDS)
DISPLACEMENT = Topic(
    6,
    "/displacement",
    "stepload_msgs/msg/DisplacementSample",
    _DISPLACEMENT,
    DISPLACEMENT_FIELDS,
)
TICK = Topic(7, "/tick", "stepload_msgs/msg/Tick", _TICK, TICK_FIELDS)
EVENTS = Topic(8, "/events", "std_msgs/msg/String", "string data\n", ())

TOPICS = (FORCE, FORCE_SAMPLE, SECOND, SECOND_SAMPLE, ARM, DISPLACEMENT, TICK, EVENTS)


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
