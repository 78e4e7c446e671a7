"""A plan with touches on a circle through the command line: measured, gone on with, or refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from real_runs import ROOT, in_process

from stepload.engine.replay import replay_file
from stepload.errors import ExitCode
from stepload.record.reader import read_recording

PLAN = """\
stepload: 1
payload: payloads/silicone-sphere.yaml
rig:
  profile: ur5e
  force: {options: {port: none.tty}, rated_force: [500 N, 500 N, 1 kN]}
  arm: {options: {host: 127.0.10.1}, structure: machine}
  system_stiffness: {value: 1.2e5 N/m, sigma: 2e3 N/m, damping: 100 N s/m, msde: 20 µm}
  second_force: {source: arm, tolerance: 11 N, tolerance_relative: 3 %, time: 100 ms, noise: 1 N}
  simulation:
    mount: {tilt_y: TILT deg, friction: 0.1, coupling_x: 10 %}
procedure:
  step: 10 N
  top_force: 30 N
  hold: 1 s
  tare: 1 s
  warm_up: 0 s
  touches: 2
  cycles: 1
  unload: false
  surface_distance: 5 mm
  surface_uncertainty: 0.5 mm
  search_distance: 3 mm
  alignment: {}
"""


@pytest.mark.long  # of runs without a page: tests/unit/engine/test_align_runs.py
@pytest.mark.parametrize("tilt_deg", [0.0, 0.5, 2.0])
def test_the_tilt_is_told_in_record_results_and_report(tmp_path: Path, tilt_deg: float) -> None:
    path = tmp_path / "plan.yaml"
    text = PLAN.replace("payloads/", f"{ROOT}/procedures/payloads/")
    path.write_text(text.replace("TILT", f"{tilt_deg}"))
    out = tmp_path / "run"
    done = in_process("run", path, "--dry-run", "--out", out, drawn=tilt_deg == 0.5)
    recording = read_recording(out / "run.mcap")
    [tilt] = [event.data for event in recording.events if event.kind == "tilt"]
    assert abs(math.degrees(tilt["about_rad"][1]) - tilt_deg) < 2.0 * math.degrees(
        tilt["sigma_rad"]
    )
    page = (out / "report.html").read_text()
    if tilt_deg < 1.0:
        assert "three touches on a circle: the plate is tilted by" in page
        assert {"tilt", "circle_touch", "shift"} <= {e.kind for e in recording.events}
        assert done.returncode == 0, done.stdout
        assert replay_file(out / "run.mcap").replayed.cause is None
    else:
        assert done.returncode == ExitCode.STOPPED
        assert "Turn the tool, and the approach with it" in done.stdout + done.stderr
        assert "nothing was pressed: the run ended after touches" in page
        assert not [event for event in recording.events if event.kind == "held"]
