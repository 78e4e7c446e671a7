"""Whole dry runs that load no further than an interval needs: records, results, reports."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from real_runs import ROOT, in_process, leave_out_figures

from stepload.errors import BadInputError, ExitCode
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.plan.load import load_plan
from stepload.record.reader import Recording, read_recording
from stepload.record.rows import Phase
from stepload.report.reasons import loaded
from stepload.report.run_record import evaluation_of
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
    preflight: Preflight
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


def ran(place: Path, factor: float, requested: str, more: str = "") -> Ran:
    """One dry run of a payload whose K is `factor` times the believed one."""
    path = place / "plan.yaml"
    path.write_text(PLAN % requested + more, encoding="utf-8")
    plan = load_plan(path)
    simulation = replace(plan.rig.simulation, payload_factor=factor)
    preflight = preflight_of(replace(plan, rig=replace(plan.rig, simulation=simulation)))
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        finished = run_plan(
            preflight, dry_run=True, out=place / "run", seed=1, on_notice=said.append
        )
    return Ran(preflight, finished, read_recording(place / "run" / "run.mcap"), said)


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    return ran(tmp_path_factory.mktemp("soft"), 0.6, "12")


@pytest.fixture(scope="module")
def stiff(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    return ran(tmp_path_factory.mktemp("stiff"), 8.0, "10")


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


@pytest.mark.long
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


def test_a_run_with_until_is_not_resumed(soft: Ran) -> None:
    with pytest.raises(BadInputError, match="its plan has `until`"):
        resumable(soft.finished.directory, soft.preflight.plan, dry_run=True)


def test_preflight_says_what_every_level_needs(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(PLAN % "15", encoding="utf-8")
    said = in_process("preflight", path, "--json")
    assert said.returncode == ExitCode.OK
    told = json.loads(said.stdout)["until"]
    assert told["requested"] == 0.15
    assert [each["level_n"] for each in told["levels"]] == [30.0 * (i + 1) for i in range(10)]
    by_theory = [
        each["level_n"]
        for each in told["levels"]
        if each["needed_m"] is not None and each["expected_m"] >= each["needed_m"]
    ]
    assert told["expected_level_n"] == by_theory[0]
