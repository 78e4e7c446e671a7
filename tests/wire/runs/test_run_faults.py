"""Each fault of `fault_table` in a whole run: it ends safe, with the reason in its record.

The runs of the rows that are not `always` are marked `long`: `make wire` runs the whole table.
"""

from __future__ import annotations

import json
import os
import re
import signal
import threading
import time
from collections import Counter
from pathlib import Path

import pytest
from fault_table import BOTA, HELD, REFUSED, RETRACTED, ROWS, UNHARMED

from stepload.cli.run import exit_code
from stepload.engine import open_rig, safe_end
from stepload.errors import DeviceError
from stepload.feasibility.preflight import preflight_of
from stepload.record.outcome import RunStatus
from stepload.record.reader import read_recording
from stepload.record.rows import Phase
from stepload.rig.faults import FaultCode
from stepload.session import experiment, files
from stepload_drivers.ur.arm import UrArm

ELASTIC_LIMIT_N = 60.0
TOP_N, SOUND_TOP_N = 15.0, 10.0
PRESSING_N = 2.5
FREE_N = 0.5
WATCHDOG_S = 3.0
RISE_N = 2.0
"""The arm still follows the targets that were under way when the fault began."""


@pytest.fixture(autouse=True)
def no_drawing(monkeypatch):
    """The report is drawn in a test of its own."""
    monkeypatch.setattr(experiment, "run_document", lambda findings: None)
    monkeypatch.setattr(files, "render", lambda page: "")


@pytest.fixture(autouse=True)
def little_patience(monkeypatch):
    """A controller that stays away would be tried for two minutes."""
    monkeypatch.setattr(safe_end, "PATIENCE_S", 2.0)


@pytest.fixture
def health(monkeypatch):
    """What each device's health said last, by role."""
    told = {}
    close = open_rig._close

    def look_and_close(role, device, errors):
        told[role] = device.health()
        close(role, device, errors)

    monkeypatch.setattr(open_rig, "_close", look_and_close)
    return told


def kill_ur_rtde():
    """SIGKILL to the child in which ur_rtde lives."""
    for task in Path("/proc/self/task").iterdir():
        for pid in (task / "children").read_text().split():
            if b"stepload_drivers.ur.child" in Path(f"/proc/{pid}/cmdline").read_bytes():
                os.kill(int(pid), signal.SIGKILL)


def give(rig, command):
    if command == "host kill":
        kill_ur_rtde()
    else:
        rig.command(command)


class Spoiler:
    """Calls `spoil` once, when the arm presses; keeps the emulator's truth and time of then."""

    def __init__(self, run, spoil):
        self.run, self.spoil = run, spoil
        self.before = self.since_s = None

    def __call__(self, engine, _check):
        row = engine.row
        if self.before is None and row.phase == Phase.LOAD and row.force_n > PRESSING_N:
            self.before, self.since_s = self.run.rig.state(), row.time_s
            self.spoil()


def at_rest(rig):
    """The truth once no motion is under way: where nobody can stop the arm its watchdog does."""
    give_up_s = time.monotonic() + WATCHDOG_S
    while (truth := rig.state())["moving"] and time.monotonic() < give_up_s:
        time.sleep(0.05)
    return truth


def counted(health, name):
    role = "arm" if name.startswith("arm ") else "force_sensor"
    name = name.removeprefix("arm ")
    return health[role].lost if name == "lost" else health[role].errors.get(name, 0)


def note(request, text):
    """A line for the table that the session ends with (see conftest.py)."""
    request.node.user_properties.append(("outcome", text))


def names():
    seen = Counter(row.name for row in ROWS)
    assert max(seen.values()) == 1, seen.most_common(3)
    return [row.name for row in ROWS]


def marked(row):
    return pytest.param(row, marks=() if row.always else (pytest.mark.long,))


