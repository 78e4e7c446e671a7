"""Results and report of a record that is there already: `identify --out` and `recover`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from real_runs import in_process, results

from stepload.record.reader import Event, read_recording
from stepload.report.run_record import evaluation_of, outcome_of


def test_a_record_gives_the_results_of_its_run_again(cycles_run: Path, cycles_again: Path) -> None:
    said = (cycles_again.parent / "said.txt").read_text()
    assert f"report: {cycles_again / 'report.html'}" in said
    assert results(cycles_again) == results(cycles_run)
    assert "<figure" in (cycles_again / "report.html").read_text()


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
