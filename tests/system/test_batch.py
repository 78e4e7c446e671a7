"""`stepload batch`: dry runs of a list, its end, and what the table says of them."""

from __future__ import annotations

import json
import os
import pty
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jsonschema
import numpy as np
import pytest
from real_runs import CYCLES, Staged, in_process

from stepload.cli import batch as verb
from stepload.data.batch import pressed
from stepload.errors import BadInputError
from stepload.plan.model import Acceptance
from stepload.record.outcome import RunStatus
from stepload.report.batch import Batch, batch_document, batch_of
from stepload.report.rows import schema_of
from stepload.report.run_record import SavedRun, saved_run

Stage = Callable[..., Staged]


@pytest.fixture
def pressed_again(cycles_run: Path) -> Callable[..., list[SavedRun]]:
    """Runs like one that was pressed, of specimens that are so many times as stiff."""
    saved = saved_run(cycles_run)
    bend_m = saved.conditions.bend(saved.data.force_n)

    def made(factors: Sequence[float], **told: Sequence[str]) -> list[SavedRun]:
        runs = []
        for at, factor in enumerate(factors):
            travel_m = (saved.data.travel_m - bend_m) / factor + bend_m
            more = {key: values[at] for key, values in told.items()}
            names = {"specimen": f"S{at + 1:02}", "started": f"2026-08-01T10:{at:02}:00", **more}
            runs.append(replace(
                saved, data=replace(saved.data, travel_m=travel_m),
                metadata={**saved.metadata, "run_id": str(at), **names},
            ))  # fmt: skip
        return runs

    return made


def _factors(count: int) -> list[float]:
    factors = 1.0 + 0.01 * np.sin(2.4 * np.arange(count))
    factors[[7, 14]] = 1.12, 0.9
    return [float(each) for each in factors]


def _standing_out(found: Batch) -> list[str]:
    return [each.name for each in found.specimens if each.broken]


def test_two_of_sixteen_stand_out(pressed_again: Callable[..., list[SavedRun]]) -> None:
    runs = pressed_again(_factors(16))
    found = batch_of("B7", runs, Acceptance(chord_min_n_per_m=4e6))
    assert _standing_out(found) == ["S08", "S15"]
    assert [found.specimens[at].broken for at in (7, 14)] == [("WE1", "ESD")] * 2
    assert found.verdict == "out of control"
    assert found.capability is not None
    assert found.capability.cp is None
    jsonschema.validate(json.loads(found.model_dump_json()), schema_of(Batch, "batch"))
    document = batch_document(found, runs)
    assert "#b3261e" in document.figures[0].draw()


def test_what_all_share_does_not_shrink(pressed_again: Callable[..., list[SavedRun]]) -> None:
    factors = [1.0, 1.01, 0.99, 1.005]
    few, many = (batch_of("B7", pressed_again(factors * n), None).mean for n in (1, 2))
    assert few is not None
    assert many is not None
    assert many.scatter < 0.6 * few.scatter
    assert many.common == pytest.approx(few.common, rel=1e-3)
    assert many.half_width == pytest.approx(np.hypot(many.scatter, many.common))
    assert many.common > 0.01


def test_gauge_of_two_operators(pressed_again: Callable[..., list[SavedRun]]) -> None:
    names = [part for part in "ab" for _ in range(4)]
    operators, tags = ["Ann", "Ann", "Bob", "Bob"] * 2, ["trial=1", "trial=2"] * 4
    factors = [
        {"a": 0.9, "b": 1.1}[part] * (1.02 if who == "Bob" else 1.0) + 0.001 * (at % 2)
        for at, (part, who) in enumerate(zip(names, operators, strict=True))
    ]
    runs = pressed_again(factors, specimen=names, operator=operators, tags=tags)
    limits = Acceptance(chord_min_n_per_m=4e6, chord_max_n_per_m=8e6)
    gauge = batch_of("B7", runs, limits).gauge
    assert gauge is not None
    assert (gauge.operators, gauge.trials) == (2, 2)
    line = {each.name: each for each in gauge.lines}
    assert line["EV"].sigma_n_per_m < line["AV"].sigma_n_per_m < line["PV"].sigma_n_per_m
    assert line["TV"].of_tolerance == pytest.approx(6.0 * line["TV"].sigma_n_per_m / 4e6)
    unlike = batch_of("B7", runs[3:6], None)
    assert unlike.gauge is None
    assert [each.runs for each in unlike.specimens] == [1, 2]


def test_a_plan_that_has_changed_is_told(pressed_again: Callable[..., list[SavedRun]]) -> None:
    runs = pressed_again([1.0, 1.01])
    (few,) = batch_of("B7", runs, None).notes
    assert few.startswith("2 ")
    other = replace(runs[1], metadata={**runs[1].metadata, "sha256 plan.yaml": "abc"})
    note, _ = batch_of("B7", [runs[0], other], None).notes
    assert "plan.yaml" in note


def test_one_payload_a_batch(pressed_again: Callable[..., list[SavedRun]]) -> None:
    runs = pressed_again([1.0, 1.0], payload=["ball", "cone"])
    with pytest.raises(BadInputError):
        batch_of("B7", runs, None)


