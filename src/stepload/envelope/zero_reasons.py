"""What preflight says of a zero of the force that moves: too far, for too long, or unseen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from stepload.envelope.reason import Reason, Severity
from stepload.envelope.schedule import APPROACH, DRIFT_CHECK_S, UNDER_LOAD, Stage
from stepload.envelope.zero_drift import (
    counted_shift_n,
    longest_under_load_s,
    pressed_shift_n,
    unchecked_drift,
    under_load_s,
)
from stepload.plan.model import Plan, SecondForceSource
from stepload.record.outcome import SURE_SIGMAS
from stepload.units import beside_limit, format_quantity


def zero_drift_reasons(plan: Plan, loop_s: float, stages: Sequence[Stage]) -> Iterator[Reason]:
    """Whether the zero moves too far by the next look at it, or may do so unseen by the tare.

    Args:
        plan: of the run.
        loop_s: its loop delay T.
        stages: its schedule; empty where it may not run.
    """
    procedure = plan.procedure
    contacts = procedure.cycles if procedure.lift_off else 1
    scheduled_s = sum(stage.total_s for stage in stages if stage.name in UNDER_LOAD) / contacts
    approach_s = 0.5 * procedure.tare_s + DRIFT_CHECK_S
    approach_s += sum(stage.total_s for stage in stages if stage.name in APPROACH)
    loaded_s = max(under_load_s(procedure, loop_s), scheduled_s)
    yield from _stated_reasons(plan, approach_s + loaded_s)
    yield from _old_zero_reasons(plan, loop_s, approach_s, loaded_s)
    if plan.rig.second_force.source is SecondForceSource.NONE:
        longest_s = max(longest_under_load_s(procedure, loop_s), loaded_s)
        yield from _short_tare_reasons(plan, loop_s, max(approach_s, longest_s), longest_s)


def _stated_reasons(plan: Plan, looked_s: float) -> Iterator[Reason]:
    """Whether the stated drift may end a run as planned: by `max_drift`, or by the touch force,
    above which a contact counts as not open."""
    drift_n_per_s, procedure = plan.rig.force.drift_n_per_s, plan.procedure
    shift_n = drift_n_per_s * looked_s
    limits_n = {"max_drift": procedure.max_drift_n, "touch_force": procedure.touch_force_n}
    allowed_n = min(limits_n.values())
    if shift_n <= allowed_n:
        return
    passed = " and ".join(name for name, limit_n in limits_n.items() if limit_n < shift_n)
    between = procedure.cycles > 1 and procedure.lift_off
    shift, allowed = beside_limit(shift_n, allowed_n, "N")
    ends = (
        "a retract finds the contact not open, and the run ends"
        if allowed_n < procedure.max_drift_n
        else "the run ends between its cycles"
        if between
        else "the result is flagged, or the run ends"
    )
    yield Reason(
        "drift_beyond_max", Severity.WARN,
        f"the stated drift of up to {format_quantity(drift_n_per_s, 'N/s')} (rig.force.drift) may"
        f" move the zero by {shift} in the {looked_s:.0f} s from one look at it to the next: beyond"
        f" {allowed} ({min(limits_n, key=limits_n.__getitem__)}) {ends}",
        f"a larger {passed} (less force is then allowed), fewer load steps or shorter holds, a"
        " longer warm-up, or a sensor that drifts less",
        shift_n, allowed_n, "N",
    )  # fmt: skip


def _old_zero_reasons(
    plan: Plan, loop_s: float, approach_s: float, loaded_s: float
) -> Iterator[Reason]:
    """Whether the run is expected to be ended because its zero is too old to count on."""
    drift_n_per_s, touch_n = unchecked_drift(plan), plan.procedure.touch_force_n
    alone = plan.rig.second_force.source is SecondForceSource.NONE
    key = "rig.force.drift" if alone else "second_force.sensor.drift"
    whose = "the only force channel" if alone else "both force channels alike"
    counted_n = counted_shift_n(plan, loop_s)
    shift_n = pressed_shift_n(drift_n_per_s, approach_s, loaded_s, touch_n)
    if shift_n <= counted_n:
        return
    shift, counted = beside_limit(shift_n, counted_n, "N")
    yield Reason(
        "old_zero", Severity.WARN,
        f"with the stated drift of up to {format_quantity(drift_n_per_s, 'N/s')} ({key})"
        f" the zero of {whose} may move by {shift} in the {approach_s:.0f} s from"
        f" the middle of its tare to the contact and the {loaded_s:.0f} s under load: the run is"
        f" ended when it may have moved by the {counted} that are counted on",
        f"procedure.max_drift: {format_quantity(1.2 * shift_n, 'N')} has more counted on (and less"
        " force allowed); or fewer steps, shorter holds, a shorter way"
        + (", a second force channel" if alone else ""),
        shift_n, counted_n, "N",
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
    lift_off = "" if procedure.lift_off else ", lift off between cycles"
    yield Reason(
        "short_tare", Severity.WARN,
        f"a tare of {format_quantity(procedure.tare_s, 's')} shows no drift of the zero below"
        f" {format_quantity(hidden_n_per_s, 'N/s')}, and nothing else checks the only force"
        f" channel: in the approach and up to {longest_s:.0f} s under load (if no level settles"
        f" before settle_timeout) it may move by {format_quantity(hidden_n, 'N')};"
        f" {format_quantity(counted_n, 'N')} are counted on",
        f"tare for {math.ceil(needed_s)} s (procedure.tare){lift_off}, take fewer steps or a"
        " shorter settle_timeout, or declare a second force channel",
        hidden_n, counted_n, "N",
    )  # fmt: skip
