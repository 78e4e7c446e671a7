"""What `--out` of map and pose writes, and what it leaves alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from stepload.cli.design import check_sheet, write_sheet
from stepload.errors import BadInputError
from stepload.report.figures import figure_of, png_of, svg_of


@contextmanager
def drawn() -> Iterator[Figure]:
    with figure_of(1.0) as (figure, _):
        yield figure


def write(out: Path) -> str:
    return write_sheet(out, "map", drawn, {"cells": 1})


def test_a_picture_in_two_forms_and_the_figures_are_written(tmp_path: Path) -> None:
    out = tmp_path / "new"
    check_sheet(out, "map")
    said = write(out)
    assert sorted(path.name for path in out.iterdir()) == ["map.json", "map.png", "map.svg"]
    assert all(str(path) in said for path in out.iterdir())
    with drawn() as figure:
        assert (out / "map.png").read_bytes() == png_of(figure)
    with drawn() as figure:
        assert (out / "map.svg").read_text(encoding="utf-8") == svg_of(figure)


def test_what_is_there_or_comes_meanwhile_is_not_written_over(tmp_path: Path) -> None:
    check_sheet(tmp_path, "map")
    theirs = tmp_path / "map.json"
    theirs.write_text("theirs")
    with pytest.raises(BadInputError, match="there already"):
        check_sheet(tmp_path, "map")
    with pytest.raises(BadInputError, match="there already"):
        write(tmp_path)
    assert theirs.read_text() == "theirs"
