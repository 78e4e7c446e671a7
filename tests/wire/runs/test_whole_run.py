"""A whole plan through real drivers, from preflight to report, and what it says about time."""

from __future__ import annotations

import json

import pytest

from stepload.feasibility.preflight import preflight_of
from stepload.record.outcome import RunStatus
from stepload.record.reader import read_recording
from stepload.session.experiment import run_plan

LATE_S = 0.02


@pytest.mark.long
def test_a_late_force_sensor_is_measured_corrected_and_told(emulated_run, tmp_path):
    """The sensor's frames come 20 ms late, which its own clock does not show."""
    run = emulated_run(
        world={
            "position_quantum_m": 1e-7, "position_noise_m": 1e-7, "kinematic_error_m": 0.0,
            "lost_motion_m": 0.0,
        },
        faults=(f"bota_serial=late:{LATE_S}",),
        levels_n=(12.0, 24.0, 36.0), top_force_n=36.0, hold_s=0.3,
    )  # fmt: skip
    finished = run_plan(preflight_of(run.plan), dry_run=False, out=tmp_path)
    assert finished.outcome.status is RunStatus.COMPLETED, finished.outcome.why
    data = json.loads((tmp_path / "results.json").read_text())
    clocks = {clock["channel"]: clock for clock in data["measured"]["clocks"]}
    for channel in ("force", "arm"):
        assert clocks[channel]["how"] == "device clock"
        assert 0.0 < clocks[channel]["residual_median_us"] < clocks[channel]["residual_p99_us"]
    measured = data["measured"]
    assert measured["lag_s"] == pytest.approx(LATE_S, abs=4.0 * measured["lag_sigma_s"] + 2e-3)
    assert measured["lag_corrected_s"] == measured["lag_s"]
    page = (tmp_path / "report.html").read_text()
    assert "device clock" in page
    assert "ms corrected" in page
    recording = read_recording(tmp_path / "run.mcap")
    assert len(recording.force.receive_time_s) > 2000
    assert data["lateness"]["ticks"] == len(recording.ticks.time_s)
