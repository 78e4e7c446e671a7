"""The first sheet of a report: what it says, that it stays one sheet, and what may be missing."""

from __future__ import annotations

import hashlib
import html
from dataclasses import replace
from pathlib import Path

import pytest
from evaluated_runs import a_preflight, evaluated, pressed

from stepload.feasibility.preflight import Preflight
from stepload.record.outcome import RunStatus
from stepload.report.certificate import LONGEST
from stepload.report.levels import Level, changes_again
from stepload.report.model import Certificate, Document, Figure
from stepload.report.page import render
from stepload.report.provenance import TITLE, sealed
from stepload.report.run_document import run_document


@pytest.fixture(scope="module")
def preflight() -> Preflight:
    return a_preflight()


@pytest.fixture(scope="module")
def healthy(preflight: Preflight) -> Document:
    return run_document(evaluated(preflight, pressed(6, creep_m=2e-6)))


def sketched(document: Document) -> Document:
    """The document with small figures: drawing takes longer than the rest of a page."""

    def small(figure: Figure) -> Figure:
        return replace(figure, draw=lambda: "<svg xmlns='http://www.w3.org/2000/svg'/>")

    sheet = sheet_of(document)
    sheet = replace(sheet, figure=sheet.figure and small(sheet.figure))
    return replace(document, figures=[small(each) for each in document.figures], certificate=sheet)


def sheet_of(document: Document) -> Certificate:
    assert document.certificate is not None
    return document.certificate


def rows_of(document: Document, title: str) -> dict[str, list[str]]:
    (found,) = [each for each in document.tables if each.title == title]
    return {row[0]: list(row[1:]) for row in found.rows}


def test_the_sheet_says_what_was_pressed_with_what_and_by_whom(healthy: Document) -> None:
    sheet = sheet_of(healthy)
    facts = dict(pair for column in sheet.facts for pair in column)
    assert facts["Specimen"] == "S-17"
    assert facts["Batch"] == "B7"
    assert facts["Tags"] == "lot=3, surface=polished"
    assert facts["Geometry"] == "sphere, radius 28.7 mm"
    assert "acetal: E 2.75 GPa, ν 0.3, Y 70 MPa" in facts["Material"]
    assert facts["Plate"].startswith("aluminium")
    assert facts["K_s"].startswith("3.49 MN/m ±")
    assert "declared" in facts["K_s from"]
    assert "age is not known" in facts["K_s from"]
    assert facts["Elastic limit F_c"].startswith("727 N")
    assert sheet.signatures == (("Operator", "A. Tester"), ("Checked by", ""))
    (numbers,) = sheet.tables
    names = [row[0] for row in numbers.rows]
    assert (names[0], names[-1]) == ("chord, loading", "exponent n (2)")
    assert all("[" in row[4] for row in numbers.rows)
    assert sheet.figure is not None
    assert "95 % band" in sheet.figure.caption
    assert all(name in sheet.figure.draw() for name in ("svg", "path"))


def test_a_row_for_every_load_level(healthy: Document) -> None:
    levels = sheet_of(healthy).levels
    assert levels is not None
    assert [row[0] for row in levels.rows] == [f"{50 * i} N" for i in range(1, 7)]
    settled, force, deformation, creep, again = list(levels.rows[5])[1:]
    assert float(force) == pytest.approx(300.0, abs=0.2)
    assert float(deformation) == pytest.approx(59.3 + 1.0, abs=0.6)  # by theory, half of the creep
    assert float(creep) == pytest.approx(1.8, abs=0.4)  # first tenth to last
    assert settled == "yes"
    assert abs(float(again)) < 0.3  # the second loading is the first again
    assert [row[1] for row in levels.rows].count("NO") == 1
    told = " ".join(levels.notes)
    assert "1 of 6 levels did not settle" in told
    assert "2 touches before the first loading" in told
    assert "span 2 µm" in told
    assert "the last touch lies +1.00 µm from the zero" in told
    (holds,) = [each for each in healthy.tables if each.title == "Every hold"]
    assert len(holds.rows) == 22


def test_a_level_loaded_again_is_compared_at_the_same_force() -> None:
    def level(cycle: int, step: int, force_n: float, deformation_m: float) -> Level:
        return Level(
            cycle=cycle, step=step, loading=True, level_n=100.0 * step, start_s=0.0, end_s=1.0,
            settled=True, force_n=force_n, deformation_m=deformation_m, force_change_n=0.0,
            creep_m=0.0, samples=9,
        )  # fmt: skip

    first = [level(1, 1, 100.0, 10e-6), level(1, 2, 200.0, 20e-6)]
    stiffer = [level(2, 1, 102.0, 10.2e-6), level(2, 2, 199.0, 19.4e-6)]
    again = [change for _, change in changes_again([*first, *stiffer])]
    assert again == pytest.approx([0.0, -0.5e-6], abs=1e-12)
    assert [change for _, change in changes_again(first)] == [None, None]


def test_the_seal_is_the_sum_of_the_record(healthy: Document, tmp_path: Path) -> None:
    record = tmp_path / "run.mcap"
    record.write_bytes(b"data")
    told = hashlib.sha256(b"data").hexdigest()
    done = sealed(healthy, record)
    assert rows_of(done, TITLE)["run.mcap, SHA-256"] == [told]
    assert sheet_of(done).seal == f"run.mcap SHA-256 {told}"
    gone = sealed(healthy, tmp_path / "gone.mcap")
    assert rows_of(gone, TITLE)["gone.mcap, SHA-256"] == ["not known: No such file or directory"]


@pytest.mark.parametrize("made", [None, "no fit", "one level"])
def test_a_run_without_a_result_says_so(preflight: Preflight, made: str | None) -> None:
    data = None if made is None else pressed(1 if made == "one level" else 6)
    document = run_document(evaluated(preflight, data, identified=False, status=RunStatus.STOPPED))
    page = render(sketched(document))
    assert document.verdict.mood == "bad"
    assert '<b class="word">stopped' in page
    assert (sheet_of(document).figure is None) == (data is None)
    assert sheet_of(document).tables == []
    assert "Operator" in page


HOSTILE = '"><script>alert(1)</script><img src=//x>$x_{ ' + "W" * 900


def test_hostile_words_are_escaped_cut_on_the_sheet_and_whole_behind_it(
    preflight: Preflight,
) -> None:
    notes = "a word " * 290
    run = evaluated(
        preflight, pressed(3, cycles=1), specimen=HOSTILE, batch=HOSTILE, operator=HOSTILE,
        notes=notes, run_id='1";}</style><script>',
    )  # fmt: skip
    document = run_document(run)
    facts = dict(pair for column in sheet_of(document).facts for pair in column)
    assert all(len(value) <= LONGEST + 60 for value in facts.values())
    assert facts["Specimen"].endswith("…")
    page = render(document)
    assert "<script" not in page
    assert "<img src=//x" not in page
    assert page.count("</style>") == 1
    assert html.escape(HOSTILE, quote=True).replace("&#x27;", "&#39;")[20:60] in page
    assert "W" * 900 in page
    assert notes.strip() in page
