"""From the recording of a run to its findings."""

from __future__ import annotations

import math

import numpy as np

from stepload.errors import BadInputError
from stepload.feasibility.preflight import Preflight
from stepload.findings.identification import Conditions, Identification, identify
from stepload.findings.press_data import LOADING, UNLOADING, PressData, press_data
from stepload.findings.run_findings import RunFindings
from stepload.identify.fit_all import payload_deformation
from stepload.identify.runin import RunIn, run_in
from stepload.identify.sources import Sources
from stepload.identify.system import SeriesContact, SystemStiffnessFit, fit_system_stiffness
from stepload.plan.model import Plan
from stepload.record.reader import Recording
from stepload.run.loop import RunOutcome

UNKNOWN_LAG_SIGMA_S = 0.5e-3
"""Standard uncertainty of the alignment where no ramp tells: half a period at 1 kHz."""
CONTACT_MODULUS_SIGMA = 0.1
"""Relative uncertainty of a series contact computed from handbook moduli."""


def sources_of(plan: Plan, data: PressData) -> Sources:
    """The uncertainty sources of a run: the rig's figures, and what the run itself measured."""
    rig, stiffness = plan.rig, plan.rig.system_stiffness
    gauge = rig.displacement if data.gauge else None
    lag_sigma_s = data.lag.sigma_s if math.isfinite(data.lag.sigma_s) else UNKNOWN_LAG_SIGMA_S
    return Sources(
        system_stiffness_n_per_m=None if gauge else stiffness.stiffness_n_per_m,
        system_stiffness_sigma_n_per_m=0.0 if gauge else stiffness.sigma_n_per_m,
        smooth_error_m=0.0 if gauge else stiffness.msde_m,
        force_noise_n=max(data.noise_n, rig.force.noise_n),
        force_resolution_n=rig.force.resolution_n,
        position_noise_m=gauge.noise_m if gauge else rig.arm.position_noise_m,
        position_resolution_m=gauge.resolution_m if gauge else rig.arm.position_resolution_m,
        lag_sigma_s=lag_sigma_s,
        gain_sigma=rig.force.gain_uncertainty,
    )


def conditions_of(plan: Plan, data: PressData, elastic_limit_n: float) -> Conditions:
    """What identification must know beside the data."""
    sources, wanted = sources_of(plan, data), plan.identify
    return Conditions(
        sources=sources,
        secant_force_n=wanted.secant_force_n,
        touch_force_n=plan.procedure.touch_force_n,
        position_resolution_m=sources.position_resolution_m,
        elastic_limit_n=elastic_limit_n,
        roughness_m=plan.payload.roughness_m,
        p=wanted.resolution_multiple_p,
        s=wanted.compensation_quality_s,
        t=wanted.accuracy_t,
    )


def _payload(plan: Plan, data: PressData, elastic_limit_n: float) -> Identification:
    loading = data.branch(LOADING, cycle=int(data.cycle[data.branch(LOADING)].min(initial=1)))
    if not loading.any():
        raise BadInputError(
            "the run ended before the first load step: there is nothing to identify",
        )
    return identify(
        data.travel_m[loading],
        data.force_n[loading],
        conditions_of(plan, data, elastic_limit_n),
        time_s=data.time_s[loading],
    )


def _system(plan: Plan, data: PressData, check: Preflight) -> SystemStiffnessFit:
    mask = data.branch((*LOADING, *UNLOADING))
    if not mask.any():
        raise BadInputError("the run ended before the first load step: no stiffness to fit")
    time_s, first = np.unique(data.time_s[mask], return_index=True)
    law = check.theory.law
    return fit_system_stiffness(
        time_s,
        data.travel_m[mask][first],
        data.force_n[mask][first],
        contact=SeriesContact(law.k, law.n, CONTACT_MODULUS_SIGMA),
        resolution_m=plan.rig.arm.position_resolution_m,
    )


def _cycles(plan: Plan, data: PressData, found: Identification) -> RunIn | None:
    if not plan.procedure.unload or plan.procedure.cycles < 2:
        return None
    mask = data.branch((*LOADING, *UNLOADING))
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
        secant_sigma=noise_m / max(float(np.ptp(deformation_m)), noise_m),
        touch_m=touch_m,
    )


def run_findings(
    plan: Plan, check: Preflight, outcome: RunOutcome, recording: Recording, *, dry_run: bool
) -> RunFindings:
    """All that a recording tells; what cannot be told is None, with the reason in `problem`."""
    data: PressData | None = None
    found: Identification | None = None
    system: SystemStiffnessFit | None = None
    cycles: RunIn | None = None
    problem = ""
    try:
        data = press_data(recording, plan.rig.force.axis)
        if plan.identify.kind == "system":
            system = _system(plan, data, check)
        else:
            found = _payload(plan, data, check.theory.elastic_limit_n)
            cycles = _cycles(plan, data, found)
    except BadInputError as error:
        problem = error.message
    return RunFindings(
        plan, check, outcome, recording, data, found, system, cycles, problem, dry_run
    )
