"""Dry runs of a material that is known as a range only, against truths at both ends of it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from long_ones import long
from run_bench import bench_for, run, spec_for
from run_plans import stvf_plan

from stepload.contact.material_range import softest, stiffest
from stepload.contact.materials import Material
from stepload.feasibility.theory import theory_of
from stepload.plan.model import Plan

F_C = 150.0
UNKNOWN = Material(
    "unknown", 1e9, 0.35, youngs_modulus_ends_pa=(1e8, 1e10), poisson_ratio_ends=(0.2, 0.5)
)


def plan_of_a_range() -> Plan:
    plan = stvf_plan(levels_n=(50.0, 100.0), top_force_n=100.0, hold_s=0.3, unload=False, touches=1)
    payload = replace(plan.payload, material=UNKNOWN, declared_force_limit_n=F_C)
    accepted = replace(plan.identify, accept_unidentifiable="a rehearsal")
    return replace(plan, payload=payload, identify=accepted)


@pytest.mark.parametrize("end", [*long([softest]), stiffest])
def test_truths_at_both_ends_are_pressed_below_f_c(end: object) -> None:
    plan = plan_of_a_range()
    theory = theory_of(plan.payload)
    true_law = theory.softest if end is softest else theory.stiffest
    spec = spec_for(plan)
    truth = replace(spec.payload, k=spec.payload.k * true_law.k / theory.law.k)
    bench = bench_for(plan, F_C, spec=replace(spec, payload=truth))
    engine = run(bench)
    assert truth.k == pytest.approx(true_law.k)
    assert truth.elastic_limit_n == F_C
    assert engine.cause is None
    assert 95.0 < bench.peak_n < bench.limits.force_limit_n < F_C
