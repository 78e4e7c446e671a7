"""One figure, told once, is the same for programs, on a terminal and on a page."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass

import pytest

from stepload.results.model import (
    Document,
    Field,
    Table,
    Verdict,
    data,
    interval,
    named,
    number,
    quantity,
    table,
)
from stepload.results.page import render
from stepload.results.terminal import Output


@dataclass(frozen=True)
class Spring:
    """Something with figures."""

    stiffness_n_per_m: float
    ends_m: tuple[float, float] | None
    turns: int


FIELDS = (
    named("stiffness_n_per_m", "stiffness", quantity("N/m")),
    named("ends_m", "ends", interval("m")),
    named("turns"),
    Field(lambda spring: spring.turns / 3, label="turns / 3", show=number(".2f")),
)
SOFT, STIFF = Spring(2.5e3, (1e-3, 2e-3), 7), Spring(1e6, None, 3)
TABLE = table("Springs", FIELDS, [SOFT, STIFF], ["none is [bold]new[/bold]"])


def document(*tables: Table, text: str = "Two springs") -> Document:
    return Document("Springs", Verdict("good", "sound", text), reasons=["because"], tables=tables)


def shown(document: Document, capsys: pytest.CaptureFixture[str]) -> str:
    Output(as_json=False).show(document)
    return capsys.readouterr().out


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
    out.result(data(FIELDS, STIFF) | {"nothing": float("nan")})
    told = capsys.readouterr()
    assert "Two springs" in told.err
    assert json.loads(told.out) == {
        "stiffness_n_per_m": 1e6, "ends_m": None, "turns": 3, "nothing": None,
    }  # fmt: skip
