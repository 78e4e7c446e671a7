"""Lines of text from gauges and load cells: cut, damaged, too long."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.gauge.sensor import DEFAULT_PATTERN as GAUGE_PATTERN
from stepload_drivers.line.codec import (
    MAX_LINE_BYTES,
    LineDecoder,
    line_pattern,
    number_of,
)


def decoder(scale=1.0, terminator=b"\r", number=None, begin=True):
    number = number or number_of(line_pattern(GAUGE_PATTERN, "value"), "value", scale)
    lines = LineDecoder(number, terminator)
    if begin:
        lines.begin_line()
    return lines


@pytest.mark.parametrize(
    ("line", "value"), [(b"+0012.345\r", 12.345), (b"01A-0000.0120\r", -0.012), (b" 7\r", 7.0)]
)
def test_usual_lines(line, value):
    assert decoder(1e-3).feed(line) == pytest.approx([value * 1e-3])


def test_the_first_piece_may_be_cut_and_is_not_used():
    assert decoder(begin=False).feed(b"12.345\r+0001.000\r") == [1.0]


def test_two_byte_terminator_may_be_split():
    lines = decoder(terminator=b"\r\n")
    assert lines.feed(b"+1.0\r") == []
    assert lines.feed(b"\n+2.0\r\n") == [1.0, 2.0]


@pytest.mark.parametrize(
    "line", [b"ERR 4\r", b"+12..3\r", b"+1.0 mm\r", b"\xff1.0\r", b"nan\r", b"+1.0+2.0\r"]
)
def test_other_lines_are_counted_not_guessed(line):
    lines = decoder()
    assert lines.feed(line) == []
    assert lines.damaged == 1


@pytest.mark.parametrize("line", [b"nan\r", b"inf\r", b"-Infinity\r", b"1e999\r"])
def test_a_driver_of_ones_own_cannot_deliver_what_is_not_finite(line):
    lines = decoder(number=float)
    assert lines.feed(line + b"2\r") == [2.0]
    assert lines.damaged == 1


def test_a_line_without_end_is_given_up_with_all_that_belongs_to_it():
    lines = decoder()
    for _ in range(5):
        assert lines.feed(b"1" * (MAX_LINE_BYTES + 1)) == []
        assert len(lines._buffer) <= MAX_LINE_BYTES
    assert lines.feed(b"1\r+3.0\r") == [3.0]
    assert lines.damaged == 1


@given(st.lists(st.binary(max_size=60), max_size=10))
def test_random_bytes_give_only_finite_readings(pieces):
    lines = decoder(number=float, begin=False)
    for piece in pieces:
        assert all(map(math.isfinite, lines.feed(piece)))


@given(st.lists(st.integers(-99999, 99999), max_size=8), st.data())
def test_any_cutting_of_the_stream_gives_every_reading_once(numbers, data):
    stream, lines, got = b"".join(b"%+06d\r" % n for n in numbers), decoder(), []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        got += lines.feed(stream[:size])
        stream = stream[size:]
    assert got == numbers
    assert lines.damaged == 0
