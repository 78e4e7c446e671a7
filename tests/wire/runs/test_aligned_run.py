"""Touches on a circle before a run, through the real UR driver, in a world with six axes."""

from __future__ import annotations

import math

import pytest

from stepload.feasibility.preflight import preflight_of
from stepload.plan.model import Alignment
from stepload.record.outcome import RunStatus
from stepload.record.reader import read_recording
from stepload.rig.mount import Mount
from stepload.session.experiment import run_plan

ALIGNMENT = Alignment(radius_m=3e-3, max_tilt_rad=math.radians(2.0))


@pytest.mark.long
@pytest.mark.parametrize("tilt_deg", [0.5, 3.0])
def test_a_tilted_plate_is_told_on_the_wire(emulated_run, tmp_path, tilt_deg):
    c = 1.0 / 1.2e5
    run = emulated_run(
        world={
            "mount": Mount(
                compliance_m_per_n=(
                    (0.8 * c, 0.0, 0.2 * c), (0.0, 0.8 * c, 0.0), (0.2 * c, 0.0, c),
                ),
                friction_static=0.1,
                friction_kinetic=0.1,
                plate_tilt_rad=(0.0, math.radians(tilt_deg)),
            ),
            "position_quantum_m": 1e-6, "kinematic_error_m": 0.0, "lost_motion_m": 0.0,
        },
        elastic_limit_n=600.0, alignment=ALIGNMENT, surface_distance_m=1.2e-3,
        surface_uncertainty_m=1e-4, search_distance_m=1.5e-3,
    )  # fmt: skip
    preflight = preflight_of(run.plan)
    assert preflight.verdict != "refused", preflight.reasons
    finished = run_plan(preflight, dry_run=False, out=tmp_path)
    [tilt] = [e.data for e in read_recording(tmp_path / "run.mcap").events if e.kind == "tilt"]
    found_deg = [math.degrees(part) for part in tilt["about_rad"]]
    assert found_deg == pytest.approx([0.0, tilt_deg], abs=0.6)
    if tilt_deg < 2.0:
        assert finished.outcome.status is RunStatus.COMPLETED, finished.outcome.why
        assert "three touches on a circle" in (tmp_path / "report.html").read_text()
    else:
        assert finished.outcome.cause is not None
        assert finished.outcome.cause.rule == "tilted"
        assert finished.outcome.levels_done == 0
        assert finished.outcome.retracted
