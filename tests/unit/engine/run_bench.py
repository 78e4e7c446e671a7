"""Runs an engine on the simulated rig in virtual time, without a recorder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from run_plans import preflight_for

from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.preflight import derive
from stepload.plan.model import Plan
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import SimulatedRig, WorldFault, WorldSpec, load_world


@dataclass
class Bench:
    plan: Plan
    limits: RunLimits
    rig: SimulatedRig
    engine: Engine
    operator: Operator
    ticks: int = 0

    @property
    def peak_n(self) -> float:
        return self.rig.world.true_peak_force_n


def spec_for(
    plan: Plan, seed: int = 1, faults: Iterable[WorldFault] = (), **changes: Any
) -> WorldSpec:
    return replace(world_for(derive(plan), seed=seed, faults=faults), **changes)


def bench_for(
    plan: Plan, elastic_limit_n: float = 727.0, spec: WorldSpec | None = None, **engine: Any
) -> Bench:
    operator = Operator()
    rig = load_world()(spec or spec_for(plan))
    preflight = preflight_for(plan, elastic_limit_n)
    return Bench(plan, preflight.run_limits, rig, Engine(preflight, operator, **engine), operator)


def run(bench: Bench, until_s: float = 600.0, rows: list[TickRow] | None = None) -> Engine:
    rig, engine = bench.rig, bench.engine
    rig.arm.open(1.0)
    rig.force.open(1.0)
    second = rig.second_force
    if second:
        second.open(1.0)
    now_s = rig.clock.now_s()
    period_s = rig.arm.period_s
    end_s = now_s + until_s
    done = False
    while not done and now_s < end_s:
        target_m, done = engine.tick(
            now_s, rig.force.drain(), rig.arm.drain(), (), second.drain() if second else ()
        )
        if target_m == target_m:
            rig.arm.command(target_m, engine.shift_m)
        else:
            engine.course.held_m = rig.arm.held_m()
        if rows is not None and engine.row is not None:
            rows.append(engine.row)
        bench.ticks += 1
        rig.clock.sleep_until(now_s + period_s)
        now_s = rig.clock.now_s()
    return engine


def run_to(bench: Bench, phase: Phase, step: int) -> float:
    """Run to the first tick of a phase and step; the time there."""
    course = bench.engine.course
    rows: list[TickRow] = []
    while (course.phase, course.step_number) != (phase, step):
        run(bench, 0.05, rows)
    return next(row.time_s for row in rows if (row.phase, row.step) == (phase, step))