@pytest.mark.parametrize("row", [marked(row) for row in ROWS], ids=names())
def test_a_fault_in_a_run_ends_safely(emulated_run, tmp_path, health, request, row):
    top_n = SOUND_TOP_N if row.end == UNHARMED else TOP_N
    run = emulated_run(
        sensor=row.sensor, elastic_limit_n=ELASTIC_LIMIT_N, levels_n=(top_n,), top_force_n=top_n,
        **row.rig,
    )  # fmt: skip
    if row.at_start:
        for command in row.commands:
            give(run.rig, command)
    if row.end == REFUSED:
        with pytest.raises(DeviceError) as caught:
            experiment.run_plan(preflight_of(run.plan), dry_run=False, out=tmp_path / "run")
        assert re.search(row.says, f"{caught.value.code}: {caught.value}"), caught.value
        assert not (tmp_path / "run").exists()
        truth = run.rig.state()
        assert truth["uploads"] == 0
        assert truth["peak_n"] == 0.0
        note(request, f"refused: {caught.value.code}")
        return
    commands = () if row.at_start else row.commands
    spoiler = Spoiler(run, lambda: [give(run.rig, command) for command in commands])
    finished = experiment.run_plan(
        preflight_of(run.plan), dry_run=False, out=tmp_path, on_progress=spoiler
    )
    outcome, truth = finished.outcome, at_rest(run.rig)
    cause = outcome.cause
    why = f"lost {health['force_sensor'].lost}"
    if cause:
        late = f"after {(cause.time_s - spoiler.since_s) * 1e3:.0f} ms, " if spoiler.since_s else ""
        why = f"{late}{cause.rule} {cause.message}"
    note(request, f"{outcome.status}, peak/F_c {truth['peak_n'] / ELASTIC_LIMIT_N:.2f}, {why}")
    assert row.at_start or spoiler.before, outcome.why
    assert truth["peak_n"] < ELASTIC_LIMIT_N
    assert not truth["moving"]
    stop = [action for action in outcome.safing if action.name == "arm stop"]
    assert stop[0].sent
    told = json.loads((tmp_path / "results.json").read_text())
    trips = [e for e in read_recording(tmp_path / "run.mcap").events if e.kind == "trip"]
    if row.end == HELD:
        assert truth["contact_n"] < spoiler.before["contact_n"] + RISE_N
        assert truth["peak_n"] < spoiler.before["peak_n"] + RISE_N
        assert any(action.error for action in outcome.safing), "a retract that failed unnoticed"
    else:
        assert truth["contact_n"] < FREE_N, outcome.why
    if row.end == UNHARMED:
        assert outcome.status is RunStatus.COMPLETED, outcome.why
        assert exit_code(finished) == 0
        assert trips == []
        assert not row.counted or counted(health, row.counted) > 0, health
        return
    assert row.end in (RETRACTED, HELD)
    assert outcome.status is RunStatus.STOPPED, outcome.why
    assert exit_code(finished) == 4
    assert re.search(row.says, f"{cause.rule} {cause.message}"), outcome.why
    [trip] = trips
    assert cause.message.startswith(trip.data["message"])
    assert told["status"] == "stopped"
    assert cause.message in told["why_it_ended"]


@pytest.mark.long
def test_a_second_program_is_refused_and_the_run_goes_on(emulated_run, tmp_path):
    run = emulated_run(
        sensor=BOTA, elastic_limit_n=ELASTIC_LIMIT_N, levels_n=(SOUND_TOP_N,),
        top_force_n=SOUND_TOP_N,
    )  # fmt: skip
    refused = []

    def intrude():
        other = UrArm(**run.plan.rig.arm.options)
        try:
            other.open(5.0)
        except DeviceError as error:
            refused.append(error.code)
        finally:
            other.close()

    intruder = threading.Thread(target=intrude)
    spoiler = Spoiler(run, intruder.start)
    finished = experiment.run_plan(
        preflight_of(run.plan), dry_run=False, out=tmp_path, on_progress=spoiler
    )
    intruder.join()
    assert refused == [FaultCode.REFUSED_COMMAND]
    assert finished.outcome.status is RunStatus.COMPLETED, finished.outcome.why
    assert run.rig.state()["uploads"] == 1


@pytest.mark.long
def test_a_zero_is_not_taken_where_the_arm_touches_already(emulated_run, tmp_path):
    run = emulated_run(elastic_limit_n=ELASTIC_LIMIT_N, world={"surface_m": -1e-4})
    finished = experiment.run_plan(preflight_of(run.plan), dry_run=False, out=tmp_path)
    assert finished.outcome.status is RunStatus.STOPPED
    assert finished.outcome.cause.rule == "not_free"
    truth = run.rig.state()
    assert truth["contact_n"] == 0.0
    assert truth["peak_n"] < 2.0
