"""Both force channels read too little together: no check sees it, so the ladder leaves room."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from long_ones import long_rows
from run_bench import bench_for, run, run_to, spec_for
from run_plans import preflight_for, stvf_plan

from stepload.plan.model import Plan
from stepload.record.rows import Phase
from stepload.rig.world import WorldFault

F_C = 300.0
NEAR = {
    "hold_s": 0.3, "unload": False, "touches": 1, "surface_distance_m": 1e-3,
    "surface_uncertainty_m": 2e-4,
}  # fmt: skip


def plan_at_the_limit(common: float) -> Plan:
    """As hard as preflight lets it press, with channels that are checked to 1 N."""
    plan = stvf_plan(**NEAR, levels_n=(100.0, 200.0), top_force_n=200.0)
    second = replace(plan.rig.second_force, tolerance_n=5.0, tolerance_relative=0.0)
    plan = replace(plan, rig=replace(plan.rig, second_force=second, common_force_error=common))
    top_n = preflight_for(plan, F_C).largest_safe_force_n - 0.1
    procedure = replace(plan.procedure, levels_n=(0.5 * top_n, top_n), top_force_n=top_n)
    return replace(plan, procedure=procedure)


@pytest.mark.parametrize(
    ("common", "safe"), [(0.05, True), pytest.param(0.0, False, marks=pytest.mark.long)]
)
def test_channels_that_are_five_per_cent_low_together_stay_below_f_c(
    common: float, safe: bool
) -> None:
    plan = plan_at_the_limit(common)
    low = [WorldFault(kind, 0.0, math.inf, 0.95) for kind in ("force_gain", "arm_force_gain")]
    bench = bench_for(plan, F_C, spec=spec_for(plan, faults=low))
    engine = run(bench)
    assert engine.cause is None  # nothing can see it
    assert (bench.peak_n < F_C) is safe


@pytest.mark.parametrize(
    ("common", "tolerance_n", "offset_n"),
    [(0.05, 40.0, -19.5), *long_rows([(0.1, 40.0, 0.0), (0.05, 20.0, -9.8)])],
)
def test_what_the_cross_check_lets_pass_comes_on_top_of_what_the_second_channel_may_lack(
    common: float, tolerance_n: float, offset_n: float
) -> None:
    """The main channel reads as much less than the second one as R5 lets pass, and that one reads
    too little by the share in common and by what is accepted of its zero."""
    plan = stvf_plan(**NEAR, levels_n=(100.0, 110.0), top_force_n=110.0)
    second = replace(
        plan.rig.second_force, tolerance_n=tolerance_n, tolerance_relative=0.0, noise_n=0.05,
        zero_error_n=None,
    )  # fmt: skip
    force = replace(plan.rig.force, noise_n=0.02)
    rig = replace(plan.rig, second_force=second, force=force, common_force_error=common)
    plan = replace(plan, rig=rig)
    top_n = preflight_for(plan, F_C).largest_safe_force_n - 0.1
    procedure = replace(
        plan.procedure, levels_n=(top_n - 5.0, top_n), top_force_n=top_n, step_n=5.0
    )
    plan = replace(plan, procedure=procedure)
    second_reads_n = (1.0 - common) * F_C + offset_n
    wrong = [
        WorldFault("force_gain", 0.0, math.inf, (second_reads_n - tolerance_n + 0.5) / F_C),
        WorldFault("arm_force_gain", 0.0, math.inf, 1.0 - common),
    ]
    looked_s = run_to(bench_for(plan, F_C, spec_for(plan, faults=wrong)), Phase.FAST_APPROACH, 0)
    wrong.append(WorldFault("arm_force_bias", looked_s, math.inf, offset_n))
    bench = bench_for(plan, F_C, spec=spec_for(plan, faults=wrong))
    engine = run(bench)
    assert engine.cause is None
    assert 0.9 * F_C < bench.peak_n < F_C
