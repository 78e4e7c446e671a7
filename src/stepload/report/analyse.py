"""Evaluation of the recording of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.feasibility.preflight import Preflight
from stepload.identification.conditions import Conditions
from stepload.identification.identify import Identification, identify
from stepload.identification.run_in import STEADY_CYCLES, RunIn, run_in
from stepload.identification.samples import select
from stepload.identification.system_stiffness import (
    SeriesContact,
    SystemStiffnessFit,
    fit_system_stiffness,
)
from stepload.record.outcome import RunOutcome
from stepload.record.reader import Event, Recording
from stepload.report.conditions import measured, planned
from stepload.report.levels import Level, levels_of
from stepload.report.press_data import LOADING, UNLOADING, PressData, event_number, press_data
from stepload.report.run_data import pressed

CONTACT_MODULUS_SIGMA = 0.1
"""Relative uncertainty of a series contact computed from handbook moduli."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Evaluation of a run; parts that could not be computed are None, and `problem` says why."""

    preflight: Preflight
    outcome: RunOutcome
    recording: Recording
    dry_run: bool
    data: PressData | None = None
    identification: Identification | None = None
    system: SystemStiffnessFit | None = None
    run_in: RunIn | None = None
    levels: tuple[Level, ...] = ()
    problem: str = ""


def identify_payload(data: PressData, conditions: Conditions) -> Identification:
    """Identify the virgin contact: the first cycle's loading, judged with all later cycles.

    Raises:
        BadInputError: there is no load step, or too little in it.
    """
    loading = data.first_loading()
    if not loading.any():
        raise BadInputError(
            "the run ended before the first load step: there is nothing to identify"
        )
    force_n = data.force_n[loading]
    deformation_m = data.travel_m[loading] - conditions.bend(force_n)
    selected = select(deformation_m, force_n, time_s=data.time_s[loading])
    return identify(selected, pressed(data, conditions))


def series_contact(conditions: Conditions) -> SeriesContact | None:
    """The contact that a run pressed on, by theory; None where the record does not state it."""
    if conditions.theory_k is None or conditions.theory_n is None:
        return None
    return SeriesContact(conditions.theory_k, conditions.theory_n, CONTACT_MODULUS_SIGMA)


def identify_system(data: PressData, conditions: Conditions) -> SystemStiffnessFit:
    """K_s from loading and unloading of a run against a stiff flat contact (26).

    Raises:
        BadInputError: there is no load step, or too little in it; or travel was measured across the
            contact, where K_s does not act.
    """
    if data.gauge:
        raise BadInputError(
            "the travel of this run was measured across the contact: K_s is not in it",
            hint="calibrate with the travel of the arm, without the displacement gauge",
        )
    mask = data.branch((*LOADING, *UNLOADING))
    if not mask.any():
        raise BadInputError("the run ended before the first load step: no stiffness to fit")
    time_s, first = np.unique(data.time_s[mask], return_index=True)
    return fit_system_stiffness(
        time_s,
        data.travel_m[mask][first],
        data.force_n[mask][first],
        contact=series_contact(conditions),
        piece=pieces(data)[mask][first],
        loading=data.branch(LOADING)[mask][first],
        resolution_m=conditions.sources.position_resolution_m,
        length_n=conditions.sources.smooth_length_n,
    )


def pieces(data: PressData) -> NDArray[np.intp]:
    """(N,) number that identifies the cycle and the contact of each sample."""
    return np.asarray(data.cycle * (len(data.touches) + 1) + data.contact, dtype=np.intp)


