"""How far the zero of the force may move between two looks at it."""

from __future__ import annotations

from stepload.feasibility.bounds import step_rate_per_s
from stepload.plan.model import Plan, Procedure, SecondForce, SecondForceSource

SECOND_ZERO_SHARE = 0.5
"""Share of the cross-check tolerance by which the second channel's zero may be off or drift, where
the plan does not say how far."""
STEP_RATES = 5.0
"""Time constants of the step controller that a level takes beside its ramp and hold."""


def second_zero_n(second: SecondForce) -> float:
    """How far the zero of a sound second channel may be off in N while the payload is pressed."""
    if second.zero_error_n is not None:
        return second.zero_error_n
    return SECOND_ZERO_SHARE * second.tolerance_n


def steps_under_load(procedure: Procedure) -> int:
    """Number of levels from one zero of the force to the next look at it.

    Without a lift-off there is one more between two cycles, at which some force is kept.
    """
    steps = len(procedure.levels_n) * (2 if procedure.unload else 1)
    return steps if procedure.lift_off else steps * procedure.cycles + procedure.cycles - 1


def under_load_s(procedure: Procedure, loop_s: float) -> float:
    """Planned time in s from one zero of the force to the next look at it, approach apart."""
    step_s = procedure.step_n / procedure.load_rate_n_per_s + procedure.hold_s
    return steps_under_load(procedure) * (step_s + STEP_RATES / step_rate_per_s(loop_s))


def longest_under_load_s(procedure: Procedure, loop_s: float) -> float:
    """The same in s where no level settles before its time is up."""
    waits_s = steps_under_load(procedure) * procedure.settle_timeout_s
    return under_load_s(procedure, loop_s) + waits_s


def pressed_shift_n(
    drift_n_per_s: float, before_s: float, loaded_s: float, touch_force_n: float
) -> float:
    """How far a drift may move the zero in N before and during a press.

    Before the contact it is the touch force at the most: R11 ends an approach whose reading falls
    further.
    """
    return min(drift_n_per_s * before_s, touch_force_n) + drift_n_per_s * loaded_s


def moved_n(
    procedure: Procedure, loop_s: float, drift_n_per_s: float, *, second_channel: bool
) -> float:
    """How far a drift may move the zero in N by the next look at it.

    A second channel that disagrees ends a run that takes longer than planned. Where none is, or a
    drift moves both alike, the longest time under load counts, and as long again for the approach
    before it. A run that takes longer is ended (`RunLimits.zero_shift_n`).
    """
    if second_channel:
        return drift_n_per_s * under_load_s(procedure, loop_s)
    longest_s = longest_under_load_s(procedure, loop_s)
    return pressed_shift_n(drift_n_per_s, longest_s, longest_s, procedure.touch_force_n)


def unchecked_drift(plan: Plan, measured_n_per_s: float = 0.0) -> float:
    """Drift of the zero in N/s that only the next look at it shows.

    With one channel the stated or the measured one. Two are compared, but what moves both zeros
    alike, as the temperature does, shows in no comparison: what the second one's sensor states.
    """
    second = plan.rig.second_force
    if second.source is SecondForceSource.NONE:
        return max(plan.rig.force.drift_n_per_s, measured_n_per_s)
    return second.sensor.drift_n_per_s if second.sensor else 0.0


def counted_shift_n(plan: Plan, loop_s: float, measured_n_per_s: float = 0.0) -> float:
    """Largest shift of the zero in N that is counted on while the payload is pressed.

    More than `procedure.max_drift` is found at the next look at the zero. That is too late for what
    was pressed until then. So the shift by a stated drift that nothing else shows is counted where
    it is larger; a measured drift always is.
    """
    second = plan.rig.second_force.source is not SecondForceSource.NONE
    return max(
        plan.procedure.max_drift_n,
        moved_n(plan.procedure, loop_s, unchecked_drift(plan), second_channel=False),
        moved_n(plan.procedure, loop_s, measured_n_per_s, second_channel=second),
    )
