"""Loop delay T against a spring: the plan's own run with small steps, fully supervised."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from stepload.engine.loop import run_loop
from stepload.engine.open_rig import OpenRig
from stepload.engine.operator import Operator
from stepload.engine.tick import Engine
from stepload.engine.watch import wrench_axis
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.feasibility.reason import PlanVerdict
from stepload.plan.model import Plan
from stepload.record.lag import Lag, measure_lag
from stepload.record.outcome import RunStatus
from stepload.record.rows import Phase, TickRow
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample
from stepload.setup.check_line import CheckLine, Mark, graded, without_number

STEPS = 4
RAMP_S = 1.0
HOLD_S = 0.5
CYCLES = 3
_IN_CONTACT = (Phase.LOAD, Phase.HOLD, Phase.UNLOAD, Phase.UNLOAD_HOLD)


class Memory:
    """Keeps what the measurement needs of a run (a `stepload.engine.interfaces.RecordSink`)."""

    def __init__(self) -> None:
        self.forces: list[ForceSample] = []
        self.ticks: list[TickRow] = []
        self.force: Callable[[ForceSample], None] = self.forces.append
        self.tick: Callable[[TickRow], None] = self.ticks.append
        self.second_force: Callable[[ForceSample], None] = self.event
        self.arm: Callable[[ArmSample], None] = self.event
        self.displacement: Callable[[DisplacementSample], None] = self.event

    def event(self, *_: object) -> None:
        """Not needed here."""

    def problem(self) -> str:
        return ""


def small_steps(plan: Plan) -> Plan:
    """The plan with a few load steps up to its top force, the first approach as it stands."""
    top_n = plan.procedure.top_force_n
    levels = tuple(top_n * (i + 1) / STEPS for i in range(STEPS))
    procedure = replace(
        plan.procedure, levels_n=levels, top_force_n=top_n, step_n=levels[0], hold_s=HOLD_S,
        load_rate_n_per_s=levels[0] / RAMP_S, unload=True, cycles=CYCLES, lift_off=False, touches=1,
        tare_s=min(plan.procedure.tare_s, 3.0), warm_up_s=0.0,
    )  # fmt: skip
    return replace(plan, procedure=procedure)


def force_lag(memory: Memory, axis: str) -> Lag:
    """Lag from a target to the force that the engine sees."""
    index, sign = wrench_axis(axis)
    tick_s = np.array([row.time_s for row in memory.ticks])
    target_m = np.array([row.target_m for row in memory.ticks])
    phase = np.array([row.phase for row in memory.ticks])
    time_s, first = np.unique(
        [sample.receive_time_s for sample in memory.forces], return_index=True
    )
    force_n = sign * np.array([sample.wrench[index] for sample in memory.forces])[first]
    known = np.isfinite(target_m)
    at = np.clip(np.searchsorted(tick_s, time_s) - 1, 0, len(tick_s) - 1)
    in_contact = np.isin(phase[at], _IN_CONTACT)
    target = np.interp(time_s, tick_s[known], target_m[known])
    return measure_lag(time_s, force_n, target, in_contact, max_lag_s=0.5)


def check_spring(
    preflight: Preflight, rig: OpenRig, operator: Operator
) -> tuple[CheckLine, float | None]:
    """T measured in contact against the plan's; an upper bound of the measured T in s.

    Raises:
        RefusedError: the plan with small steps is refused, or leaves no room below F_c.
    """
    name = "loop delay against a spring"
    plan = preflight.plan
    small = small_steps(plan)
    gentle = preflight_of(replace(small, identify=replace(small.identify, kind="system")))
    if gentle.verdict is PlanVerdict.REFUSED:
        reasons = "; ".join(r.message for r in gentle.reasons if r.severity == "refuse")
        return without_number(name, Mark.FAIL, f"refused: {reasons}",
                              "see `stepload preflight`", "s"), None  # fmt: skip
    memory = Memory()
    operator.moving = True
    try:
        engine = Engine(gentle, operator)
        outcome = run_loop(engine, rig, memory, identities=rig.identities)
    finally:
        operator.moving = False
    if outcome.status is not RunStatus.COMPLETED:
        return without_number(name, Mark.FAIL, outcome.why, "see why", "s"), None
    lag = force_lag(memory, plan.rig.force.axis)
    if not math.isfinite(lag.lag_s):
        return without_number(name, Mark.FAIL, f"not measured: {lag.how}",
                              "press a linear spring of about the payload's stiffness",
                              "s"), None  # fmt: skip
    period_s = rig.arm.period_s
    loop_s = lag.lag_s + period_s
    planned_s = preflight.bounds.loop_s
    slack_s = 2.0 * lag.sigma_s
    return graded(
        name, loop_s, "s", warn=planned_s + slack_s, fail=1.3 * planned_s + slack_s,
        message=f"± {lag.sigma_s * 1e3:.1f} ms from a target to the force that answers, and one "
        "tick; the plan's T",
        remedy="state the measured T as rig.loop_delay",
    ), loop_s + slack_s  # fmt: skip
