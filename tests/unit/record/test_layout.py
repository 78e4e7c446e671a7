"""The bytes of a record follow from the rows' declarations, and old and newer records are read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import pytest

from stepload.errors import BadInputError
from stepload.record import layout
from stepload.record.layout import STREAMS, TOPICS, Stream
from stepload.record.reader import read_recording
from stepload.record.rows import TickFields
from stepload.rig.samples import Number

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
