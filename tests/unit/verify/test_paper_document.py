"""docs/paper.md is up to date, and counts nothing as agreement that is none."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from stepload.identification.ls import rs_btls
from stepload_verify.paper import arithmetic, document, fitted, printed
from stepload_verify.paper.rows import Row

DOCS = Path(__file__).parents[3] / "docs"
KNOWN_TO_DIFFER = {
    "aluminium sphere, test 2, RS-RTLS: secant, N/m",
    "plastic sphere, finite elements: secant, N/m",
}


def curves(svg):
    """The coordinates of every line and tick in points; letters differ between versions."""
    lines = re.findall(r'<g id="line2d_\d+">\s*<path d="([^"]*)"', svg)
    return [[float(text) for text in re.findall(r"-?[\d.]+", line)] for line in lines]


@pytest.fixture(scope="module")
def computed():
    return document.computed_parts()


@pytest.fixture(scope="module")
def drawn():
    return document.simulated_parts()


def page():
    return (DOCS / "paper.md").read_text(encoding="utf-8")


def test_what_follows_from_equations_is_up_to_date(computed):
    for section in document.sections_of((*computed, document.command_part())):
        assert section.text() in page(), f"run `make paper`: {section.title!r} is out of date"
        for name, content in section.files.items():
            written = (DOCS / "paper" / name).read_text(encoding="utf-8")
            if name.endswith(".svg"):
                assert curves(written) == [
                    pytest.approx(curve, abs=0.5) for curve in curves(content)
                ], name
            else:
                assert written == content, name


def test_only_what_is_known_to_differ_differs(computed):
    off = document.disagreements(document.sections_of(computed))
    assert {row.quantity for row in off} == KNOWN_TO_DIFFER
    assert all(row.why for row in off)


@pytest.mark.long
def test_the_simulated_part_is_in_the_page(drawn):
    for section in document.sections_of(drawn):
        assert f"## {section.title}\n" in page()
        for found in section.bands:
            assert f"| {found.quantity} |" in page()
        for name in section.files:
            assert (DOCS / "paper" / name).exists()


def test_generate_writes_page_figures_and_curves(tmp_path, monkeypatch):
    monkeypatch.setattr(document, "simulated_parts", list)
    off = document.generate(tmp_path / "sub" / "page.md")
    assert {row.quantity for row in off} == KNOWN_TO_DIFFER
    assert (tmp_path / "sub" / "paper" / "fig-14.svg").exists()
    assert (tmp_path / "sub" / "paper" / "hertz-rough-plastic-sphere.csv").exists()
    assert "What cannot be had" in (tmp_path / "sub" / "page.md").read_text(encoding="utf-8")


def test_the_range_of_a_secant_is_that_of_its_rounded_numbers():
    estimate = printed.Estimate("2.36e9", "1.64", "4.80e6")
    low, high = arithmetic.secant_span(estimate)
    for k, n in ((2.3551e9, 1.6351), (2.3649e9, 1.6449), (2.3551e9, 1.6449), (2.36e9, 1.64)):
        assert low <= (300.0 ** (n - 1) * k) ** (1 / n) <= high
    assert low > (300.0**0.646 * 2.36e9) ** (1 / 1.646)


def test_rows_disagree_when_they_should():
    assert Row("x", "6.57e8", 6.5749e8).agrees
    assert not Row("x", "6.57e8", 6.5751e8).agrees
    assert Row("x", "2.0", 2.2, (2.04, 2.3)).agrees
    assert not Row("x", "2.0", 2.2, (2.06, 2.3)).agrees
    assert not Row("x", "2.0", 1.8, (1.7, 1.94)).agrees


def test_no_hardness_meets_the_finite_elements_in_every_digit():
    """What the page says of Table II, tried in steps of 2 MPa over what a polymer might have."""
    for hardness_pa in np.arange(0.1e9, 2.0e9, 2e6):
        deformation, force = fitted.rough_curve(printed.PAYLOADS[0], hardness_pa=float(hardness_pa))
        fit = rs_btls(deformation, force, secant_force_n=300.0)
        row = printed.FINITE_ELEMENTS
        pairs = ((row.k, fit.k), (row.n, fit.n), (row.secant, fit.secant_n_per_m))
        assert not all(Row("x", text, value).agrees for text, value in pairs)
