"""From the recording of a run to its evaluation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from stepload.envelope.envelope import Envelope
from stepload.errors import BadInputError
from stepload.identify.conditions import Conditions
from stepload.identify.identification import Identification, identify
from stepload.identify.runin import RunIn, run_in
from stepload.identify.selection import payload_deformation, select
from stepload.identify.system import SeriesContact, SystemStiffnessFit, fit_system_stiffness
from stepload.plan.model import Plan
from stepload.record.outcome import RunOutcome
from stepload.record.reader import Recording
from stepload.results.conditions import measured, planned
from stepload.results.press_data import LOADING, UNLOADING, PressData, number, press_data

CONTACT_MODULUS_SIGMA = 0.1
"""Relative uncertainty of a series contact computed from handbook moduli."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A run and what its data say; None where it did not get so far, `problem` says why."""

    envelope: Envelope
    outcome: RunOutcome
    recording: Recording
    dry_run: bool
    data: PressData | None = None
    identification: Identification | None = None
    system: SystemStiffnessFit | None = None
    run_in: RunIn | None = None
    problem: str = ""


def identify_payload(data: PressData, conditions: Conditions) -> Identification:
    """Identify from the first cycle's loading branch: the virgin contact.

    Raises:
        BadInputError: there is no load step, or too little in it.
    """
    loading = data.branch(LOADING)
    if not loading.any():
        raise BadInputError(
            "the run ended before the first load step: there is nothing to identify"
        )
    loading = data.branch(LOADING, cycle=int(data.cycle[loading].min()))
    return identify(
        select(
            data.travel_m[loading],
            data.force_n[loading],
            system_stiffness_n_per_m=conditions.sources.system_stiffness_n_per_m,
            time_s=data.time_s[loading],
        ),
        conditions,
    )


def series_contact(conditions: Conditions) -> SeriesContact | None:
    """The contact that a run pressed on, by theory; None where the record does not tell it."""
    if conditions.theory_k is None or conditions.theory_n is None:
        return None
    return SeriesContact(conditions.theory_k, conditions.theory_n, CONTACT_MODULUS_SIGMA)


def identify_system(data: PressData, conditions: Conditions) -> SystemStiffnessFit:
    """K_s from loading and unloading of a run against a stiff flat contact (26).

    Raises:
        BadInputError: there is no load step, or too little in it; or travel was measured across
            the contact, which leaves K_s out.
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
        resolution_m=conditions.sources.position_resolution_m,
    )


def whole_cycles(plan: Plan, recording: Recording) -> list[int]:
    """Cycles of which every level was held on the way up, and the lowest on the way down.

    A pause on the way down cuts a cycle short, a run that ended early its last one, and a run that
    was resumed may begin in the middle of one.
    """
    up: dict[int, set[int]] = {}
    down = set()
    for event in recording.events:
        if event.kind == "held":
            cycle, step = int(number(event, "cycle")), int(number(event, "step"))
            if event.data.get("loading"):
                up.setdefault(cycle, set()).add(step)
            elif step <= 1:
                down.add(cycle)
    every = set(range(1, len(plan.procedure.levels_n) + 1))
    return sorted(cycle for cycle, steps in up.items() if cycle in down and every <= steps)


def _cycles(
    plan: Plan, recording: Recording, data: PressData, found: Identification
) -> RunIn | None:
    """What the whole cycles say.

    Raises:
        BadInputError: what the cycles are to be compared with is missing.
    """
    if not plan.procedure.unload or plan.procedure.cycles < 2:
        return None
    whole = whole_cycles(plan, recording)
    touched_before = recording.metadata.get("touched_before") == "true"
    if not whole or (whole[0] != 1 and not touched_before):
        raise BadInputError(
            "no run-in: cycle 1, the virgin one, was not pressed and unloaded to its last step"
            if not touched_before
            else "no run-in: no cycle of this record was pressed and unloaded to its last step"
        )
    opened = touched_before or any(touch.purpose == "resume" for touch in data.touches)
    if not plan.procedure.lift_off and opened:
        raise BadInputError(
            "no run-in: a pause or an interruption opened the contact, which was to stay closed"
        )
    mask = data.branch((*LOADING, *UNLOADING)) & np.isin(data.cycle, whole)
    stiffness = found.conditions.sources.system_stiffness_n_per_m
    travel_m, force_n = data.travel_m[mask], data.force_n[mask]
    deformation_m = (
        travel_m if stiffness is None else payload_deformation(travel_m, force_n, stiffness)
    )
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
        lift_off=plan.procedure.lift_off,
        virgin=not touched_before,
        secant_sigma=noise_m / max(float(np.ptp(deformation_m)), noise_m),
        touch_m=touch_m,
    )


def evaluate(run: Evaluation) -> Evaluation:
    """A run with all that its recording says; what cannot be had is None, `problem` says why."""
    plan = run.envelope.plan
    try:
        data = press_data(run.recording, plan.rig.force.axis)
        run = replace(run, data=data)
        conditions = measured(planned(run.envelope), data)
        if plan.identify.kind == "system":
            return replace(run, system=identify_system(data, conditions))
        found = identify_payload(data, conditions)
        run = replace(run, identification=found)
        return replace(run, run_in=_cycles(plan, run.recording, data, found))
    except BadInputError as error:
        return replace(run, problem=error.message)
