"""The first sheet of a report: what it says, that it stays one sheet, and what may be missing."""

from __future__ import annotations

import hashlib
import html
from dataclasses import replace
from pathlib import Path

import pytest
from evaluated_runs import an_envelope, evaluated, pressed

from stepload.envelope.envelope import Envelope
from stepload.envelope.reason import PlanVerdict, Reason, Severity
from stepload.record.outcome import RunStatus
from stepload.record.summary import Summary
from stepload.results import provenance
from stepload.results.certificate import LONGEST, rig_facts, specimen_facts
from stepload.results.levels import Level, changes_again
from stepload.results.model import Certificate, Document, Figure, Verdict
from stepload.results.page import render, running
from stepload.results.provenance import TITLE, sealed, with_record
from stepload.results.run_document import run_document

EMPTY = Document("t", Verdict("good", "ok", "fine"))
TEMPLATES = Path(__file__).resolve().parents[3] / "src/stepload/results/templates"


@pytest.fixture(scope="module")
def envelope() -> Envelope:
    return an_envelope()


@pytest.fixture(scope="module")
def healthy(envelope: Envelope) -> Document:
    return run_document(evaluated(envelope, pressed(6, creep_m=2e-6)))


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


def test_sixty_levels_leave_the_sheet_short_and_the_details_whole(envelope: Envelope) -> None:
    document = run_document(evaluated(envelope, pressed(60, cycles=1)))
    levels = sheet_of(document).levels
    assert levels is not None
    assert [row[0] for row in levels.rows][::7] == ["5 N", "300 N"]
    assert any("8 of 60 levels" in note for note in levels.notes)
    (holds,) = [each for each in document.tables if each.title == "Every hold"]
    assert len(holds.rows) == 119


def test_the_seal_is_the_sum_of_the_record(healthy: Document, tmp_path: Path) -> None:
    record = tmp_path / "run.mcap"
    record.write_bytes(b"data")
    told = hashlib.sha256(b"data").hexdigest()
    done = sealed(healthy, record)
    assert rows_of(done, TITLE)["run.mcap, SHA-256"] == [told]
    assert sheet_of(done).seal == f"run.mcap SHA-256 {told}"
    gone = sealed(healthy, tmp_path / "gone.mcap")
    assert rows_of(gone, TITLE)["gone.mcap, SHA-256"] == ["not known: No such file or directory"]


def test_a_record_that_was_not_finished_is_said_first(
    healthy: Document, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    record = tmp_path / "run.mcap"
    record.write_bytes(b"data")
    refused = with_record(healthy, record)
    assert "the record cannot be read" in refused.reasons[0]
    told = {"recorded_force": "7", "dropped_force": "2"}
    for partial in (False, True):
        summary = Summary(record, {}, told, None, partial)
        monkeypatch.setattr(provenance, "read_summary", lambda path, found=summary: found)
        done = with_record(healthy, record)
        assert rows_of(done, TITLE)["messages, force"] == ["7 recorded, 2 dropped"]
        assert (provenance.UNFINISHED in done.reasons) == partial
        assert (sheet_of(done).remarks[0] == provenance.UNFINISHED) == partial


@pytest.mark.parametrize("made", [None, "no fit", "one level"])
def test_a_run_without_a_result_says_so(envelope: Envelope, made: str | None) -> None:
    data = None if made is None else pressed(1 if made == "one level" else 6)
    document = run_document(evaluated(envelope, data, identified=False, status=RunStatus.STOPPED))
    page = render(sketched(document))
    assert document.verdict.mood == "bad"
    assert '<b class="word">stopped' in page
    assert (sheet_of(document).figure is None) == (data is None)
    assert sheet_of(document).tables == []
    assert "Operator" in page


def test_an_adhesive_contact_and_a_refused_plan_are_shown(envelope: Envelope) -> None:
    reason = Reason("too_much", Severity.REFUSE, "it would yield")
    refused = replace(envelope, verdict=PlanVerdict.REFUSED, reasons=(*envelope.reasons, reason))
    document = run_document(evaluated(refused, pressed(6, pull_n=12.0)))
    [preflight] = [each for each in document.tables if each.title == "Preflight"]
    assert ("refuse", "too_much", "it would yield", "") in preflight.rows
    notes = [note for each in document.tables for note in each.notes]
    assert any("Preflight said REFUSED" in note for note in notes)
    figure = sheet_of(document).figure
    assert figure is not None
    assert "</svg>" in figure.draw()


HOSTILE = '"><script>alert(1)</script><img src=//x>$x_{ ' + "W" * 900


def test_hostile_words_are_escaped_cut_on_the_sheet_and_whole_behind_it(envelope: Envelope) -> None:
    notes = "a word " * 290
    run = evaluated(
        envelope, pressed(3, cycles=1), specimen=HOSTILE, batch=HOSTILE, operator=HOSTILE,
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


def test_a_system_stiffness_that_is_not_the_plans_is_not_told_as_the_plans(
    envelope: Envelope,
) -> None:
    run = evaluated(envelope, pressed(6))
    found = run.identification
    assert found is not None
    for stiffness, told in ((5e6, "5 MN/m ± 100 kN/m"), (None, "none was taken out")):
        sources = replace(
            found.conditions.sources,
            system_stiffness_n_per_m=stiffness, system_stiffness_sigma_n_per_m=1e5,
        )  # fmt: skip
        conditions = replace(found.conditions, sources=sources)
        other = replace(found, run=replace(found.run, conditions=conditions))
        facts = dict(rig_facts(envelope, run.recording, other))
        assert facts["K_s"].startswith(told)
        assert "not by the plan" in facts["K_s from"]


def test_an_elastic_limit_that_is_not_the_plans_is_told_on_the_sheet(envelope: Envelope) -> None:
    run = evaluated(envelope, pressed(6))
    found = run.identification
    assert found is not None
    plans = specimen_facts(envelope, run.recording, found)
    assert plans == specimen_facts(envelope, run.recording)
    conditions = replace(found.conditions, elastic_limit_n=200.0)
    other = replace(found, run=replace(found.run, conditions=conditions))
    document = run_document(replace(run, identification=other))
    told = dict(sheet_of(document).facts[0])["Elastic limit F_c"]
    assert told.startswith("200 N, taken for this result; by the plan ")
    share = f"{100.0 * run.outcome.peak_force_n / 200.0:.0f} % of the F_c used"
    assert dict(sheet_of(document).facts[0])["Largest force"].endswith(share)


def test_the_foot_of_a_printed_page_cannot_leave_its_string() -> None:
    foot = running('stepload 0.1.0 · run 1";}</style>\\', simulated=True)
    assert foot == "SIMULATED  stepload 0.1.0  run 1style"
