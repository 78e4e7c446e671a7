"""How far the zero of the force may move between two looks at it, and which drift no tare shows."""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.envelope.bounds import step_rate_per_s
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan, Procedure, SecondForceSource
from stepload.record.outcome import SURE_SIGMAS
from stepload.units import format_quantity

STEP_RATES = 5.0
"""Time constants of the step controller that a level takes beside its ramp and hold."""


def steps_under_load(procedure: Procedure) -> int:
    """Number of levels from one zero of the force to the next look at it."""
    steps = len(procedure.levels_n) * (2 if procedure.unload else 1)
    return steps * (1 if procedure.lift_off else procedure.cycles)


def under_load_s(procedure: Procedure, loop_s: float) -> float:
    """Planned time in s from one zero of the force to the next look at it."""
    step_s = procedure.step_n / procedure.load_rate_n_per_s + procedure.hold_s
    return steps_under_load(procedure) * (step_s + STEP_RATES / step_rate_per_s(loop_s))


def longest_under_load_s(procedure: Procedure, loop_s: float) -> float:
    """The same in s where no level settles before its time is up."""
    waits_s = steps_under_load(procedure) * procedure.settle_timeout_s
    return under_load_s(procedure, loop_s) + waits_s


def moved_n(
    procedure: Procedure, loop_s: float, drift_n_per_s: float, *, second_channel: bool
) -> float:
    """How far a drift may move the zero in N by the next look at it.

    A second channel that disagrees ends a run that takes longer than planned. With one channel
    nothing does: then the longest time under load counts, and the approach before it. That may take
    as long again, but R11 ends it where the reading is the touch force below zero.
    """
    if second_channel:
        return drift_n_per_s * under_load_s(procedure, loop_s)
    loaded_n = drift_n_per_s * longest_under_load_s(procedure, loop_s)
    return loaded_n + min(loaded_n, procedure.touch_force_n)


def counted_shift_n(plan: Plan, loop_s: float) -> float:
    """Largest shift of the zero in N that is counted on while the payload is pressed.

    More than `procedure.max_drift` is found at the next look at the zero. That is too late for what
    was pressed until then, unless a second force channel disagrees before. With one channel the
    shift by the stated drift is counted where it is larger.
    """
    procedure, drift_n_per_s = plan.procedure, plan.rig.force.drift_n_per_s
    if plan.rig.second_force.source is not SecondForceSource.NONE:
        return procedure.max_drift_n
    stated_n = moved_n(procedure, loop_s, drift_n_per_s, second_channel=False)
    return max(procedure.max_drift_n, stated_n)


def zero_drift_reasons(plan: Plan, loop_s: float) -> Iterator[Reason]:
    """Whether the zero moves too far by the next look at it, or may do so unseen by the tare."""
    yield from _stated_reasons(plan, loop_s)
    if plan.rig.second_force.source is SecondForceSource.NONE:
        yield from _short_tare_reasons(plan, loop_s)


def _stated_reasons(plan: Plan, loop_s: float) -> Iterator[Reason]:
    """Whether the stated drift may move the zero beyond `max_drift` in a run as planned."""
    drift_n_per_s, procedure = plan.rig.force.drift_n_per_s, plan.procedure
    allowed_n, loaded_s = procedure.max_drift_n, under_load_s(procedure, loop_s)
    if drift_n_per_s * loaded_s <= allowed_n:
        return
    between = procedure.cycles > 1 and procedure.lift_off
    yield Reason(
        "drift_beyond_max", Severity.WARN,
        f"the stated drift of up to {format_quantity(drift_n_per_s, 'N/s')} (rig.force.drift) may"
        f" move the zero by {format_quantity(drift_n_per_s * loaded_s, 'N')} in the"
        f" {loaded_s:.0f} s from one look at it to the next: beyond"
        f" {format_quantity(allowed_n, 'N')} (max_drift) the"
        + (" run ends between its cycles" if between else " result is flagged, or the run ends"),
        "fewer load steps or shorter holds, a longer warm-up, or a sensor that drifts less",
        drift_n_per_s * loaded_s, allowed_n, "N",
    )  # fmt: skip


def _short_tare_reasons(plan: Plan, loop_s: float) -> Iterator[Reason]:
    """Whether the tare is too short to show a drift that nothing else would see."""
    force, procedure = plan.rig.force, plan.procedure
    noise_n = math.hypot(force.noise_n, force.resolution_n / math.sqrt(12.0))
    samples = force.rate_hz * procedure.tare_s
    hidden_n_per_s = SURE_SIGMAS * noise_n * math.sqrt(12.0 / samples) / procedure.tare_s
    longest_s, planned_s = longest_under_load_s(procedure, loop_s), under_load_s(procedure, loop_s)
    hidden_n, counted_n = hidden_n_per_s * longest_s, counted_shift_n(plan, loop_s)
    if hidden_n <= counted_n:
        return
    needed_s = procedure.tare_s * (hidden_n / counted_n) ** (2.0 / 3.0)
    lift_off = "" if procedure.lift_off else ", lift off between cycles"
    yield Reason(
        "short_tare", Severity.WARN,
        f"a tare of {format_quantity(procedure.tare_s, 's')} shows no drift of the zero below"
        f" {format_quantity(hidden_n_per_s, 'N/s')}, and nothing else checks the only force"
        f" channel: in up to {longest_s:.0f} s from one look at the zero to the next"
        f" ({planned_s:.0f} s as planned, the rest if no level settles before settle_timeout) it"
        f" may move by {format_quantity(hidden_n, 'N')}; {format_quantity(counted_n, 'N')} are"
        " counted on",
        f"tare for {math.ceil(needed_s)} s (procedure.tare){lift_off}, take fewer steps or a"
        " shorter settle_timeout, or declare a second force channel",
        hidden_n, counted_n, "N",
    )  # fmt: skip
