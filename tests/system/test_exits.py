"""Every way a run can end: exit code, why it stopped, the arm made safe, a record that opens."""

from __future__ import annotations

import html
import os
import resource
import shutil
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from real_runs import ROOT, Staged, in_process, results

from stepload.record.reader import Recording, read_recording
from stepload.record.recovery import is_being_written
from stepload.record.rows import Phase

Stage = Callable[..., Staged]


def _record(directory: Path, *, partial: bool = False) -> Recording:
    recording = read_recording(directory / "run.mcap")
    assert recording.partial is partial
    return recording


def test_the_end(quick: Path, tmp_path: Path) -> None:
    done = in_process("run", quick, "--dry-run", "--out", tmp_path / "run", "--quiet")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("SIMULATED, MARGINAL   ")
    assert len(done.stdout.splitlines()) == 2
    assert _record(tmp_path / "run").outcome["verdict"] == "marginal"
    assert any("only a loading" in reason for reason in results(tmp_path / "run")["reasons"])
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == [
        "metadata.yaml", "report.html", "results.json", "run.mcap",
    ]  # fmt: skip


def test_a_refusal_writes_nothing(tmp_path: Path) -> None:
    plan = ROOT / "procedures" / "plastic-cone.yaml"
    done = in_process("run", plan, "--dry-run", "--out", tmp_path / "run")
    assert done.returncode == 3
    assert "-> " in done.stderr
    assert not (tmp_path / "run").exists()


def test_a_trip_says_why(stage: Stage, quick: Path, tmp_path: Path) -> None:
    staged = stage(
        {"fault": ["force_lost", 4.0, 100.0, 0.0], "judge": True},
        "run", quick, "--dry-run", "--out", tmp_path / "run", "--quiet",
    )  # fmt: skip
    code, text = staged.finish()
    assert code == 4
    found = results(tmp_path / "run")
    cause, why = found["cause"], found["why_it_ended"]
    assert (found["status"], cause["rule"]) == ("stopped", "R3")
    assert cause["value"] > cause["limit"] == 0.012
    assert "STOPPED by R3" in text
    assert html.escape(why) in (tmp_path / "run" / "report.html").read_text()
    for told in (
        "The run was stopped by R3 at 4.01", f"limit {cause['limit']:g} s", "judged by a sample 1",
        "ms old", "The arm drew back until ", "no sound force reading proves that",
    ):  # fmt: skip
        assert told in why
    recording = _record(tmp_path / "run")
    trip = next(event for event in recording.events if event.kind == "trip")
    assert trip.data["rule"] == "R3"
    assert Phase.SAFING in recording.ticks.phase
    last = recording.ticks.time_s[
        (recording.ticks.time_s > trip.time_s - 2.0) & (recording.ticks.time_s < trip.time_s)
    ]
    assert len(last) == pytest.approx(2000, abs=2)  # every tick of the last two seconds
    force = recording.force.sequence[recording.force.receive_time_s > trip.time_s - 2.0]
    assert len(force) > 1900
    np.testing.assert_array_equal(np.diff(force), 1)
    assert [e.data["why"] for e in recording.events if e.kind == "end"] == [why]


@pytest.mark.parametrize(
    ("number", "times", "code"),
    [
        (signal.SIGINT, 1, 130),
        pytest.param(signal.SIGINT, 2, 130, marks=pytest.mark.long),
        pytest.param(signal.SIGINT, 3, 130, marks=pytest.mark.long),
        (signal.SIGTERM, 1, 143),
        pytest.param(signal.SIGHUP, 1, 129, marks=pytest.mark.long),
    ],
)
def test_signals_end_it_safely(
    stage: Stage, quick: Path, tmp_path: Path, number: int, times: int, code: int
) -> None:
    staged = stage(
        {"at": "HOLD 2", "wait": f"stop {times if number == signal.SIGINT else 2}"},
        "run", quick, "--dry-run", "--out", tmp_path / "run", "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    staged.signal(number, times)
    assert staged.finish()[0] == code
    found, recording = results(tmp_path / "run"), _record(tmp_path / "run")
    assert found["status"] == "interrupted"
    told = f"interrupted on the operator's request ({number.name})"
    assert told in found["why_it_ended"]
    names = [action["name"] for action in found["safing"]]
    assert "arm stop" in names
    assert "arm retract" in names or "The arm drew back" in found["why_it_ended"]
    phases = set(recording.ticks.phase.tolist())
    if (number, times) == (signal.SIGINT, 1):  # the step is finished first
        assert found["levels_done"] == 2
        assert Phase.SAFING not in phases
    elif times < 3:
        assert found["levels_done"] == 1
        assert Phase.SAFING in phases
    if times == 3:
        skipped = [a["name"] for a in found["safing"] if not a["sent"]]
        assert skipped == ["force sensor"]


def test_ctrl_z_does_not_leave_the_force_on(stage: Stage, quick: Path, tmp_path: Path) -> None:
    staged = stage(
        {"at": "HOLD 1", "wait": "stop 1"},
        "run", quick, "--dry-run", "--out", tmp_path / "run", "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    staged.process.send_signal(signal.SIGTSTP)
    staged.signal(signal.SIGINT)
    assert staged.finish()[0] == 130


def test_before_anything_moves_ctrl_c_ends_at_once(
    stage: Stage, quick: Path, tmp_path: Path
) -> None:
    """A device that hangs while it opens can be left; nothing was written."""
    staged = stage(
        {"break": {"force open": "hang"}},
        "run",
        quick,
        "--yes",
        "--out",
        tmp_path / "run",
        "--quiet",
    )
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "run").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.2)
    staged.process.send_signal(signal.SIGTERM)
    assert staged.finish()[0] == 143
    assert not (tmp_path / "run").exists()


