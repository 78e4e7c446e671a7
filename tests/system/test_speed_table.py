"""The table of speeds: it can be made, and it marks what became worse. No time is asserted."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HOME = Path(__file__).resolve().parents[2]
BENCH = HOME / "bench"
FIGURES = (
    "stepload --help", "preflight", "make demo", "the loop of make demo", "repair",
    "campaign, runs", "campaign, CPU of a run", "efficiency at two",
    "joint fit", "RS-BTLS", "run and record", "identify",
)  # fmt: skip


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(BENCH)
    import table

    return table


@pytest.fixture
def rows(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(BENCH)
    import _row

    return _row


@pytest.mark.long
def test_every_figure_can_be_measured() -> None:
    done = subprocess.run(
        [sys.executable, BENCH / "table.py", "--quick"], capture_output=True, text=True, check=True
    )
    names = [line.split("  ")[0] for line in done.stdout.splitlines()]
    for begin in FIGURES:
        assert any(name.startswith(begin) for name in names), begin


@pytest.mark.parametrize(
    ("smaller", "now", "worse"),
    [
        (True, [1.3, 1.35, 1.4], 0.35),
        (True, [0.5, 0.5, 0.5], 0.0),
        (True, [1.05, 1.1, 1.15], 0.0),
        (True, [1.0, 1.35, 1.4], 0.0),
        (False, [0.6, 0.65, 0.7], 0.35),
        (False, [2.0, 2.0, 2.0], 0.0),
    ],
)
def test_worse_is_what_the_spread_does_not_explain(
    rows: Any, smaller: bool, now: list[float], worse: float
) -> None:
    kept = rows.Row("a", "s", [0.9, 1.0, 1.1], smaller=smaller)
    found = rows.became_worse(rows.Row("a", "s", now, smaller=smaller), kept)
    assert found == pytest.approx(worse)


def test_the_page_holds_the_kept_table(rows: Any, table: Any) -> None:
    page = table.PAGE.read_text()
    if not table.KEPT.exists():
        assert "No table has been kept yet." in page
        return
    kept = json.loads(table.KEPT.read_text())
    lines = [rows.HEAD]
    lines += [rows.cells(rows.row_of(each), None, comparable=False) for each in kept["rows"]]
    assert table.page_with(page, kept, lines) == page
