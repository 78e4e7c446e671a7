"""What is counted of the runs of a cell: right, IDENTIFIED, both, and intervals that hold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stepload.design import work as room
from stepload.design.judge import Judged
from stepload.design.law import Payload
from stepload.design.points import Point
from stepload.design.work import Row, Work
from stepload.design.world import Cell
from stepload.envelope.benches import bench
from stepload.evidence.figures import HOPELESS

STVF = bench("stvf", None)
CELL = Cell(Payload(5e6, 1.5, STVF.top_n), STVF.conditions, STVF.touch_n)


def row(
    monkeypatch: pytest.MonkeyPatch, off: list[float], half: list[float], identified: list[bool]
) -> Row:
    """The row of runs that lie so far off, with these half widths and verdicts."""
    truth = np.full(len(off), 1e6)
    found = Judged(
        truth * (1.0 + np.array(off)), truth, np.array(half), np.array(identified), {"set": 1}
    )
    monkeypatch.setattr(room, "reference", lambda *_: None)
    monkeypatch.setattr(room, "press", lambda *_: None)
    monkeypatch.setattr(room, "judge", lambda *_: found)
    return Work(1, len(off)).run(Point("a", 0, math.nan, "", "", CELL))


def test_measured_is_what_is_identified_and_right(monkeypatch: pytest.MonkeyPatch) -> None:
    found = row(
        monkeypatch, [0.1, 0.3, -0.1, 0.21], [0.15, 0.1, 0.05, 0.4], [True, True, True, False]
    )
    assert 1.0 / STVF.conditions.t == pytest.approx(0.2)
    assert (found.within.count, found.within.of) == (2, 4)
    assert (found.identified.count, found.identified.of) == (3, 4)
    assert (found.measured.count, found.measured.of) == (2, 4)
    # Of the three that are IDENTIFIED the first interval holds the truth, of the others the last.
    assert (found.covered.count, found.covered.of) == (1, 3)
    assert found.half_width == pytest.approx(0.125)


def test_a_half_width_beyond_the_figure_itself_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    found = row(monkeypatch, [0.0, 0.0], [2.0 * HOPELESS, 2.0 * HOPELESS], [False, False])
    assert math.isnan(found.half_width)
    assert found.covered.of == 0
