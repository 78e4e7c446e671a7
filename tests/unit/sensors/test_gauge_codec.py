"""Lines of digital gauges, cut and damaged."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.errors import BadInputError
from stepload_drivers.gauge.codec import MAX_LINE_BYTES, LineDecoder
from stepload_drivers.gauge.sensor import DEFAULT_PATTERN, GaugeSerial


def decoder(unit_m=1e-3, terminator=b"\r"):
    return LineDecoder(DEFAULT_PATTERN, unit_m, terminator)


@pytest.mark.parametrize(
    ("line", "millimetres"),
    [(b"+0012.345\r", 12.345), (b"01A-0000.0120\r", -0.012), (b" 7\r", 7.0)],
)
def test_usual_lines(line, millimetres):
    lines = decoder()
    lines.begin_line()
    assert lines.feed(line) == pytest.approx([millimetres * 1e-3])


def test_the_first_piece_may_be_cut_and_is_not_used():
    assert decoder().feed(b"12.345\r+0001.000\r") == [pytest.approx(1e-3)]


def test_two_byte_terminator_may_be_split():
    lines = decoder(terminator=b"\r\n")
    lines.begin_line()
    assert lines.feed(b"+1.0\r") == []
    assert lines.feed(b"\n+2.0\r\n") == pytest.approx([1e-3, 2e-3])


@pytest.mark.parametrize("line", [b"ERR 4\r", b"+12..3\r", b"+1.0 mm\r", b"\xff1.0\r", b"nan\r"])
def test_other_lines_are_counted_not_guessed(line):
    lines = decoder()
    lines.begin_line()
    assert lines.feed(line) == []
    assert lines.damaged == 1


def test_a_line_without_end_is_given_up():
    lines = decoder()
    lines.begin_line()
    assert lines.feed(b"1" * (MAX_LINE_BYTES + 1)) == []
    assert lines.feed(b"1\r+3.0\r") == [pytest.approx(3e-3)]
    assert lines.damaged == 1


@settings(max_examples=200, deadline=None)
@given(st.lists(st.binary(max_size=60), max_size=10))
def test_random_bytes_give_only_finite_readings(pieces):
    lines = decoder()
    for piece in pieces:
        assert all(map(math.isfinite, lines.feed(piece)))


def test_a_pattern_without_value_is_refused_before_anything_is_opened():
    with pytest.raises(BadInputError, match="value"):
        GaugeSerial(port="/dev/null", pattern=r"\d+")
    with pytest.raises(BadInputError, match="regular expression"):
        GaugeSerial(port="/dev/null", pattern="(")
