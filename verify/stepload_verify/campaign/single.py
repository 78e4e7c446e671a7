"""Executes one scenario through the same loop as every run, and records the true force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

from stepload.engine.loop import run_loop
from stepload.engine.operator import Operator
from stepload.engine.tick import Engine
from stepload.errors import BadInputError, DeviceError
from stepload.jobs.pool import interruptible
from stepload.plan.compose import SIMULATED
from stepload.record.outcome import RunOutcome
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import SimulatedRig, WorldView, load_world
from stepload_verify.campaign.ablation import Ablation, ends_in_time
from stepload_verify.campaign.incidents import FailingOperator, Killed, NullRecorder, install
from stepload_verify.campaign.result import KILLED, NOT_OPENED, Result
from stepload_verify.campaign.scenario import Scenario

AFTERWARDS_S = 0.5
"""Time for which the rig is simulated after the program has finished."""
KILLED_AFTERWARDS_S = 2.0
OPEN_TIMEOUT_S = 2.0
_world = cache(load_world)


def run_scenario(
    scenario: Scenario,
    ablation: Ablation | None = None,
    on_tick: Callable[[TickRow], None] | None = None,
    on_begin: Callable[[Engine, WorldView], None] | None = None,
    world: str = SIMULATED,
) -> tuple[Result, RunOutcome | None]:
    """Run it to its end; the outcome is None where the devices did not open.

    The true peak force is that of the whole time, also while and after the rig is made safe.
    `on_begin` is given the engine and the world before the run begins, `on_tick` every tick.

    Raises:
        KeyboardInterrupt: Ctrl+C came, which the engine took for a fault: there is no result.
    """
    with interruptible():
        return _run(scenario, ablation, on_tick, on_begin, world)


def _run(
    scenario: Scenario,
    ablation: Ablation | None,
    on_tick: Callable[[TickRow], None] | None,
    on_begin: Callable[[Engine, WorldView], None] | None,
    world: str,
) -> tuple[Result, RunOutcome | None]:
    rig = _world(world)(scenario.truth)
    clock, truth = rig.clock, rig.world
    if truth is None:
        raise BadInputError(f"the world {world} does not tell the true force")
    try:
        _open(rig)
    except DeviceError as error:
        return _result(scenario, rig, truth, None, "open", error.message), None
    operator = FailingOperator() if scenario.incidents else Operator()
    engine, on_progress = _engine(scenario, ablation, operator)
    if on_begin:
        on_begin(engine, truth)
    course = engine.course
    recorder = NullRecorder(on_tick) if on_tick else NullRecorder()
    used = install(scenario.incidents, rig, engine, operator, recorder)
    outcome = run_loop(engine, rig, used, on_progress=on_progress)
    killed = any(error.startswith(Killed.__name__) for error in outcome.errors)
    clock.sleep_until(clock.now_s() + (KILLED_AFTERWARDS_S if killed else AFTERWARDS_S))
    phase = Phase(course.phase).name
    if killed:
        found = _result(scenario, rig, truth, None, KILLED, "", phase)
    else:
        found = _result(scenario, rig, truth, outcome, "", "", phase)
    return replace(found, levels_missed=recorder.levels_missed), outcome


def _engine(
    scenario: Scenario, ablation: Ablation | None, operator: Operator
) -> tuple[Engine, Callable[[Engine], None] | None]:
    """The engine of a run, without the omitted layer; such a run has a time limit."""
    preflight = scenario.preflight
    if ablation is None:
        return Engine(preflight, operator), None
    reduced = replace(preflight, limits=ablation.limits(scenario.limits))
    engine = Engine(reduced, operator, found=ablation.found, controller=ablation.controller)
    return engine, ends_in_time


def _open(rig: SimulatedRig) -> None:
    for device in (rig.force, rig.second_force, rig.displacement, rig.arm):
        if device is not None:
            device.open(OPEN_TIMEOUT_S)


def _result(
    scenario: Scenario,
    rig: SimulatedRig,
    truth: WorldView,
    outcome: RunOutcome | None,
    rule: str,
    message: str,
    phase: str = "",
) -> Result:
    status = {"open": NOT_OPENED, KILLED: KILLED}.get(rule, "")
    stop_s = end_s = rig.clock.now_s()
    if outcome is not None:
        status, end_s = outcome.status.value, outcome.end_s
        if (cause := outcome.cause) is not None:
            rule, message, stop_s = cause.rule, cause.message, cause.time_s
    wrong, starts = scenario.wrong, [fault.start_s for fault in scenario.faults]
    detection_s = stop_s - min(starts) if len(wrong) == 1 and starts and rule else None
    six = scenario.truth.mount is not None
    return Result(
        series=scenario.series,
        index=scenario.index,
        rig_class=scenario.rig_class,
        healthy=scenario.healthy,
        wrong=wrong,
        beside=tuple(a.kind for a in scenario.anomalies if a.kind not in wrong),
        hazard=scenario.hazard,
        rule=rule,
        message=message,
        phase=phase,
        status=status,
        stop_s=round(stop_s, 6),
        detection_s=None if detection_s is None else round(detection_s, 6),
        end_s=round(end_s, 6),
        peak_n=truth.true_peak_equivalent_n if six else truth.true_peak_force_n,
        elastic_limit_n=scenario.limits.used_limit_n,
        top_n=scenario.plan.procedure.top_force_n,
        resultant_n=truth.true_peak_force_n if six else None,
    )
