"""A run on a rig that is not what its plan says completes, and stays as gentle as on any other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from long_ones import long
from run_bench import bench_for, run, spec_for
from run_plans import stvf_plan

from stepload.record.rows import Phase

WORLDS: dict[str, dict[str, Any]] = {
    "what goes on with time": {
        "creep": 0.2, "creep_time_s": 0.3, "creep_decades": 1, "drift_m_s": 0.4e-6, "slip_m": 3e-6,
        "seating_m": 2.5e-6, "seating_force_n": 200.0,
    },
    "what is soft": {
        "pad_stiffness_n_per_m": 8e6, "pad_depth_m": 12e-6, "softness": 0.4, "stop_depth_m": 45e-6,
        "stop_stiffness_n_per_m": 5e6, "roughness_m": 7.5e-6, "yield_force_n": 100.0,
    },
    "what the sensor feels": {
        "adhesion_n": 1.5, "adhesion_law": "jkr", "lateral": 0.2, "cross_talk": 0.03,
        "sensor_quadratic": 0.01, "sensor_cubic": -0.01,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", ["what is soft", *long(sorted(set(WORLDS) - {"what is soft"}))])
def test_a_run_on_an_unkind_rig_completes(name: str) -> None:
    plan = stvf_plan(step_n=100.0, hold_s=0.3, touches=1, cycles=2)
    law = "declared" if "roughness_m" in WORLDS[name] else "smooth"
    simulation = replace(plan.rig.simulation, law=law, micro_hardness_pa=3.5e8, **WORLDS[name])
    plan = replace(plan, rig=replace(plan.rig, simulation=simulation))
    bench = bench_for(plan, spec=spec_for(plan))
    engine = run(bench, 60.0)
    assert engine.cause is None, engine.cause
    assert engine.course.phase == Phase.DONE
    assert [touch.purpose for touch in engine.course.touches] == ["first", "cycle", "last"]
    assert 290.0 < bench.peak_n < 340.0
