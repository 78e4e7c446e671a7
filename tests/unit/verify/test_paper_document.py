"""docs/paper.md is up to date, and counts nothing as agreement that is none."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from stepload.identification.ls import rs_btls
from stepload_verify.paper import arithmetic, document, fitted, laws, printed, rigs
from stepload_verify.paper.bands import Tally, band, tally
from stepload_verify.paper.rows import Row
from stepload_verify.paper.section import Kind

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


def kinds(parts):
    found = {}
    for section in document.sections_of(parts):
        if section.kind:
            found.setdefault(section.kind, []).append(section)
    return found


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


@pytest.mark.long
def test_kinds_of_evidence_are_counted_apart_and_never_added(computed, drawn):
    rows = [line for line in document.summary((*computed, *drawn)) if line.startswith("| ")]
    counted = {line.split(" | ")[0][2:]: line.split(" | ")[1:3] for line in rows[1:]}
    assert set(counted) > set(Kind)
    assert counted[Kind.THEORY] == ["9", "9"]
    assert counted[Kind.PAIRS] == ["16", "15"]
    assert counted[Kind.FITTED] == ["3", "2"]
    numbers = [int(text[0]) for text in counted.values() if text[0].isdigit()]
    assert len(numbers) == len(Kind)
    for line in page().split("# Arithmetic")[0].splitlines():
        assert f" {sum(numbers)} " not in line


@pytest.mark.long
def test_the_counts_of_the_page_are_those_of_its_tables(drawn):
    for kind, sections in kinds(drawn).items():
        found = tally([band for section in sections for band in section.bands])
        text = "".join(section.text() for section in sections)
        assert text.count("**outside**") == found.outside
        assert text.count("inside, shows nothing") == found.shows_nothing
        assert text.count(", inside |") == found.inside
        assert f"Of {found.numbers} printed numbers {found.inside} lie inside" in text
        assert kind in (Kind.TIPS, Kind.SPHERES)


@pytest.mark.long
def test_what_is_put_in_is_not_counted(computed, drawn):
    """The system stiffness that a simulation was given is no number compared with the paper's."""
    chain = drawn[-1].sections
    assert [section.title for section in chain] == ["System stiffness (26)"]
    assert not any(section.rows or section.bands or section.kind for section in chain)
    predicted = computed[-1].sections
    assert not any(section.rows or section.bands or section.kind for section in predicted)


def test_whatever_rests_on_the_chosen_hardness_is_said_to(computed, monkeypatch):
    """Another hardness moves what is counted as fitted; not arithmetic, not the law of a tip."""
    force = np.array([10.0, 300.0])
    before = laws.measured(printed.PAYLOADS[1])(force).tolist()
    monkeypatch.setattr(printed, "MICRO_HARDNESS_PA", 1.4e9)
    again = document.computed_parts()
    for kind, sections in kinds(again).items():
        same = [s.rows for s in sections] == [s.rows for s in kinds(computed)[kind]]
        assert same == (kind is not Kind.FITTED), kind
    assert before == laws.measured(printed.PAYLOADS[1])(force).tolist()


def test_figures_and_curves_are_small_and_shown():
    files = sorted((DOCS / "paper").iterdir())
    assert {file.suffix for file in files} == {".svg", ".csv"}
    for file in files:
        assert file.stat().st_size < 200 * 1024
        if file.suffix == ".svg":
            ET.fromstring(file.read_text(encoding="utf-8"))
        assert f"paper/{file.name}" in page()


def test_generate_writes_page_figures_and_curves(tmp_path, monkeypatch):
    monkeypatch.setattr(document, "simulated_parts", list)
    off = document.generate(tmp_path / "sub" / "page.md")
    assert {row.quantity for row in off} == KNOWN_TO_DIFFER
    assert (tmp_path / "sub" / "paper" / "fig-14.svg").exists()
    assert (tmp_path / "sub" / "paper" / "hertz-rough-plastic-sphere.csv").exists()
    assert "What cannot be had" in (tmp_path / "sub" / "page.md").read_text(encoding="utf-8")


def test_figure_14_holds_every_payload_and_rig():
    assert [rig.name for rig in rigs.rigs()] == ["STVF", "Instron", "UR5e", "UR16e"]
    section = rigs.figure_14()
    for name in ("plastic sphere", "plastic cone", "plastic pyramid", "aluminium sphere",
                 "aluminium cube", "aluminium prism"):  # fmt: skip
        assert sum(line.startswith(f"| {name} |") for line in section.lines) == 1
    cells = [line[2:].split(" | ") for line in section.lines if line.startswith("| ")]
    stvf = {name: share for name, share, *_ in cells}
    identifiable = {name for name in rigs.secants(300.0) if float(stvf[name]) <= 1.0}
    assert identifiable == {"plastic sphere", "plastic cone", "plastic pyramid"}
    svg = section.files["fig-14.svg"]
    assert sum(len(curve) == 4 for curve in curves(svg)) >= 5  # five levels of stiffness


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


def test_a_band_that_holds_everything_shows_nothing():
    values = np.linspace(1.0, 2.0, 101).tolist()
    narrow = band("n̂", ("1.5", "2.4", "1.01"), values, widest=0.46)
    assert (narrow.low, narrow.median, narrow.high) == pytest.approx((1.05, 1.5, 1.95))
    assert narrow.tells
    assert tally([narrow]) == Tally(inside=1, shows_nothing=0, outside=2)
    wide = band("n̂", ("1.5", "2.4", "1.01"), values, widest=0.44)
    assert tally([wide, narrow]) == Tally(inside=1, shows_nothing=1, outside=4)


def test_no_hardness_meets_the_finite_elements_in_every_digit():
    """What the page says of Table II, tried in steps of 2 MPa over what a polymer might have."""
    for hardness_pa in np.arange(0.1e9, 2.0e9, 2e6):
        deformation, force = fitted.rough_curve(printed.PAYLOADS[0], hardness_pa=float(hardness_pa))
        fit = rs_btls(deformation, force, secant_force_n=300.0)
        row = printed.FINITE_ELEMENTS
        pairs = ((row.k, fit.k), (row.n, fit.n), (row.secant, fit.secant_n_per_m))
        assert not all(Row("x", text, value).agrees for text, value in pairs)
