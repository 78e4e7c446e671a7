"""The schedule that preflight prints, beside what a dry run takes."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest
from long_ones import long
from run_bench import Bench, bench_for, run, spec_for
from run_plans import envelope_for, stvf_plan

from stepload.engine.operator import Operator
from stepload.engine.tick import Engine
from stepload.envelope.envelope import derive
from stepload.envelope.order import Order
from stepload.envelope.unwritten import plan_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, SecondForce
from stepload.plan.shipped import payload_folder, plan_path
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import load_world

QUICK = {"touches": 2, "tare_s": 0.5, "hold_s": 0.5, "top_force_n": 100.0}
BAND = (0.85, 1.2)
"""Time of the run over the time told. How a level creeps beyond its hold is not known before."""


@pytest.mark.parametrize(
    "procedure",
    [
        {"cycles": 1, "retract_m": 3e-3},
        {"cycles": 3, "retract_m": 2e-3, "unload": False},
        {"cycles": 2, "lift_off": False},
    ],
    ids=["far retract", "lift-off", "in contact"],
)
def test_a_dry_run_takes_the_time_that_was_told(procedure: dict[str, Any]) -> None:
    plan = stvf_plan(**(QUICK | procedure))
    bench = bench_for(plan, 727.0)
    engine = run(bench)
    assert engine.course.done
    took_s = bench.ticks * bench.rig.arm.period_s
    assert BAND[0] < took_s / envelope_for(plan, 727.0).duration_s < BAND[1]


@pytest.fixture(scope="module")
def soft_arm(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A UR5e whose K_s is known to 1 %, with a table."""
    rig = tmp_path_factory.mktemp("rig") / "known.yaml"
    rig.write_text(
        "profile: ur5e\narm: {driver: sim, options: {}}\nforce: {driver: sim, options: {}}\n"
        "system_stiffness: {value: 1.2e5 N/m, sigma: 1.2e3 N/m, stuck_ratio: 1, msde: 20 um,"
        " damping: 0 N s/m,"
        " provenance: measured}\n"
    )
    return str(rig)


def pressed_s(plan: Plan, seed: int = 1) -> tuple[float, float]:
    """Time of a whole dry run, and of its longest way up to a level."""
    rig, envelope, operator = load_world()(spec_for(plan, seed)), derive(plan), Operator()
    rows: list[TickRow] = []
    bench = Bench(plan, envelope.run_limits, rig, Engine(envelope, operator), operator)
    assert run(bench, 1500.0, rows).course.done
    up = Counter((row.cycle, row.step) for row in rows if row.phase == Phase.LOAD)
    return bench.ticks * rig.arm.period_s, max(up.values()) * rig.arm.period_s


@pytest.mark.long
def test_a_soft_payload_on_a_soft_arm_takes_the_time_that_was_told(soft_arm: str) -> None:
    """Near F_lim the speed that a hidden hard stop allows is what a step lasts."""
    silicone = payload_folder() / "silicone-sphere.yaml"
    plan = plan_of(soft_arm, silicone, 71.2, Order(4, 3.0, 1.0))
    took_s, longest_s = pressed_s(plan)
    envelope = derive(plan)
    assert envelope.climbs is not None
    assert took_s == pytest.approx(envelope.duration_s, rel=0.1)
    assert longest_s == pytest.approx(max(envelope.climbs.up_s), rel=0.15)
    assert longest_s > 5.0


@pytest.mark.parametrize(
    "name",
    [
        "campaign",
        *long(("plastic-sphere", "ur5e-silicone-sphere")),
    ],
)
def test_a_shipped_plan_takes_the_time_that_preflight_prints(name: str) -> None:
    plan = load_plan(plan_path(name))
    assert pressed_s(plan)[0] == pytest.approx(derive(plan).duration_s, rel=0.1)


def test_an_arm_that_stops_for_each_answer_takes_its_time_for_it() -> None:
    """With one channel it stands until no reading is from before."""
    plan = stvf_plan()
    alone = replace(plan, rig=replace(plan.rig, second_force=SecondForce()))
    two, one = (derive(each) for each in (plan, alone))
    assert two.climbs is not None
    assert one.climbs is not None
    limits = one.run_limits
    low_n, top_n = plan.procedure.levels_n[-2:]
    halves = 2.0 * (top_n - low_n) / (limits.force_limit_n - low_n)
    assert one.climbs.up_s[-1] > halves * limits.unseen_s > 0.0
    assert one.climbs.up_s[-1] > two.climbs.up_s[-1]
