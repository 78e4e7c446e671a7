"""Any part may break: the arm goes back, the record is whole, and what broke is told."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from long_ones import long
from real_runs import QUICK, results
from staged import PARTS, leave_out_judgement

from stepload.engine import safe_end
from stepload.engine.open_rig import OpenRig, opened
from stepload.engine.tick import Engine
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.plan.load import load_plan
from stepload.record.reader import read_recording
from stepload.record.recorder import Recorder, RecordingFailedError
from stepload.record.rows import Phase
from stepload.session.experiment import Finished, run_plan

OPEN_N = 1.0


class Breaking:
    """Runs a plan while parts break from the hold of a step on; keeps the rig's truth."""

    def __init__(self, preflight: Preflight, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._preflight, self.out, self._monkeypatch = preflight, out, monkeypatch
        self._broken = False
        self.force_left_n = float("nan")
        self.peak_n = 0.0

    def run(self, *parts: str) -> Finished:
        patch = self._monkeypatch.setattr
        patch(safe_end, "SAFE_DEADLINE_S", 0.5)
        leave_out_judgement(patch)
        for part in parts:
            owner, name = PARTS[part]
            patch(owner, name, self._breaking(getattr(owner, name)))
        return run_plan(
            self._preflight,
            dry_run=True,
            out=self.out,
            on_progress=self._look,
            open_rig=self._watched,
        )

    def _breaking(self, original: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            if self._broken:
                raise RuntimeError("broken on purpose")
            return original(*args, **kwargs)

        return call

    def _look(self, engine: Engine, _: object) -> None:
        if engine.row and (engine.row.phase, engine.row.step) == (Phase.HOLD, 1):
            self._broken = True

    @contextmanager
    def _watched(self, *args: Any, **kwargs: Any) -> Iterator[OpenRig]:
        with opened(*args, **kwargs) as rig:
            yield rig
            assert rig.world is not None
            self.force_left_n = rig.world.true_force_n
            self.peak_n = rig.world.true_peak_force_n


@pytest.fixture(scope="module")
def preflight(tmp_path_factory: pytest.TempPathFactory) -> Preflight:
    """Of the quick plan, quicker still: two steps from nearby."""
    text = QUICK
    for told, shorter in (
        ("top_force: 300 N", "top_force: 200 N"),
        ("surface_distance: 2 mm", "surface_distance: 0.6 mm"),
        ("surface_uncertainty: 0.3 mm", "surface_uncertainty: 0.05 mm"),
    ):
        assert told in text
        text = text.replace(told, shorter)
    path = tmp_path_factory.mktemp("plan") / "quick.yaml"
    path.write_text(text)
    return preflight_of(load_plan(path))


@pytest.fixture
def breaking(preflight: Preflight, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Breaking:
    return Breaking(preflight, tmp_path / "run", monkeypatch)


@pytest.mark.parametrize(
    "part",
    [
        "arm command", "force drain", "engine", "supervisor", "event",
        *long(["arm drain", "arm fault", "controller"]),
    ],
)  # fmt: skip
def test_what_breaks_in_the_loop_unloads_the_arm(breaking: Breaking, part: str) -> None:
    done = breaking.run(part)
    found = results(breaking.out)
    assert found["status"] == "stopped"
    assert "broken on purpose" in found["why_it_ended"] + " ".join(found["errors"])
    assert found["safing"][-2]["name"] == "arm stop"
    assert found["safing"][-2]["error"] == ""
    assert abs(breaking.force_left_n) < OPEN_N
    assert breaking.peak_n < found["elastic_limit_n"]
    recording = read_recording(breaking.out / "run.mcap")
    assert not recording.partial
    assert recording.ticks.step.max() >= 1
    assert done.problems == ()


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (("arm safe",), "arm stop"),
        pytest.param(("force safe",), "force sensor", marks=pytest.mark.long),
        (("arm close",), "closing the arm"),
        pytest.param(("force close",), "closing the force sensor", marks=pytest.mark.long),
        (("safing",), "safing: RuntimeError"),
    ],
)
def test_what_breaks_in_safing_is_told(
    breaking: Breaking, parts: tuple[str, ...], told: str
) -> None:
    breaking.run(*parts)
    found = results(breaking.out)
    assert found["status"] == "completed"
    slots = [f"{a['name']}: {a['error']}" for a in found["safing"] if a["error"]]
    assert any(told in slot and "broken" in slot for slot in (*slots, *found["errors"]))
    assert abs(breaking.force_left_n) < OPEN_N
    assert not read_recording(breaking.out / "run.mcap").partial


def test_safing_that_breaks_in_contact_still_retracts(breaking: Breaking) -> None:
    """Loop and safing are broken both: the arm is told directly."""
    breaking.run("engine", "safing")
    found = results(breaking.out)
    assert [a["name"] for a in found["safing"]] == ["arm retract", "arm stop"]
    assert [a["error"] for a in found["safing"]] == ["", ""]
    assert abs(breaking.force_left_n) < OPEN_N


@pytest.mark.parametrize("part", ["evaluation", "results", *long(["reading", "report"])])
def test_what_breaks_after_the_run_does_not_cost_its_record(breaking: Breaking, part: str) -> None:
    done = breaking.run(part)
    assert any("broken on purpose" in problem for problem in done.problems)
    recording = read_recording(breaking.out / "run.mcap")
    assert not recording.partial
    assert recording.results is not None
    assert recording.results["why_it_ended"] == done.outcome.why
    if part != "results":
        assert results(breaking.out)["status"] == "completed"
    assert (breaking.out / "report.html").exists() == (part == "evaluation")


def test_what_a_rescue_left_out_is_said(
    breaking: Breaking, monkeypatch: pytest.MonkeyPatch
) -> None:
    rescue, kept = Recorder.rescue, list[Any]()

    def torn(recorder: Recorder, places: Any) -> Any:
        recorder._end_writer()
        os.truncate(recorder.part_path, recorder.part_path.stat().st_size - 100_000)
        kept.append(rescue(recorder, places))
        return kept[0]

    monkeypatch.setattr(Recorder, "rescue", torn)
    with pytest.raises(RecordingFailedError) as caught:
        breaking.run("read back")
    assert kept[0].damage
    assert kept[0].damage in caught.value.hint


def test_a_record_that_cannot_be_finished_is_rescued(breaking: Breaking) -> None:
    with pytest.raises(RecordingFailedError) as caught:
        breaking.run("read back")
    assert "The run was completed." in str(caught.value)
    assert "broken on purpose" in str(caught.value)
    assert results(breaking.out)["status"] == "completed"
    recording = read_recording(breaking.out / "run.mcap")
    assert recording.partial
    assert not recording.damage
    assert len(recording.force.sequence) > 3000