def whole_cycles(events: Sequence[Event]) -> list[int]:
    """Cycles with every level held on the way up, and the lowest held on the way down.

    A cycle is incomplete after a pause on the way down, at the end of a run that ended early, and
    perhaps at the beginning of a resumed run.
    """
    up: dict[int, set[int]] = {}
    down = set()
    for event in events:
        if event.kind == "held":
            cycle, step = int(event_number(event, "cycle")), int(event_number(event, "step"))
            if event.data.get("loading"):
                up.setdefault(cycle, set()).add(step)
            elif step <= 1:
                down.add(cycle)
    every = set(range(1, max((max(steps) for steps in up.values()), default=0) + 1))
    return sorted(cycle for cycle, steps in up.items() if cycle in down and every <= steps)


def cycles_of_run(
    data: PressData, found: Identification, events: Sequence[Event], *, touched_before: bool
) -> RunIn | None:
    """Evaluate the complete cycles; None for one cycle, or two with none complete.

    Args:
        data: of the run.
        found: its identification: the deflection to take out, the force of the secants.
        events: of the run; its holds say which cycles are whole.
        touched_before: whether an earlier part of this run has touched the payload.

    Raises:
        BadInputError: what the cycles are to be compared with is missing.
    """
    whole, cycles = whole_cycles(events), int(data.cycle.max())
    if cycles < 2 or not data.branch(UNLOADING).any():
        return None
    if not whole and cycles < STEADY_CYCLES:
        return None  # no run-in was asked for; what the cycles cannot show is reported separately
    if not whole or (whole[0] != 1 and not touched_before):
        raise BadInputError(
            "no run-in: cycle 1, the virgin one, was not pressed and unloaded to its last step"
            if not touched_before
            else "no run-in: no cycle of this record was pressed and unloaded to its last step"
        )
    lift_off = any(touch.purpose == "cycle" for touch in data.touches)
    opened = touched_before or any(touch.purpose == "resume" for touch in data.touches)
    if len(np.unique(data.cycle[data.cycle > 0])) > 1 and not lift_off and opened:
        raise BadInputError(
            "no run-in: a pause or an interruption opened the contact, which was to stay closed"
        )
    mask = data.branch((*LOADING, *UNLOADING)) & np.isin(data.cycle, whole)
    force_n = data.force_n[mask]
    deformation_m = data.travel_m[mask] - found.conditions.bend(force_n)
    seating = np.array([t.position_m for t in data.touches if t.purpose in ("cycle", "last")])
    first = [t.position_m for t in data.touches if t.purpose in ("first", "again")]
    touch_m = np.concatenate([first[-1:], seating]) if first else seating
    sources = found.conditions.sources
    noise_m = math.hypot(
        sources.position_resolution_m / math.sqrt(12.0),
        sources.force_noise_n / found.fit.secant_n_per_m,
    )
    return run_in(
        deformation_m,
        force_n,
        data.cycle[mask],
        secant_force_n=found.conditions.secant_force_n,
        lift_off=lift_off,
        virgin=not touched_before,
        secant_sigma=noise_m / max(float(np.ptp(deformation_m)), noise_m),
        touch_m=touch_m,
    )


def touched_before(metadata: Mapping[str, str]) -> bool:
    """Whether an earlier part of a resumed run has touched the payload."""
    return metadata.get("touched_before") == "true"


def evaluate(run: Evaluation, conditions: Conditions | None = None) -> Evaluation:
    """Evaluate the recording of a run; missing parts are None, and `problem` says why.

    Args:
        conditions: of the identification, in place of those that follow from the plan.
    """
    plan = run.preflight.plan
    try:
        conditions = conditions or planned(run.preflight)
        data = press_data(run.recording, plan.rig.force.axis, conditions.across)
        conditions = measured(conditions, data)
        run = replace(run, data=data, levels=levels_of(data, run.recording.events, conditions))
        if plan.identify.kind == "system":
            return replace(run, system=identify_system(data, conditions))
        found = identify_payload(data, conditions)
        run = replace(run, identification=found)
        before = touched_before(run.recording.metadata)
        run_in = cycles_of_run(data, found, run.recording.events, touched_before=before)
        return replace(run, run_in=run_in)
    except BadInputError as error:
        return replace(run, problem=error.message)