def test_a_batch_is_pressed_and_goes_on(quick: Path, tmp_path: Path) -> None:
    specimens, out = tmp_path / "b.csv", tmp_path / "b"
    head, wrong = "specimen,operator,trial,plan\n", tmp_path / "wrong.yaml"
    place = "profile: stvf\n"
    assert place in quick.read_text()
    far = f"{place}  simulation: {{surface_error: 0.5 mm}}\n"
    wrong.write_text(quick.read_text().replace(place, far))
    words = ("batch", quick, specimens, "--dry-run", "--quiet", "--json", "--out", out)
    specimens.write_text(f"{head}S1,Ann,1,\nS2,Ann,1,wrong.yaml\n")
    first = in_process(*words)
    assert first.returncode == 4, first.stderr
    found = json.loads(first.stdout)
    assert [each["name"] for each in found["specimens"]] == ["S1"]
    runs = {each.name: json.loads((each / "results.json").read_text()) for each in out.iterdir()
            if each.is_dir()}  # fmt: skip
    stopped = [each for each in runs.values() if each["status"] == "stopped"]
    assert [each["cause"]["rule"] for each in stopped] == ["specimen"]
    assert [each["run"]["batch"] for each in runs.values()] == ["b", "b"]

    specimens.write_text(f"{head}S1,Ann,1,\nS2,Ann,1,\n")
    second = in_process(*words)
    assert second.returncode == 0, second.stderr
    assert [each["name"] for each in json.loads(second.stdout)["specimens"]] == ["S1", "S2"]
    done = {("quick", "S1", "Ann", "1"), ("quick", "S2", "Ann", "1")}
    assert set(pressed(out, dry_run=True)) == done
    assert not pressed(out, dry_run=False)  # a rehearsal is no press
    again = in_process(*words)
    assert json.loads(again.stdout)["specimens"] == json.loads(second.stdout)["specimens"]
    assert (out / "batch.html").stat().st_size > 1000


@pytest.mark.parametrize(
    ("rules", "code", "count"),
    [
        (["R8", "R6"], 4, 2),
        (["R3", "R6"], 4, 1),
        (["", "R6"], 130, 1),
    ],
)
def test_what_ends_a_batch(
    quick: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rules: list[str], code: int,
    count: int,
) -> None:  # fmt: skip
    """A stop of the specimen goes on with the next, one of the rig or Ctrl+C ends the batch."""
    (tmp_path / "b.csv").write_text("specimen\nS1\nS2\n")
    left, plans = list(rules), list[Any]()

    def press(preflight: Any, *_: object, **__: object) -> Any:
        plans.append(preflight.plan)
        rule = left.pop(0)
        outcome = SimpleNamespace(
            status=RunStatus.STOPPED if rule else RunStatus.INTERRUPTED,
            cause=SimpleNamespace(rule=rule) if rule else None, safing_failed=False,
            signal_number=0 if rule else signal.SIGINT,
        )  # fmt: skip
        return SimpleNamespace(outcome=outcome, left_early=0, problems=())

    monkeypatch.setattr("stepload.cli.run.press", press)
    words = ("batch", quick, tmp_path / "b.csv", "--dry-run", "--out", tmp_path / "b")
    assert in_process(*words).returncode == code
    assert [each.record.specimen for each in plans] == ["S1", "S2"][:count]


def test_nobody_is_asked_in_vain(quick: Path, tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text("specimen\nS1\n")
    assert in_process("batch", quick, tmp_path / "b.csv").returncode == 2
    (tmp_path / "same").mkdir()
    (tmp_path / "same" / quick.name).write_bytes(quick.read_bytes())
    (tmp_path / "b.csv").write_text(f"specimen,plan\nS1,\nS1,same/{quick.name}\n")
    assert in_process("batch", quick, tmp_path / "b.csv", "--dry-run").returncode == 2


def test_an_early_enter_and_a_word_are_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    parent, child = pty.openpty()
    typed = iter((b"yes\n", b"s\n"))
    os.write(parent, b"\n")

    def shown(text: str) -> int:
        return os.write(parent, next(typed)) if text else 0

    with os.fdopen(child, closefd=True) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        monkeypatch.setattr(sys, "stderr", SimpleNamespace(write=shown, flush=lambda: None))
        assert verb._ask("?") == "s"
    os.close(parent)


@pytest.mark.long
def test_ctrl_c_and_a_dead_sensor(stage: Stage, quick: Path, tmp_path: Path) -> None:
    """Ctrl+C does what it does in `run`; a fault of the rig ends the batch."""
    (tmp_path / "b.csv").write_text("specimen\nS1\nS2\n")
    words = ("batch", quick, tmp_path / "b.csv", "--dry-run", "--quiet", "--out")
    staged = stage({"at": "LOAD 2", "wait": "stop 1"}, *words, tmp_path / "b")
    staged.wait_until_there()
    staged.process.send_signal(signal.SIGINT)
    assert staged.finish()[0] == 130
    broken = stage({"at": "LOAD 2", "break": {"force drain": "raise"}}, *words, tmp_path / "c")
    assert broken.finish()[0] == 4
    for name, status in ("b", "interrupted"), ("c", "stopped"):
        (only,) = (tmp_path / name).iterdir()
        assert json.loads((only / "results.json").read_text())["status"] == status


@pytest.mark.long
@pytest.mark.timeout(900)
def test_twenty_simulated_specimens(tmp_path: Path) -> None:
    plan, rows, place = tmp_path / "foot.yaml", ["specimen,plan"], "profile: stvf\n"
    plan.write_text(CYCLES)
    for at, factor in enumerate(_factors(20), 1):
        rows.append(f"S{at:02},{at}.yaml")
        of_it = f"{place}  simulation: {{payload_factor: {factor:.4f}}}\n"
        (tmp_path / f"{at}.yaml").write_text(CYCLES.replace(place, of_it))
    (tmp_path / "b.csv").write_text("\n".join(rows))
    words = ("batch", plan, tmp_path / "b.csv", "--dry-run", "--quiet", "--json", "--out")
    done = in_process(*words, tmp_path / "b")
    assert done.returncode == 0, done.stderr
    assert _standing_out(Batch.model_validate_json(done.stdout)) == ["S08", "S15"]
