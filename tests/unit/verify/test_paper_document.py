"""docs/paper.md is up to date, and what it claims to agree does agree."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from stepload_verify.paper import equations, simulated
from stepload_verify.paper.chart import Line, chart
from stepload_verify.paper.document import disagreements, generate
from stepload_verify.paper.rows import Row, half_digit, number

DOCS = Path(__file__).parents[3] / "docs"
KNOWN_TO_DIFFER = {
    "aluminium sphere, test 2, RS-RTLS: secant, N/m",
    "plastic pyramid, elastic–plastic (15), test 2: secant, N/m",
}


def curves(svg):
    """The coordinates of every line and tick in points; letters differ between versions."""
    lines = re.findall(r'<g id="line2d_\d+">\s*<path d="([^"]*)"', svg)
    return [[float(text) for text in re.findall(r"-?[\d.]+", line)] for line in lines]


@pytest.fixture(scope="module")
def first():
    return equations.sections()


@pytest.fixture(scope="module")
def second():
    return simulated.sections()


def test_equation_part_of_the_document_is_up_to_date(first):
    text = (DOCS / "paper.md").read_text(encoding="utf-8")
    for section in first:
        assert section.text() in text, f"run `make paper`: {section.title!r} is out of date"
        for name, svg in section.figures.items():
            assert curves((DOCS / "paper" / name).read_text(encoding="utf-8")) == [
                pytest.approx(curve, abs=0.5) for curve in curves(svg)
            ], name


def test_only_what_is_known_to_differ_differs(first, second):
    off = disagreements((*first, *second))
    assert {row.quantity for row in off} == KNOWN_TO_DIFFER
    assert all(row.why for row in off)


def test_no_limit_is_so_wide_that_it_says_nothing(first, second):
    rows = [row for section in (*first, *second) for row in section.rows]
    assert len(rows) > 40
    assert sum(row.limit is None or row.limit <= 0.05 for row in rows) >= 30
    assert max(row.limit or 0.0 for row in rows) <= 0.5


def test_simulated_part_is_in_the_document(second):
    text = (DOCS / "paper.md").read_text(encoding="utf-8")
    for section in second:
        assert f"## {section.title}\n" in text
        for row in section.rows:
            assert row.quantity in text
        for name in section.figures:
            assert (DOCS / "paper" / name).exists()


def test_figures_are_small_and_well_formed():
    files = sorted((DOCS / "paper").glob("*.svg"))
    assert files
    for file in files:
        assert file.stat().st_size < 200 * 1024
        ET.fromstring(file.read_text(encoding="utf-8"))
        assert f"paper/{file.name}" in (DOCS / "paper.md").read_text(encoding="utf-8")


def test_generate_writes_document_and_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(simulated, "sections", list)
    off = generate(tmp_path / "sub" / "paper.md")
    assert {row.quantity for row in off} == KNOWN_TO_DIFFER
    assert (tmp_path / "sub" / "paper" / "k-max.svg").exists()
    assert "What cannot be had" in (tmp_path / "sub" / "paper.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("printed", "half"), [("1.64", 0.005), ("6.57e8", 0.005e8), ("727", 0.5), ("5.42e-7", 5e-10)]
)
def test_half_a_digit(printed, half):
    assert half_digit(printed) == pytest.approx(half)


def test_rows_disagree_when_they_should():
    assert Row("x", "6.57e8", 6.5749e8).agrees
    assert not Row("x", "6.57e8", 6.5751e8).agrees
    assert Row("x", "2.0", 2.08, 0.05).agrees
    assert not Row("x", "2.0", 1.89, 0.05).agrees


@pytest.mark.parametrize(
    ("value", "text"),
    [(6.5734e8, "6.573e8"), (727.04, "727.0"), (1.85, "1.850"), (5.42e-7, "5.420e-7")],
)
def test_numbers_are_written_as_the_paper_does(value, text):
    assert number(value) == text


def test_a_chart_puts_points_where_they_belong():
    x = np.array([0.0, 5.0, 10.0, 15.0])
    svg = chart("t & t", "x", "y", [Line("a", x, np.array([0.0, 1.0, 4.0, 9.0]))])
    ET.fromstring(svg)
    across, up = (
        np.array(next(curve for curve in curves(svg) if len(curve) == 8)[i::2]) for i in (0, 1)
    )
    assert across[1] - across[0] == pytest.approx(across[2] - across[1])
    assert up[0] - up[2] == pytest.approx(4.0 * (up[0] - up[1]), rel=1e-3)
    assert across[0] < across[2]
    assert up[0] > up[2]  # SVG counts downwards


def test_the_same_chart_is_the_same_text():
    line = Line("a", np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    assert chart("t", "x", "y", [line]) == chart("t", "x", "y", [line])


def test_no_line_is_left_out_however_many_there_are():
    x = np.array([1.0, 2.0, 3.0, 4.0])
    lines = [Line(f"{i}", x, i * x**2) for i in range(1, 10)]
    assert sum(len(curve) == 8 for curve in curves(chart("t", "x", "y", lines))) == len(lines)
