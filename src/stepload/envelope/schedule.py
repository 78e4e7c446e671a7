"""How long a plan takes, phase by phase, before anything moves: plans are data."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.plan.model import Procedure

RISE_TIME_CONSTANTS = 4.6
"""After its ramp a step closes to 1 % of itself in ln(100) time constants 1/λ."""
LOOK_S = 0.2
"""Looks at the force before and after backing off, to prove free air."""
DRIFT_CHECK_S = 0.5
REST_S = 0.3
"""Rest after a retract, and ringing after a touch."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One line of the schedule; `repeats` times `each_s`."""

    name: str
    each_s: float
    repeats: int

    @property
    def total_s(self) -> float:
        """Time of all repeats together."""
        return self.each_s * self.repeats


def schedule(
    procedure: Procedure,
    *,
    fast_speed_m_s: float,
    guarded_speed_m_s: float,
    retract_speed_m_s: float,
    step_rate_per_s: float,
    shake_s: float = 0.0,
) -> tuple[Stage, ...]:
    """Expected stages of a run that meets no trouble.

    Args:
        procedure: the plan's steps.
        fast_speed_m_s, guarded_speed_m_s, retract_speed_m_s: approach and retract speeds.
        step_rate_per_s: λ of the step controller.
        shake_s: time of the shake that proves the force channels; 0 without one.
    """
    levels = procedure.levels_n
    band_m = procedure.surface_uncertainty_m
    clear_m = max(procedure.surface_distance_m - band_m, 0.0)
    ramp_s = levels[-1] / len(levels) / procedure.load_rate_n_per_s
    step_s = ramp_s + RISE_TIME_CONSTANTS / step_rate_per_s + procedure.hold_s
    gap_m = min(procedure.retract_m, 0.3 * guarded_speed_m_s)
    touch_s = gap_m / retract_speed_m_s + 2.0 * gap_m / guarded_speed_m_s + 2.0 * REST_S
    part_s = procedure.retract_m / retract_speed_m_s + gap_m / guarded_speed_m_s + 2.0 * REST_S
    free_s = 2.0 * LOOK_S + REST_S + procedure.retract_m / retract_speed_m_s
    unload_steps = len(levels) - 1 if procedure.unload else 0
    stages = [
        Stage("warm up", procedure.warm_up_s, 1),
        Stage("prove free air", free_s, 1),
        Stage("tare and drift check", procedure.tare_s + DRIFT_CHECK_S, 1),
        Stage("prove the force channels", shake_s, 1),
        Stage("fast approach", clear_m / fast_speed_m_s, 1),
        Stage("guarded approach", band_m / guarded_speed_m_s + REST_S, 1),
        Stage("touch again", touch_s, procedure.touches - 1),
        Stage("load step with hold", step_s, len(levels) * procedure.cycles),
        Stage("unload step with hold", step_s, unload_steps * procedure.cycles),
    ]
    if procedure.cycles > 1:
        name = "part and touch between cycles" if procedure.lift_off else "unload between cycles"
        stages.append(Stage(name, part_s if procedure.lift_off else step_s, procedure.cycles - 1))
    stages.append(Stage("retract, second tare, last touch", procedure.tare_s + part_s, 1))
    return tuple(stage for stage in stages if stage.total_s > 0.0)
