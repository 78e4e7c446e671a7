"""A fault under load in a whole run: it ends safe, with the reason in a record that can be read."""

from __future__ import annotations

import json

import pytest

from stepload import experiment
from stepload.cli.experiments import exit_code
from stepload.record.reader import read_recording
from stepload.record.rows import Phase
from stepload.run.loop import RunStatus

BOTA, RFT = "bota_serial", "robotous_can"
PRESSING_N = 4.0
FREE_N = 3.0
"""The emulated arm's own force channel is noisy."""

RETRACTED, STOPPED = "retracted", "stopped"
FAULTS = [
    (BOTA, "freeze on", RETRACTED, "no new"),
    (BOTA, "drop", RETRACTED, ""),
    (BOTA, "kill-program", RETRACTED, "arm: cannot follow"),
    (BOTA, "protective-stop", STOPPED, "arm: cannot follow"),
    (BOTA, "emergency-stop", STOPPED, "arm: cannot follow"),
    (BOTA, "bota_serial unplug", RETRACTED, "not_connected: serial port"),
    (BOTA, "bota_serial freeze", RETRACTED, "identical samples"),
    (BOTA, "bota_serial overrange:2", RETRACTED, "force"),
    (BOTA, "bota_serial noise:0.5", RETRACTED, "corrupt: Bota sensor"),
    (RFT, "robotous_can torn:0.5", RETRACTED, "corrupt: RFT sensor"),
]
"""What goes wrong, how the arm ends, and what the record must say of it. A dropped connection may
be seen first by the child's report, by its crash, or by a refused target."""


@pytest.fixture(autouse=True)
def no_drawing(monkeypatch):
    """The report is drawn in a test of its own."""
    monkeypatch.setattr(experiment, "compose", lambda findings: None)
    monkeypatch.setattr(experiment, "render", lambda page: "")


@pytest.mark.parametrize(("sensor", "fault", "end", "says"), FAULTS, ids=[row[1] for row in FAULTS])
def test_a_fault_under_load_ends_the_run_safely(emulated_run, tmp_path, sensor, fault, end, says):
    run = emulated_run(
        sensor=sensor, surface_distance_m=4e-4, levels_n=(15.0,), top_force_n=15.0,
        load_rate_n_per_s=30.0,
    )  # fmt: skip
    begun = []

    def spoil(engine, _check):
        row = engine.row
        if not begun and row.phase == Phase.LOAD and row.force_n > PRESSING_N:
            begun.append(run.rig.state()["position_m"])
            run.rig.command(fault)

    finished = experiment.run_plan(run.plan, dry_run=False, out=tmp_path, on_progress=spoil)
    outcome = finished.outcome
    assert begun, outcome.why
    assert outcome.status is RunStatus.STOPPED, outcome.why
    assert exit_code(finished) == 4
    stop = [action for action in outcome.safing if action.name == "arm stop"]
    assert stop[0].sent
    truth = run.rig.state()
    if end == RETRACTED:
        assert truth["position_m"] < begun[0] - 0.5e-3
        assert truth["force_n"] < FREE_N
    else:
        assert truth["position_m"] == pytest.approx(begun[0], abs=0.5e-3)
        assert not truth["moving"]
        assert any(action.error for action in outcome.safing), "a retract that failed unnoticed"
    recording = read_recording(tmp_path / "run.mcap")
    trips = [event for event in recording.events if event.kind == "trip"]
    assert len(trips) == 1
    assert says in trips[0].data["message"]
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["status"] == "stopped"
    assert trips[0].data["message"] in told["why_it_ended"]