def test_kill_9_is_repaired_at_the_next_start(stage: Stage, quick: Path, tmp_path: Path) -> None:
    first = tmp_path / "runs" / "first"
    staged = stage(
        {"at": "HOLD 3", "wait": "for ever"},
        "run", quick, "--dry-run", "--out", first, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    staged.process.kill()
    staged.process.wait()
    _wait_for_the_writer(first)
    done = in_process("run", quick, "--dry-run", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stdout.splitlines() if line.startswith("unfinished record")]
    assert len(told) == 1
    assert "repaired, marked partial" in told[0]
    assert "chord stiffness" in told[0]
    recording = _record(first, partial=True)
    assert recording.ticks.phase[-1] == Phase.LOAD  # it stood still before its first tick of HOLD
    assert recording.ticks.step[-1] == 3
    again = in_process("recover", tmp_path / "runs", "--json")
    assert (again.returncode, again.stdout.strip()) == (0, '{"records": []}')


def _wait_for_the_writer(directory: Path) -> None:
    """It outlives a run that was killed."""
    deadline = time.monotonic() + 60.0
    while is_being_written(directory / "run.mcap.part") and time.monotonic() < deadline:
        time.sleep(0.01)


def test_a_running_record_is_left_alone(stage: Stage, quick: Path, tmp_path: Path) -> None:
    directory = tmp_path / "runs" / "first"
    staged = stage(
        {"at": "HOLD 1", "wait": "stop 2"},
        "run", quick, "--dry-run", "--out", directory, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    found = in_process("recover", tmp_path / "runs")
    assert found.stdout.startswith("no unfinished record")
    assert (directory / "run.mcap.part").exists()
    refused = in_process("recover", directory / "run.mcap.part")
    assert refused.returncode == 2
    assert "is being written by a running experiment" in refused.stderr
    staged.signal(signal.SIGTERM)
    assert staged.finish()[0] == 143
    _record(directory)


def test_a_full_disk(stage: Stage, quick: Path, tmp_path: Path) -> None:
    """The writer's files may not grow any more: the run ends, the record is repaired later."""
    directory = tmp_path / "runs" / "full"
    staged = stage(
        {"at": "HOLD 1", "wait": "stop 1"},
        "run", quick, "--dry-run", "--out", directory, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    part = directory / "run.mcap.part"
    size = 0
    while size < (size := part.stat().st_size):  # until the writer has nothing left to write
        time.sleep(0.3)
    for task in Path(f"/proc/{staged.process.pid}/task").iterdir():
        for pid in (task / "children").read_text().split():
            resource.prlimit(int(pid), resource.RLIMIT_FSIZE, (size + 4096, size + 4096))
    staged.signal(signal.SIGINT)
    code, text = staged.finish()
    assert code == 4
    assert "File too large" in text
    assert str(directory / "run.mcap") in text
    assert "File too large" in results(directory)["reasons"][0]
    assert not part.exists()
    assert 1 in _record(directory, partial=True).ticks.step


def test_a_directory_that_is_deleted_during_the_run(
    stage: Stage, quick: Path, tmp_path: Path
) -> None:
    """It ends the run at once; all of the record, its end included, is written elsewhere."""
    directory = tmp_path / "runs" / "lost"
    staged = stage(
        {"at": "HOLD 1", "wait": f"gone {directory}"},
        "run", quick, "--dry-run", "--out", directory, "--quiet",
    )  # fmt: skip
    staged.wait_until_there()
    shutil.rmtree(directory)
    code, text = staged.finish()
    assert code == 4
    kept = directory.with_name("lost-rescued")
    assert str(kept / "run.mcap") in text
    assert not directory.exists()
    found = results(kept)
    assert found["cause"]["rule"] == "recorder"
    assert found["levels_done"] < 3
    assert "arm stop" in [action["name"] for action in found["safing"] if not action["error"]]
    recording = read_recording(kept / "run.mcap")
    assert not recording.damage
    assert {"tare", "touch", "trip", "end"} <= {event.kind for event in recording.events}
    np.testing.assert_array_equal(np.diff(recording.force.sequence), 1)
    assert len(recording.ticks.time_s) == found["lateness"]["ticks"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_directory(quick: Path, tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    done = in_process("run", quick, "--dry-run", "--quiet", "--out", closed)
    assert done.returncode == 2
    assert "Permission denied" in done.stderr


def test_a_sensor_that_hangs_in_real_time(stage: Stage, quick: Path, tmp_path: Path) -> None:
    """Its drain does not return: the arm is retracted from another thread, then it is left."""
    staged = stage(
        {"at": "HOLD 1", "break": {"force drain": "hang", "force safe": "hang"}},
        "run", quick, "--yes", "--out", tmp_path / "run", "--quiet",
    )  # fmt: skip
    code, text = staged.finish()
    assert code == 4
    found = results(tmp_path / "run")
    assert found["cause"]["rule"] == "hang"
    assert "held up by force sensor" in found["why_it_ended"]
    assert "STOPPED by hang" in text
    by_name = {action["name"]: action for action in found["safing"]}
    assert by_name["arm retract"]["error"] == by_name["arm stop"]["error"] == ""
    assert "no answer within" in by_name["force sensor"]["error"]
    _record(tmp_path / "run")
