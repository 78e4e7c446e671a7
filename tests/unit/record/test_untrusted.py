"""What is wrong with a file comes before what follows from it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from stepload.errors import BadInputError
from stepload.record.untrusted import untrusted

SAYS = "the run has no tare: it ended before the zero of force was known"


@pytest.fixture
def whole(write_record: Callable[..., Path]) -> Path:
    return write_record("run.mcap", chunks=3)


def flip_a_bit(path: Path) -> None:
    """In the last chunk of a record."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    chunk = max(summary.chunk_indexes, key=lambda each: each.chunk_start_offset)
    data = bytearray(path.read_bytes())
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 4
    path.write_bytes(data)


def raised(path: Path) -> BadInputError:
    with pytest.raises(BadInputError) as caught, untrusted(path), untrusted(path):
        raise BadInputError(SAYS, hint="see why it stopped")
    return caught.value


@pytest.mark.parametrize("by_directory", [False, True])
def test_an_error_of_a_damaged_record_begins_with_the_damage(
    whole: Path, by_directory: bool
) -> None:
    flip_a_bit(whole)
    error = raised(whole.parent if by_directory else whole)
    assert error.message.startswith(f"{whole} is damaged: byte ")
    assert error.message.endswith(f"; what could be read of it: {SAYS}")
    assert error.message.count("is damaged") == 1
    assert f"`stepload recover {whole}`" in error.hint


def test_an_error_of_a_whole_record_or_another_file_stays_what_it_is(
    whole: Path, tmp_path: Path
) -> None:
    curve = tmp_path / "curve.csv"
    curve.write_text("time_s,force_n\n0,0\n")
    for path in (whole, curve, tmp_path / "absent.mcap"):
        error = raised(path)
        assert (error.message, error.hint) == (SAYS, "see why it stopped")
