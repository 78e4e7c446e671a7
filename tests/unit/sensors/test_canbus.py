"""Lines of an slcan adapter: python-can's own parser trusts them, this one does not."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload_drivers.canbus import slcan_frame


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("t00180B0271FFCEF44803", (1, bytes.fromhex("0B0271FFCEF44803"))),
        ("t2000", (0x200, b"")),
        ("t2002ABCD1F40", (0x200, b"\xab\xcd")),
    ],
)
def test_frames_with_and_without_time_stamp(line, expected):
    assert slcan_frame(line) == expected


@pytest.mark.parametrize(
    "line", ["t0018AABB", "t00", "", "tXYZ0", "t8000", "t0019", "T000000010", "r0010", "t001 2AABB"]
)
def test_cut_and_foreign_lines_are_no_frames(line):
    assert slcan_frame(line) is None


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=40))
def test_any_text_is_a_frame_or_none(line):
    frame = slcan_frame(line)
    assert frame is None or (frame[0] < 0x800 and len(frame[1]) <= 8)
