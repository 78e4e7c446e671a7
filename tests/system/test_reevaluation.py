"""Results and report of a record that is there already: `identify --out` and `recover`."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from real_runs import ROOT, in_process, results

import stepload
from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.tags import tagged
from stepload.record.reader import Event, read_recording
from stepload.results import run_record
from stepload.results.record_evaluation import evaluation_of, outcome_of
from stepload.session import reevaluation
from stepload.session.reevaluation import results_again


def test_a_record_gives_the_results_of_its_run_again(cycles_run: Path, cycles_again: Path) -> None:
    said = (cycles_again.parent / "said.txt").read_text()
    assert f"report: {cycles_again / 'report.html'}" in said
    assert results(cycles_again) == results(cycles_run)
    assert "<figure" in (cycles_again / "report.html").read_text()


def test_a_very_long_record_is_read_alike_by_all(
    quick_plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_record, "WHOLE_TICKS", 1000)
    monkeypatch.setattr(run_record, "MEAN_TICKS", 3000)
    run = tmp_path / "run"
    done = in_process("run", quick_plan, "--dry-run", "--quiet", "--out", run)
    assert done.returncode == 0, done.stderr
    told, again = results(run), results_again(run)[0]
    said = json.loads(in_process("identify", run, "--json").stdout)
    for name in ("headline", "quantities", "inelastic", "fits", "peak_force_n"):
        assert told[name] == again[name] == said[name]
    levels = [level.deformation_m for level in stepload.open(run).levels]
    assert levels == [level["deformation_m"] for level in told["levels"]]
    assert len(evaluation_of(run).recording.ticks.time_s) < told["lateness"]["ticks"]
    monkeypatch.setattr(run_record, "WHOLE_TICKS", 10**6)
    assert results_again(run)[0]["headline"] != told["headline"]


def test_the_largest_force_is_that_of_the_whole_run(cycles_run: Path) -> None:
    whole = read_recording(cycles_run / "run.mcap")
    largest_n = max(abs(force_n) for force_n in whole.ticks.force_n)
    said = json.loads(in_process("identify", cycles_run, "--json").stdout)
    run = evaluation_of(cycles_run)
    assert run.identification is not None
    assert largest_n > run.identification.peak_force_n
    assert results(cycles_run)["peak_force_n"] == said["peak_force_n"] == largest_n
    # A record of an earlier version, whose results hold the first loading's.
    old: Any = {**(whole.results or {}), "peak_force_n": run.identification.peak_force_n}
    assert outcome_of(replace(whole, results=old)).peak_force_n == largest_n
    # Of a long record not every tick is read.
    few = whole.ticks._replace(force_n=0.5 * whole.ticks.force_n)
    assert outcome_of(replace(whole, ticks=few)).peak_force_n == largest_n


def test_what_is_there_is_not_written_over(cycles_run: Path) -> None:
    before = (cycles_run / "results.json").read_bytes()
    said = in_process("identify", cycles_run, "--out", cycles_run)
    assert said.returncode == 2
    assert "exists already: nothing was written" in said.stderr
    assert (cycles_run / "results.json").read_bytes() == before


def test_what_is_known_better_is_in_the_results(cycles_run: Path, tmp_path: Path) -> None:
    options = ("--elastic-limit", "600 N", "--law", "hertz")
    out = tmp_path / "again"
    said = in_process("identify", cycles_run, *options, "--out", out, "--json")
    assert results(out)["laws_chosen"] == ["hertz"]
    assert results(out)["headline"] == json.loads(said.stdout)["headline"]
    assert results(out)["reasons"][0].startswith(
        "the result was judged by F_c = 600 N; by its plan"
    )


@pytest.mark.long
def test_another_payload_than_the_plans_is_told(cycles_run: Path, tmp_path: Path) -> None:
    for name, told in (("silicone-sphere", True), ("plastic-sphere", False)):
        payload = Path(__file__).parents[2] / "procedures" / "payloads" / f"{name}.yaml"
        out = tmp_path / name
        said = in_process("identify", cycles_run, "--payload", payload, "--out", out)
        assert said.returncode == 0, said.stderr
        reasons = " ".join(results(out)["reasons"])
        assert ("another payload than the plan's" in reasons) is told


def test_a_curve_gets_a_report_too(tmp_path: Path) -> None:
    rows = [f"{i * 1e-6},{6.5e8 * (i * 1e-6) ** 1.5}\n" for i in range(60)]
    curve = tmp_path / "curve.csv"
    curve.write_text("displacement_m,force_n\n" + "".join(rows))
    said = in_process("identify", curve, "--tared", "--out", tmp_path / "out")
    assert said.returncode == 0, said.stderr
    found = results(tmp_path / "out")
    assert (found["schema"], found["run"]["run_id"]) == ("stepload-results/1", "")
    assert "Identification" in (tmp_path / "out" / "report.html").read_text()


@pytest.fixture
def cut(cycles_run: Path, tmp_path: Path) -> Path:
    """A directory with the first two thirds of a record and nothing else."""
    data = (cycles_run / "run.mcap").read_bytes()
    (tmp_path / "cut").mkdir()
    path = tmp_path / "cut" / "run.mcap.part"
    path.write_bytes(data[: len(data) * 2 // 3])
    return path


def test_recover_writes_report_and_results(cut: Path) -> None:
    said = in_process("recover", cut)
    assert said.returncode == 0, said.stderr
    assert f"report: {cut.parent / 'report.html'}" in said.stdout
    found = results(cut.parent)
    assert found["status"] == "unfinished"
    assert "The record breaks off after" in found["why_it_ended"]
    assert found["levels_done"] > 0
    assert "unfinished" in (cut.parent / "report.html").read_text()


def cut_off(record: Any, **changes: Any) -> Any:
    """The recording as if it had never been finished, with some of it changed."""
    return replace(record, results=None, partial=True, **changes)


def test_the_outcome_of_a_cut_record_hides_nothing(cycles_run: Path) -> None:
    whole, told = read_recording(cycles_run / "run.mcap"), results(cycles_run)
    plain = outcome_of(cut_off(whole))
    up = [e for e in whole.events if e.kind == "held" and e.data["loading"]]
    assert plain.levels_done == len(up) == told["levels_done"]
    assert plain.peak_force_n == pytest.approx(told["peak_force_n"], rel=1e-3)
    pulled = cut_off(whole, ticks=whole.ticks._replace(force_n=-whole.ticks.force_n))
    assert outcome_of(pulled).peak_force_n == pytest.approx(plain.peak_force_n)
    trip = Event(3.0, "trip", {
        "rule": "R1", "value": 400.0, "limit": 375.0, "unit": "N", "sample_age_s": "nan",
        "time_s": 3.0, "message": "force 400 N is beyond 375 N",
    })  # fmt: skip
    events = (*(e for e in whole.events if e.kind != "end"), trip)
    stopped = outcome_of(cut_off(whole, events=events))
    assert stopped.cause is not None
    assert stopped.cause.rule == "R1"
    assert "had been stopped by R1: force 400 N is beyond 375 N" in stopped.why


def test_limits_of_another_version_are_told(
    cycles_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not any("of that day" in each for each in results_again(cycles_run)[1].reasons)
    had = reevaluation.limits_from

    def other(attachments: Any) -> Any:
        limits = had(attachments)
        return replace(limits, force_limit_n=0.9 * limits.force_limit_n)

    monkeypatch.setattr(reevaluation, "limits_from", other)
    data, document = results_again(cycles_run)
    assert "the run's force limit was 337.5 N" in document.reasons[0]
    assert data["reasons"][0] == document.reasons[0]


def test_the_results_name_the_devices(cycles_run: Path) -> None:
    told = results(cycles_run)["run"]
    assert told["arm"].startswith("sim: ")
    assert told["force"].startswith("sim: ")


def test_recover_leaves_results_that_somebody_wrote(cut: Path) -> None:
    (cut.parent / "results.json").write_text("mine")
    said = in_process("recover", cut)
    assert said.returncode == 0
    assert "no report: " in said.stdout
    assert (cut.parent / "results.json").read_text() == "mine"


def test_the_outcome_is_read_as_it_was_written(cycles_run: Path) -> None:
    told, run = results(cycles_run), evaluation_of(cycles_run)
    outcome = run.outcome
    assert outcome.why == told["why_it_ended"]
    assert outcome.lateness.ticks == told["lateness"]["ticks"] == len(run.recording.ticks.time_s)
    assert [each.name for each in outcome.safing] == [each["name"] for each in told["safing"]]
    whole = read_recording(cycles_run / "run.mcap")
    spoiled: Any = {**told, "status": "lost"}
    with pytest.raises(ValueError, match="lost"):
        outcome_of(replace(whole, results=spoiled))


def test_a_run_with_another_payload_is_opened_with_it(quick_plan: Path, tmp_path: Path) -> None:
    payload = ROOT / "procedures/payloads/plastic-sphere.yaml"
    other = tmp_path / "other.yaml"
    other.write_text(payload.read_text().replace("name: ", "name: other "))
    shutil.copy(quick_plan, tmp_path / "plan.yaml")
    said = in_process(
        "run", tmp_path / "plan.yaml", "--dry-run", "--quiet", "--payload", other,
        "--tag", "specimen=S7", "--tag", "polished", "--out", tmp_path / "run",
    )  # fmt: skip
    assert said.returncode == 0, said.stderr
    run = stepload.open(tmp_path / "run")
    assert run.plan.payload.name == load_plan(quick_plan, payload=other).payload.name
    assert run.plan.payload.name.startswith("other ")
    about = results(tmp_path / "run")["run"]
    assert (about["specimen"], about["tags"]) == ("S7", ["polished"])
    assert about["payload"] == run.plan.payload.name
    assert about["files"].keys() >= {"plan.yaml", "plan-1-other.yaml"}


def test_tags_say_what_the_plan_does_not(quick_plan: Path) -> None:
    plan = load_plan(quick_plan, today=date(2026, 8, 1))
    record = tagged(plan, ["batch = B7", "operator=Ann", "a=b", "a=b"]).record
    assert (record.batch, record.operator, record.specimen) == ("B7", "Ann", "")
    assert record.tags == ("a=b",)
    for wrong in (["batch=A", "batch=B"], ["specimen="], [""], ["a\nb"], ["x" * 201]):
        with pytest.raises(BadInputError, match="--tag"):
            tagged(plan, wrong)
