"""The bytes of a record follow from the rows' declarations, and old and newer records are read."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import pytest

from stepload.errors import BadInputError
from stepload.record import layout
from stepload.record.layout import STREAMS, TOPICS, Stream
from stepload.record.reader import _text, read_recording
from stepload.record.rows import TickFields, rows_of
from stepload.record.scan import DamageError
from stepload.rig.samples import ArmSample, ForceSample, Number

DEFINITIONS = {
    "/force/sample": """\
# How the wrench with the same place in the stream was taken
int64 sequence
float64 device_time_s  # the device's own clock, NaN: none
float64 receive_time_s  # the host's monotonic clock
float64 temperature_c  # NaN: not told
int64 status  # bits: 1 overrange, 2 saturated, 4 invalid, 8 device fault
""",
    "/arm": """\
int64 sequence
float64 device_time_s  # the controller's own clock
float64 receive_time_s  # the host's monotonic clock
int64 status  # bits as in ForceSample, 16: not able to follow commands
float64 position_m  # travel towards the plate
float64 force_n  # the arm's own force channel, NaN: none
float64[6] pose  # x, y, z in m, rotation vector in rad
float64[6] wrench  # the arm's own, on the plate, axis 3 along the approach; NaN: not told
""",
    "/displacement": """\
int64 sequence
float64 device_time_s
float64 receive_time_s
int64 status
float64 displacement_m  # positive when the gap closes
""",
    "/tick": """\
