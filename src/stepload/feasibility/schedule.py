"""How long a plan takes, phase by phase, before anything moves: plans are data."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.plan.model import Procedure

SETTLE_WINDOW_S = 1.1
"""The settling test looks at 1 s of data and must hold for 0.1 s."""
RISE_TIME_CONSTANTS = 4.6
"""A step closes to 1 % of itself in ln(100) time constants 1/λ."""


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
) -> tuple[Stage, ...]:
    """Expected stages of a run that meets no trouble.

    Args:
        procedure: the plan's steps.
        fast_speed_m_s, guarded_speed_m_s, retract_speed_m_s: approach and retract speeds.
        step_rate_per_s: λ of the step controller.
    """
    clear_m = max(procedure.surface_distance_m - procedure.surface_uncertainty_m, 0.0)
    step_s = RISE_TIME_CONSTANTS / step_rate_per_s + SETTLE_WINDOW_S + procedure.hold_s
    levels = len(procedure.levels_n)
    stages = [
        Stage("warm up", procedure.warm_up_s, 1),
        Stage("tare and drift check", procedure.tare_s, 2),
        Stage("fast approach", clear_m / fast_speed_m_s, 1),
        Stage("guarded approach", procedure.surface_uncertainty_m / guarded_speed_m_s, 1),
        Stage(
            "touch again",
            procedure.retract_m / retract_speed_m_s + procedure.retract_m / guarded_speed_m_s,
            procedure.touches - 1,
        ),
        Stage("load step with hold", step_s, levels * procedure.cycles),
    ]
    if procedure.unload:
        stages.append(Stage("unload step with hold", step_s, levels * procedure.cycles))
    if procedure.lift_off and procedure.cycles > 1:
        again_s = procedure.retract_m / retract_speed_m_s + procedure.retract_m / guarded_speed_m_s
        stages.append(Stage("part and touch between cycles", again_s, procedure.cycles - 1))
    stages.append(Stage("retract and second tare", procedure.tare_s, 1))
    return tuple(stage for stage in stages if stage.total_s > 0.0)
