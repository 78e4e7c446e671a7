"""Whole dry runs that load no further than an interval needs: records, results, reports."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import jsonschema
import pytest
from real_runs import ROOT, in_process, leave_out_figures

from stepload.envelope.envelope import Envelope, envelope_of
from stepload.errors import BadInputError, ExitCode
from stepload.plan.load import load_plan
from stepload.record.reader import Recording, read_recording
from stepload.record.rows import Phase
from stepload.results.analyse import whole_cycles
from stepload.results.reasons import loaded
from stepload.results.run_record import evaluation_of
from stepload.results.run_results import results_schema
from stepload.session.experiment import Finished, run_plan
from stepload.session.resume import resumable

PLAN = f"""
stepload: 1
payload: {ROOT}/procedures/payloads/plastic-sphere.yaml
rig:
  profile: stvf
  simulation: {{law: smooth}}
procedure:
  step: 30 N
  top_force: 300 N
  hold: 1 s
  touches: 1
  surface_distance: 1 mm
  surface_uncertainty: 0.1 mm
  tare: 0.5 s
  warm_up: 0 s
  until: ±%s %%
"""
TOP_N = 300.0


class Ran(NamedTuple):
    envelope: Envelope
    finished: Finished
    recording: Recording
    said: list[str]

    @property
    def until(self) -> dict[str, Any]:
        return dict(self.finished.data["until"])

    @property
    def loaded_n(self) -> dict[int, list[float]]:
        """Levels that were held on the way up, by cycle."""
        found: dict[int, list[float]] = {}
        for event in self.recording.events:
            if event.kind == "held" and event.data["loading"]:
                found.setdefault(int(str(event.data["cycle"])), []).append(
                    float(str(event.data["level_n"]))
                )
        return found


def ran(place: Path, factor: float, asked: str, more: str = "") -> Ran:
    """One dry run of a payload whose K is `factor` times the believed one."""
    path = place / "plan.yaml"
    path.write_text(PLAN % asked + more, encoding="utf-8")
    plan = load_plan(path)
    simulation = replace(plan.rig.simulation, payload_factor=factor)
    envelope = envelope_of(replace(plan, rig=replace(plan.rig, simulation=simulation)))
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        finished = run_plan(
            envelope, dry_run=True, out=place / "run", seed=1, on_notice=said.append
        )
    return Ran(envelope, finished, read_recording(place / "run" / "run.mcap"), said)


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    return ran(tmp_path_factory.mktemp("soft"), 0.6, "12")


@pytest.fixture(scope="module")
def stiff(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    return ran(tmp_path_factory.mktemp("stiff"), 8.0, "10")


@pytest.fixture(scope="module")
def between(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    return ran(tmp_path_factory.mktemp("between"), 1.5, "10")


def test_a_soft_payload_is_loaded_no_further_than_needed(soft: Ran) -> None:
    data = soft.finished.data
    assert data["status"] == "completed"
    assert data["verdict"] == "identified"
    assert soft.until["verdict"] == "enough"
    assert soft.until["met"]
    assert soft.until["half_width"] <= 0.12
    top_n = soft.until["level_n"]
    assert top_n < TOP_N
    assert data["peak_force_n"] < 1.03 * top_n
    assert soft.finished.outcome.levels_done == 2 * len(soft.until["looks"])
    [said] = [line for line in soft.said if "far enough" in line]
    assert said == f"far enough for ±12 % at {top_n:g} N of 300 N: no more force than this"


def test_every_cycle_goes_to_the_same_level_and_none_above(soft: Ran) -> None:
    first, second = soft.loaded_n[1], soft.loaded_n[2]
    assert first == second
    assert max(first) == soft.until["level_n"]
    assert float(soft.recording.ticks.level_n.max()) == soft.until["level_n"]
    down = soft.recording.ticks.phase == Phase.UNLOAD_HOLD
    assert float(soft.recording.ticks.level_n[down].max()) == first[-2]


def test_its_limits_are_those_of_the_whole_plan(soft: Ran) -> None:
    assert float(soft.recording.ticks.limit_n.min()) == pytest.approx(1.25 * TOP_N)


def test_between_cycles_a_share_of_the_force_that_was_reached_is_kept(tmp_path: Path) -> None:
    kept = "  lift_off: false\n  unload: false\n  unload_fraction: 50 %\n"
    run = ran(tmp_path, 0.3, "15", kept)
    assert run.until["verdict"] == "enough"
    between = [
        float(str(event.data["level_n"]))
        for event in run.recording.events
        if event.kind == "held" and not event.data["loading"]
    ]
    assert between == [0.5 * run.until["level_n"]]
    assert run.until["level_n"] < TOP_N
    assert run.loaded_n[1] == run.loaded_n[2]


def test_a_stiff_payload_stops_as_soon_as_nothing_can_be_enough(stiff: Ran) -> None:
    data = stiff.finished.data
    assert (data["status"], data["cause"]["rule"]) == ("stopped", "until")
    assert data["cause"]["value"] < data["cause"]["limit"]
    assert stiff.until["verdict"] == "unreachable"
    assert not stiff.until["met"]
    assert stiff.until["level_n"] < TOP_N
    assert data["peak_force_n"] < 1.03 * stiff.until["level_n"]
    why = stiff.finished.outcome.why
    assert "as its plan asks: an interval of ±10 % cannot be reached" in why
    assert "(value" not in why
    [said] = [line for line in stiff.said if "cannot be reached" in line]
    assert said.startswith("ENDING at ")
    assert said.endswith("The arm retracts. Use the emergency stop if it does not.")
    assert data["verdict"] != "identified"
    assert "±10 % cannot be reached" in stiff.finished.outcome.why
    assert stiff.finished.outcome.retracted
    assert any("was out of reach" in reason for reason in data["reasons"])


@pytest.mark.long
def test_between_both_it_goes_to_the_top(between: Ran) -> None:
    assert between.finished.data["status"] == "completed"
    assert between.until["verdict"] == "more"
    assert max(between.loaded_n[1]) == TOP_N
    assert not between.until["met"]
    assert any("no level showed enough" in r for r in between.finished.data["reasons"])


@pytest.mark.parametrize("name", ["soft", "stiff", pytest.param("between", marks=pytest.mark.long)])
def test_results_are_of_their_schema_and_the_report_says_it(
    name: str, request: pytest.FixtureRequest
) -> None:
    run: Ran = request.getfixturevalue(name)
    written = json.loads((run.finished.directory / "results.json").read_text())
    jsonschema.validate(written, results_schema())
    assert written["until"]["level_n"] == run.until["level_n"]
    assert "of 300 N" in (run.finished.directory / "report.html").read_text()


def test_the_record_evaluated_again_says_the_same(soft: Ran) -> None:
    again = evaluation_of(soft.finished.directory)
    found = loaded(again.recording.events, again.identification)
    assert again.identification is not None
    assert found is not None
    assert found.half_width == pytest.approx(soft.until["half_width"], rel=1e-9)
    assert (found.verdict, found.level_n, found.met) == ("enough", soft.until["level_n"], True)
    assert again.run_in is not None
    assert [cycle.number for cycle in again.run_in.cycles] == [1, 2]
    said = in_process("identify", soft.finished.directory, "--json")
    told = json.loads(said.stdout)
    assert told["headline"]["value_n_per_m"] == pytest.approx(
        soft.finished.data["headline"]["value_n_per_m"], rel=1e-9
    )
    assert any(note.startswith("loaded to ") for note in told["notes"])


def test_a_cycle_that_was_ended_early_is_whole(soft: Ran) -> None:
    procedure, events = soft.envelope.plan.procedure, soft.recording.events
    assert len(soft.until["looks"]) < len(procedure.levels_n)
    assert whole_cycles(events) == [1, 2]


def test_a_run_with_until_is_not_resumed(soft: Ran) -> None:
    with pytest.raises(BadInputError, match="its plan has `until`"):
        resumable(soft.finished.directory, soft.envelope.plan, dry_run=True)


def test_preflight_says_what_every_level_needs(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(PLAN % "15", encoding="utf-8")
    said = in_process("preflight", path, "--json")
    assert said.returncode == ExitCode.OK
    told = json.loads(said.stdout)["until"]
    assert told["asked"] == 0.15
    assert [each["level_n"] for each in told["levels"]] == [30.0 * (i + 1) for i in range(10)]
    by_theory = [
        each["level_n"]
        for each in told["levels"]
        if each["needed_m"] is not None and each["expected_m"] >= each["needed_m"]
    ]
    assert told["expected_level_n"] == by_theory[0]