float64 time_s  # the host's monotonic clock
float64 target_m  # commanded travel
float64 force_n  # tared, positive when pressing
float64 second_force_n
float64 predicted_peak_n
float64 limit_n
float64 compliance_m_per_n
float64 level_n
float64 late_s
int64 phase
int64 cycle
int64 step
""",
}


@pytest.mark.parametrize("topic", DEFINITIONS)
def test_message_definitions_are_those_of_all_records(topic: str) -> None:
    assert TOPICS[topic].definition == DEFINITIONS[topic]


def test_channels_keep_their_numbers_and_types() -> None:
    assert [(t.channel, t.name, t.schema.rpartition("/")[2]) for t in TOPICS.values()] == [
        (1, "/force", "WrenchStamped"),
        (2, "/force/sample", "ForceSample"),
        (3, "/second_force", "WrenchStamped"),
        (4, "/second_force/sample", "ForceSample"),
        (5, "/arm", "ArmSample"),
        (6, "/displacement", "DisplacementSample"),
        (7, "/tick", "Tick"),
        (8, "/events", "String"),
    ]


def test_a_template_has_every_constant_byte_of_its_message() -> None:
    force = TOPICS["/force"].template()
    assert force[:11] == struct.pack("<BQH", 5, len(force) - 9, 1)
    assert force[31:51] == b"\x00\x01\x00\x00" + bytes(8) + struct.pack("<I", 6) + b"forc"
    assert len(force) - 31 == 76  # a stamped wrench in CDR, padded to 8 behind "force\0"
    arm = TOPICS["/arm"].template()
    assert arm == struct.pack("<BQH", 5, len(arm) - 9, 5) + bytes(20) + b"\x00\x01\x00\x00" + bytes(
        18 * 8
    )


@pytest.mark.parametrize(("gone", "value"), [("level_n", np.nan), ("cycle", 0)])
def test_records_of_other_fields_are_read(
    write_record: Callable[..., Path], make: Any, monkeypatch: pytest.MonkeyPatch,
    gone: str, value: float,
) -> None:  # fmt: skip
    """From before a field was declared, and with one that was declared later."""
    hints = {n: kind for n, kind in get_type_hints(TickFields).items() if n != gone}
    row = NamedTuple("row", [*hints.items(), ("later_n", Number)])  # type: ignore[misc]
    with monkeypatch.context() as patch:
        patch.setitem(STREAMS, "tick", Stream(row, (layout._rows(7, "/tick", "Tick", row),)))
        path = write_record(
            chunks=2, tick=lambda i: row(*(getattr(make.tick(i), n) for n in hints), 7.0)
        )
    got = read_recording(path)
    assert not got.damage
    for name in TickFields._fields:
        expected = [value if name == gone else getattr(make.tick(i), name) for i in range(50)]
        np.testing.assert_array_equal(getattr(got.ticks, name), expected, err_msg=name)


@pytest.mark.parametrize("line", ["", "# nothing", "float64", "float32 a", 900 * "float64 abc\n"])
def test_a_definition_that_no_row_has_is_refused(line: str) -> None:
    with pytest.raises(ValueError):
        layout.read_definition(line)


@pytest.mark.parametrize("line", ["float64 sequence", "float64 opcode", "float64 words", "\x00"])
def test_a_hostile_definition_is_damage(
    write_record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    topic = STREAMS["arm"].topics[0]
    definition = topic.definition.replace("int64 sequence", line)
    hostile = layout.Topic(topic.channel, topic.name, topic.schema, definition, topic.fields)
    with monkeypatch.context() as patch:
        patch.setitem(STREAMS, "arm", Stream(ArmSample, (hostile,)))
        path = write_record(chunks=1)
    with pytest.raises(BadInputError, match="the message definition of /arm"):
        read_recording(path)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        (b"\x03\x00\x00\x00cdr", b"\x03\x00\x00\x00xml", "'xml', not"),
        (b"stepload_msgs/msg/Tick", b"stepload_msgs/msg/Tock", "'stepload_msgs/msg/Tock'"),
    ],
)
def test_messages_of_another_type_or_encoding_are_refused(
    write_record: Callable[..., Path], old: bytes, new: bytes, match: str
) -> None:
    path = write_record(chunks=1)
    path.write_bytes(path.read_bytes().replace(old, new))
    with pytest.raises(BadInputError, match=match):
        read_recording(path)


def test_messages_of_another_length_than_defined_are_damage(
    write_record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, make: Any
) -> None:
    hints = [*get_type_hints(TickFields).items(), ("later_n", Number)]
    row = NamedTuple("row", hints)  # type: ignore[misc]
    tick = TOPICS["/tick"]
    lying = layout.Topic(7, "/tick", tick.schema, tick.definition, layout.fields_of(row))
    with monkeypatch.context() as patch:
        patch.setitem(STREAMS, "tick", Stream(row, (lying,)))
        path = write_record(chunks=1, tick=lambda i: row(*make.tick(i), 7.0))
    assert "/tick has a message of 130 bytes, not 122" in read_recording(path).damage


@pytest.mark.parametrize("length", [0, 7, 2**32 - 1])
def test_a_text_that_its_message_does_not_hold_is_damage(length: int) -> None:
    message = layout.string_record(layout.EVENTS, 0, 0, b"hello")
    assert _text(memoryview(message), 0) == b"hello"
    at = message.index(b"hello") - 4
    lying = message[:at] + struct.pack("<I", length) + message[at + 4 :]
    with pytest.raises(DamageError, match="beyond its message"):
        _text(memoryview(lying), 0)


def test_wrenches_without_their_samples_are_refused(
    write_record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    wrench, _ = STREAMS["force"].topics
    with monkeypatch.context() as patch:
        patch.setitem(STREAMS, "force", Stream(ForceSample, (wrench,)))
        path = write_record(chunks=1)
    with pytest.raises(BadInputError, match="50 messages on /force, 0 messages on /force/sample"):
        read_recording(path)


def test_rows_come_back_from_columns(write_record: Callable[..., Path], make: Any) -> None:
    got = read_recording(write_record(chunks=1))
    assert rows_of(ForceSample, got.force) == [make.force(i) for i in range(50)]
    assert rows_of(ForceSample, None) == []
    row = rows_of(ArmSample, got.arm)[3]
    assert row[4] == make.arm(3).position_m
    assert row.pose == make.arm(3).pose
