"""One figure, told once, is the same for programs, on a terminal and on a page."""

from __future__ import annotations

import html
import json
import math
from dataclasses import dataclass
from typing import Annotated

import pytest

from stepload.report.model import NOTHING, Document, Table, Verdict
from stepload.report.page import render
from stepload.report.rows import (
    Cell,
    Row,
    column,
    data,
    figure,
    in_one_unit,
    part,
    schema_of,
    table,
)
from stepload.report.terminal import Output


@dataclass(frozen=True)
class Spring:
    """Something with figures."""

    stiffness_n_per_m: float
    ends_m: tuple[float, float] | None
    turns: int
    wire: Wire | None = None


@dataclass(frozen=True)
class Wire:
    """A part of it."""

    length_m: float


class SpringRow(Row):
    """A spring."""

    stiffness_n_per_m: float = figure("Of the spring.", "stiffness")
    ends_m: tuple[float, float] | None = figure("Where it ends.", "ends")
    turns: int = figure("How many.")
    length_m: Annotated[float | None, part("length_m")] = figure("Of its wire.", at="wire")
    thirds: Annotated[None, Cell(lambda row: f"{row.turns / 3:.2f}")] = column("turns / 3")


SOFT, STIFF = Spring(2.5e3, (1e-3, 2e-3), 7, Wire(2.0)), Spring(1e6, None, 3)
TABLE = table("Springs", SpringRow, [SOFT, STIFF], ["none is [bold]new[/bold]"])


def document(*tables: Table, text: str = "Two springs") -> Document:
    return Document("Springs", Verdict("good", "sound", text), reasons=["because"], tables=tables)


def shown(document: Document, capsys: pytest.CaptureFixture[str]) -> str:
    Output(as_json=False).show(document)
    return capsys.readouterr().out


def test_programs_get_every_figure_and_people_those_with_a_heading() -> None:
    assert data(SpringRow, SOFT) == {
        "stiffness_n_per_m": 2.5e3, "ends_m": (1e-3, 2e-3), "turns": 7, "length_m": 2.0,
    }  # fmt: skip
    assert data(SpringRow, STIFF)["length_m"] is None
    assert TABLE.columns == ["stiffness", "ends", "turns / 3"]
    assert TABLE.rows == [["2.5 kN/m", "[1, 2] mm", "2.33"], ["1 MN/m", NOTHING, "1.00"]]


def test_a_schema_has_what_programs_get_with_its_unit() -> None:
    made = schema_of(SpringRow, "spring")
    assert made["$id"] == "urn:stepload:spring:1"
    assert made["properties"].keys() == data(SpringRow, SOFT).keys() == set(made["required"])
    assert made["properties"]["length_m"]["description"] == "Of its wire. In m."
    assert made["properties"]["stiffness_n_per_m"]["title"] == "stiffness"


@pytest.mark.parametrize(
    ("value", "ends", "shown"),
    [
        (5.2e6, (4.94e6, 5.48e6), ("5.20 MN/m", "[4.94, 5.48] MN/m")),
        (5.2e6, (4e6, 6e6), ("5.2 MN/m", "[4.0, 6.0] MN/m")),
        (5.2e6, (0.94e6, 9.5e6), ("5.2 MN/m", "[940 kN/m, 9.5 MN/m]")),
        (0.97e6, (1e6, 1.25e6), ("970 kN/m", "[1.00, 1.25] MN/m")),
        (5.2e6, (0.94e6, 9.55e6), ("5.20 MN/m", "[940 kN/m, 9.55 MN/m]")),
        (math.nan, (1e6, 2.5e6), (NOTHING, "[1.0, 2.5] MN/m")),
    ],
)
def test_a_value_has_the_decimals_of_its_interval(
    value: float, ends: tuple[float, float], shown: tuple[str, str]
) -> None:
    assert in_one_unit(ends, "N/m", value) == shown


def test_terminal_and_page_show_the_same_cells_and_notes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = shown(document(TABLE), capsys)
    page = html.unescape(render(document(TABLE)))
    for cell in [*TABLE.columns, *TABLE.rows[0], *TABLE.rows[1], *TABLE.notes, "because"]:
        assert cell in text
        assert cell in page
    assert "SOUND   Two springs" in text


def test_a_terminal_shows_what_it_would_obey(capsys: pytest.CaptureFixture[str]) -> None:
    bad = "\x1b[2Jname"
    rows = Table("t", ("c",), [[bad], ["[red]run"]], [bad])
    text = shown(document(rows, text=bad), capsys)
    assert "\x1b" not in text
    assert "[red]run" in text
    assert text.count(r"\x1b[2Jname") == 3


@pytest.mark.parametrize("width", range(40, 130))
def test_a_table_loses_nothing_however_narrow_the_terminal_is(
    width: int, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [
        ("ac4b972d2d81", "2026-11-26 18:30", "a plastic sphere", "simulated, interrupted", "")
        for _ in range(3)
    ]
    out = Output(as_json=False)
    out._columns = width
    out.table("runs", ("run", "started", "payload", "how it ended", "none"), rows)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    said = "".join("".join(lines).split())
    for cell in rows[0]:
        told = [letter for letter in cell if letter != " "]
        assert all(said.count(letter) >= 3 * told.count(letter) for letter in set(told))


def test_with_json_one_object_goes_out_and_text_to_the_other_stream(
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = Output(as_json=True)
    out.show(document(TABLE))
    out.result(data(SpringRow, STIFF) | {"nothing": float("nan")})
    told = capsys.readouterr()
    assert "Two springs" in told.err
    assert json.loads(told.out) == {
        "stiffness_n_per_m": 1e6, "ends_m": None, "turns": 3, "length_m": None,
        "nothing": None,
    }  # fmt: skip


def test_a_table_that_is_too_wide_is_turned(capsys: pytest.CaptureFixture[str]) -> None:
    columns = [f"figure {at} of a run" for at in range(6)]
    out = Output(as_json=False)
    out._columns = 80
    out.table("runs", columns, [[f"{at}.5 N [1, 2]" for at in range(6)]])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0].strip() for line in lines[2:] if "of a run" in line] == columns
    assert all(any(f"{at}.5 N [1, 2]" in line for line in lines) for at in range(6))
