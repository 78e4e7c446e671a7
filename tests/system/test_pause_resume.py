"""Pause and resume a run; take up an interrupted one."""

from __future__ import annotations

import json
import os
import pty
import signal
import socket
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from real_runs import ENVIRONMENT, HERE, PATIENCE_S, Staged, in_process, leave_out_figures, results

from stepload.engine.operator import Operator, StopLevel
from stepload.engine.tick import Engine
from stepload.errors import BadInputError
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.record.reader import Recording, read_recording
from stepload.record.recovery import is_being_written
from stepload.record.rows import Phase
from stepload.session import control
from stepload.session.experiment import run_plan

Stage = Callable[..., Staged]


@pytest.fixture(autouse=True)
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    leave_out_figures(monkeypatch)


def _phases(recording: Recording) -> list[str]:
    return [str(e.data["phase"]) for e in recording.events if e.kind == "phase"]


def _wait_for_phase(directory: Path, phase: str) -> dict[str, object]:
    give_up_at = time.monotonic() + PATIENCE_S
    while (answer := control.ask(directory, "status"))["phase"] != phase:
        assert time.monotonic() < give_up_at, answer
        time.sleep(0.05)
    return answer


def test_pause_from_another_terminal(stage: Stage, quick: Path, tmp_path: Path) -> None:
    directory = tmp_path / "run"
    staged = stage(
        {"at": "LOAD 2", "wait": "paused"},
        "run", quick, "--dry-run", "--out", directory, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    paused = in_process("pause", directory, "--json")
    assert paused.returncode == 0, paused.stderr
    assert json.loads(paused.stdout)["paused"] is True
    answer = _wait_for_phase(directory, "PAUSED")
    assert abs(float(str(answer["force_n"]))) < 3.0  # unloaded
    told = in_process("pause", directory, "--resume")
    assert told.returncode == 0
    assert "goes on" in told.stdout
    assert staged.finish()[0] == 0
    assert results(directory)["status"] == "completed"
    recording = read_recording(directory / "run.mcap")
    assert recording.metadata["run_id"] == answer["run_id"]
    phases = _phases(recording)
    at = phases.index("PAUSED")
    assert phases[at - 2 : at] == ["HOLD", "RETRACT"]  # the step was finished first
    after = phases[at + 1 :]
    before_load = after[: after.index("LOAD")]
    assert [p for p in before_load if p in ("TARE", "GUARDED_APPROACH", "DWELL")] == [
        "TARE", "GUARDED_APPROACH", "DWELL",
    ]  # fmt: skip
    held = [e.data["step"] for e in recording.events if e.kind == "held"]
    assert held == [1, 2, 3]
    assert "resume" in [e.data["purpose"] for e in recording.events if e.kind == "touch"]
    assert not (directory / "control").exists()


def test_p_in_the_terminal(quick: Path, tmp_path: Path) -> None:
    """Under a real pseudo-terminal, whose modes come back."""
    parent, child = pty.openpty()
    received, say = os.pipe()
    before = termios.tcgetattr(child)
    directions = json.dumps({"at": "LOAD 1", "wait": "paused", "say": say})
    process = subprocess.Popen(
        [sys.executable, str(HERE / "staged.py"), directions, "run", str(quick), "--dry-run",
         "--out", str(tmp_path / "run")],
        stdin=child, stdout=child, stderr=child, pass_fds=(say,), env=ENVIRONMENT,
        start_new_session=True, preexec_fn=lambda: os.close(os.open(os.ttyname(0), os.O_RDWR)),
    )  # fmt: skip
    os.close(say)
    try:
        printed = _pump(parent, until=received)
        during = termios.tcgetattr(child)
        assert not during[3] & termios.ICANON
        os.write(parent, b"p")
        give_up_at = time.monotonic() + PATIENCE_S
        while control.ask(tmp_path / "run", "status")["phase"] != "PAUSED":
            printed += _pump(parent)
            assert time.monotonic() < give_up_at
        os.write(parent, b"p")
        while process.poll() is None and time.monotonic() < give_up_at:
            printed += _pump(parent)
        assert process.returncode == 0, printed.decode()
        assert termios.tcgetattr(child) == before
    finally:
        process.kill()
        process.wait()
        for fd in (parent, child, received):
            os.close(fd)
    assert "PAUSED" in _phases(read_recording(tmp_path / "run" / "run.mcap"))


def _pump(parent: int, until: int = -1) -> bytes:
    """What the terminal has printed by now; a terminal that nobody reads would stop the run."""
    import select

    printed = b""
    while True:
        ready, _, _ = select.select([parent, *([until] if until >= 0 else [])], [], [], 0.1)
        if parent in ready:
            printed += os.read(parent, 65536)
        if until in ready or (not ready and until < 0):
            return printed


def test_ctrl_c_ends_a_paused_run(stage: Stage, quick: Path, tmp_path: Path) -> None:
    directory = tmp_path / "run"
    staged = stage(
        {"at": "HOLD 1", "wait": "paused"},
        "run", quick, "--dry-run", "--out", directory, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    control.ask(directory, "pause")
    _wait_for_phase(directory, "PAUSED")
    staged.process.send_signal(signal.SIGINT)
    assert staged.finish()[0] == 130
    recording = read_recording(directory / "run.mcap")
    assert recording.ticks.phase[-1] == Phase.DONE


@pytest.mark.parametrize(
    ("cut", "whole", "problem"),
    [
        pytest.param(2, [1, 3], "", marks=pytest.mark.long),
        (1, [], "cycle 1, the virgin one, was not pressed and unloaded"),
    ],
)
def test_a_cycle_cut_short_by_a_pause_is_not_compared(
    quick: Path, tmp_path: Path, cut: int, whole: list[int], problem: str
) -> None:
    quick.write_text(quick.read_text().replace("unload: false\n  cycles: 1", f"cycles: {cut + 1}"))
    operator, seen = Operator(), []

    def pause_on_the_way_down(engine: Engine, _check: object) -> None:
        step = engine.course
        if (step.phase, step.cycle, step.step_number) == (Phase.UNLOAD_HOLD, cut, 2):
            operator.paused = True
        elif step.phase == Phase.PAUSED:
            seen.append(step.cycle)
            operator.paused = False

    finished = run_plan(
        preflight_of(load_plan(quick)), dry_run=True, out=tmp_path / "run", operator=operator,
        on_progress=pause_on_the_way_down,
    )  # fmt: skip
    assert seen
    assert finished.outcome.status == "completed", finished.outcome.why
    found = finished.evaluation
    assert found is not None
    assert found.identification is not None
    assert problem in found.problem
    cycles = found.run_in.cycles if found.run_in else ()
    assert [cycle.number for cycle in cycles] == whole


@pytest.mark.parametrize(
    ("at", "level", "whole"),
    [
        ((Phase.HOLD, 1, 1), StopLevel.AFTER_STEP, []),
        pytest.param((Phase.HOLD, 1, 3), StopLevel.NOW, [], marks=pytest.mark.long),
        pytest.param((Phase.UNLOAD, 1, 1), StopLevel.NOW, [], marks=pytest.mark.long),
        pytest.param((Phase.LOAD, 2, 3), StopLevel.AFTER_STEP, [1], marks=pytest.mark.long),
        pytest.param((Phase.HOLD, 3, 3), StopLevel.NOW, [1, 2], marks=pytest.mark.long),
    ],
)
def test_a_run_of_cycles_that_ends_early_has_a_report_of_the_whole_ones(
    quick: Path, tmp_path: Path, at: tuple[Phase, int, int], level: StopLevel, whole: list[int]
) -> None:
    quick.write_text(quick.read_text().replace("unload: false\n  cycles: 1", "cycles: 3"))
    operator, out = Operator(), tmp_path / "run"

    def stop_there(engine: Engine, _check: object) -> None:
        step = engine.course
        if (step.phase, step.cycle, step.step_number) == at:
            operator.stop_level = level

    finished = run_plan(
        preflight_of(load_plan(quick)),
        dry_run=True,
        out=out,
        operator=operator,
        on_progress=stop_there,
    )
    assert finished.outcome.status == "interrupted"
    assert finished.problems == ()
    report = (out / "report.html").read_text()
    assert "request" in report
    found = finished.evaluation
    assert found is not None
    assert found.identification is not None
    cycles = found.run_in.cycles if found.run_in else ()
    assert [cycle.number for cycle in cycles] == whole
    if at[1] == 2:  # its first cycle is in the other record
        resumed = run_plan(
            preflight_of(load_plan(quick)), dry_run=True, resume=out, out=tmp_path / "resumed"
        )
        rest_of = results(resumed.directory)["run_in"]
        assert [cycle["number"] for cycle in rest_of["cycles"]] == [3]
        assert rest_of["virgin"] is None
        rest = (resumed.directory / "report.html").read_text()
        assert "The virgin contact is not in this record; fewer than 3 cycles" in rest


@pytest.mark.long
def test_an_interrupted_run_is_taken_up(stage: Stage, quick: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    staged = stage(
        {"at": "HOLD 2", "wait": "for ever"},
        "run", quick, "--dry-run", "--out", first, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    staged.process.kill()
    staged.process.wait()
    give_up_at = time.monotonic() + PATIENCE_S
    while is_being_written(first / "run.mcap.part"):  # by the writer that outlives its run
        assert time.monotonic() < give_up_at
        time.sleep(0.01)
    done = in_process("run", quick, "--dry-run", "--resume", first, "--out", second, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    old, new = (read_recording(d / "run.mcap") for d in (first, second))
    assert old.partial
    assert found["resumed"] in found["reasons"]
    assert old.metadata["run_id"] in found["resumed"]
    assert "before cycle 1, 200 N are in that record" in found["resumed"]
    assert new.metadata["resumed_run_id"] == old.metadata["run_id"]
    held = [
        [e.data["step"] for e in recording.events if e.kind == "held"] for recording in (old, new)
    ]
    assert held == [[1], [2, 3]]
    assert "first" in [e.data["purpose"] for e in new.events if e.kind == "touch"]
    assert found["selected"] in found["fits"]


@pytest.fixture
def finished(quick_plan: Path, quick_run: Path) -> tuple[Path, Path]:
    """(plan, directory) of a finished dry run."""
    return quick_plan, quick_run


def test_a_directory_without_a_run(finished: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="no run is going on"):
        control.ask(finished[1], "pause")
    with socket.socket(socket.AF_UNIX) as left:  # what a killed run leaves behind
        left.bind(str(tmp_path / "control"))
    with pytest.raises(BadInputError, match="no run is going on"):
        control.ask(tmp_path, "pause")
    operator = Operator()
    with control.listening(tmp_path, operator, lambda: {"phase": "HOLD"}) as missing:
        assert missing == ""
        assert control.ask(tmp_path, "pause") == {"paused": True, "stops": False, "phase": "HOLD"}
        assert operator.paused
        with pytest.raises(BadInputError, match="refuses"):
            control.ask(tmp_path, "go")
        assert control.ask(tmp_path, "resume")["paused"] is False
        operator.moving = True
        for _ in range(2):  # no second one makes it more urgent
            assert control.ask(tmp_path, "stop")["stops"] is True
        assert (operator.stop_level, operator.signal_number) == (1, signal.SIGINT)
    assert list(tmp_path.iterdir()) == []
