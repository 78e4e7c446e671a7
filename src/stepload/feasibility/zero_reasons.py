"""What preflight says of a zero of the force that moves: too far, for too long, or unseen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from stepload.feasibility.reason import Reason, Severity
from stepload.feasibility.schedule import APPROACH, DRIFT_CHECK_S, UNDER_LOAD, Stage
from stepload.feasibility.zero_drift import (
    counted_shift_n,
    longest_under_load_s,
    pressed_shift_n,
    unchecked_drift,
    under_load_s,
)
from stepload.plan.model import Plan, Procedure, SecondForceSource
from stepload.record.outcome import SURE_SIGMAS
from stepload.units import beside_limit, format_quantity


def looked_after_s(procedure: Procedure, loop_s: float, stages: Sequence[Stage]) -> float:
    """Planned time in s from one look at the zero to the next."""
    return sum(_times_s(procedure, loop_s, stages))


def _times_s(procedure: Procedure, loop_s: float, stages: Sequence[Stage]) -> tuple[float, float]:
    """Times in s from the middle of a tare to the contact, and from there to the next look."""
    contacts = procedure.cycles if procedure.lift_off else 1
    scheduled_s = sum(stage.total_s for stage in stages if stage.name in UNDER_LOAD) / contacts
    approach_s = 0.5 * procedure.tare_s + DRIFT_CHECK_S
    approach_s += sum(stage.total_s for stage in stages if stage.name in APPROACH)
    return approach_s, max(under_load_s(procedure, loop_s), scheduled_s)


def zero_drift_reasons(plan: Plan, loop_s: float, stages: Sequence[Stage]) -> Iterator[Reason]:
    """Whether the zero moves too far by the next look at it, or may do so unseen by the tare.

    Args:
        plan: of the run.
        loop_s: its loop delay T.
        stages: its schedule; empty where it may not run.
    """
    approach_s, loaded_s = _times_s(plan.procedure, loop_s, stages)
    yield from _stated_reasons(plan, approach_s + loaded_s)
    yield from _old_zero_reasons(plan, loop_s, approach_s, loaded_s)
    if plan.rig.second_force.source is SecondForceSource.NONE:
        longest_s = max(longest_under_load_s(plan.procedure, loop_s), loaded_s)
        yield from _short_tare_reasons(plan, loop_s, max(approach_s, longest_s), longest_s)


def _stated_reasons(plan: Plan, looked_s: float) -> Iterator[Reason]:
    """Whether the stated drift may end a run as planned."""
    drift_n_per_s, procedure = plan.rig.force.drift_n_per_s, plan.procedure
    shift_n, allowed_n = drift_n_per_s * looked_s, procedure.max_drift_n
    if shift_n <= allowed_n:
        return
    shift, allowed = beside_limit(shift_n, allowed_n, "N")
    yield Reason(
        "drift_beyond_max", Severity.WARN,
        f"The stated drift may move the zero by {shift} in {looked_s:.0f} s; max_drift allows"
        f" {allowed}.",
        "a larger max_drift, fewer levels, shorter holds, or a longer warm-up",
        shift_n, allowed_n, "N", shift_n / procedure.top_force_n, "procedure.max_drift",
    )  # fmt: skip


def _old_zero_reasons(
    plan: Plan, loop_s: float, approach_s: float, loaded_s: float
) -> Iterator[Reason]:
    """Whether the run is expected to be ended because its zero is too old to count on."""
    drift_n_per_s, touch_n = unchecked_drift(plan), plan.procedure.touch_force_n
    alone = plan.rig.second_force.source is SecondForceSource.NONE
    counted_n = counted_shift_n(plan, loop_s)
    shift_n = pressed_shift_n(drift_n_per_s, approach_s, loaded_s, touch_n)
    if shift_n <= counted_n:
        return
    shift, counted = beside_limit(shift_n, counted_n, "N")
    yield Reason(
        "old_zero", Severity.WARN,
        f"The zero may drift by {shift} in {approach_s + loaded_s:.0f} s; the run ends when it may"
        f" have moved by {counted}.",
        f"max_drift: {format_quantity(1.2 * shift_n, 'N')}, fewer levels, or shorter holds"
        + (", or a second force channel" if alone else ""),
        shift_n, counted_n, "N", shift_n / plan.procedure.top_force_n, "procedure.max_drift",
    )  # fmt: skip


def _short_tare_reasons(
    plan: Plan, loop_s: float, approach_s: float, longest_s: float
) -> Iterator[Reason]:
    """Whether the tare is too short to show a drift that nothing else would see."""
    force, procedure = plan.rig.force, plan.procedure
    noise_n = math.hypot(force.noise_n, force.resolution_n / math.sqrt(12.0))
    samples = force.rate_hz * procedure.tare_s
    hidden_n_per_s = SURE_SIGMAS * noise_n * math.sqrt(12.0 / samples) / procedure.tare_s
    touch_n, counted_n = procedure.touch_force_n, counted_shift_n(plan, loop_s)
    hidden_n = pressed_shift_n(hidden_n_per_s, approach_s, longest_s, touch_n)
    if hidden_n <= counted_n:
        return
    seen_n_per_s = max(counted_n / (approach_s + longest_s), (counted_n - touch_n) / longest_s)
    needed_s = procedure.tare_s * (hidden_n_per_s / seen_n_per_s) ** (2.0 / 3.0)
    yield Reason(
        "short_tare", Severity.WARN,
        f"A tare of {format_quantity(procedure.tare_s, 's')} does not show a drift of"
        f" {format_quantity(hidden_n, 'N')} in the run; {format_quantity(counted_n, 'N')} are"
        " allowed for.",
        f"tare: {math.ceil(needed_s)} s, fewer levels, or a shorter settle_timeout",
        hidden_n, counted_n, "N", hidden_n / procedure.top_force_n, "procedure.tare",
    )  # fmt: skip
