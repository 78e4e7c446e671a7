"""What a user's record holds of a case: `PressData` and `Conditions`, as the program makes them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepload.identification.conditions import ASSUMED_NONLINEARITY, Conditions, Sources
from stepload.identification.loops import Branch, Track, loops_of
from stepload.record.align import ChannelClock
from stepload.record.lag import measure_lag
from stepload.report.conditions import measured
from stepload.report.press_data import (
    LOADING,
    UNLOADING,
    PressData,
    TouchPoint,
    holds_of,
    largest_step,
)
from stepload_verify.trials.honest.case import Case
from stepload_verify.trials.honest.contact import deformed, nothing, press
from stepload_verify.trials.honest.course import Course, course

FloatArray = NDArray[np.float64]

RETRACT_SHARE = 3.0
"""Retract of the arm over the sum of deformation and deflection at the top force."""
START_M = 0.1
PULL_OFF = 9.0 / 8.0
"""Pull at which a JKR contact opens, over the pull with which it closed."""
CLOCKS = tuple(
    ChannelClock(channel, "device clock", "", 0.0, 0.0, 0.0) for channel in ("force", "arm")
)


def record(case: Case) -> tuple[PressData, Conditions]:
    """Press the case and read it with its own errors; the same case gives the same record."""
    rng = np.random.default_rng([case.seed, 1])
    rig, faults = case.rig, case.faults
    law = case.contact.law
    first_n = float(law.force_n[0])
    run = course(case.procedure, rng, first_n, PULL_OFF * first_n)
    retract_m = RETRACT_SHARE * (rig.depth_m + rig.bend_m)
    pressed = press(case.contact, run, retract_m)
    time_s = run.time_s

    late = np.interp(time_s - faults.lag_s, time_s, pressed.force_n)
    force = (1.0 + faults.gain) * late + faults.bend(late) + faults.zero(time_s)
    force = force + rng.normal(0.0, faults.noise_n, force.size)
    force = _quantised(force, rig.force_resolution_n, rng.uniform())

    reach_m = rig.depth_m + rig.bend_m
    at = pressed.travel_m / reach_m if faults.over_travel else pressed.force_n / rig.top_n
    travel = pressed.travel_m + faults.error_m * faults.error(np.clip(at, -0.09, 1.09))
    travel = travel + rng.normal(0.0, rig.position_noise_m, travel.size)
    travel = _quantised(travel, rig.position_resolution_m, rng.uniform())

    data = _press_data(case, run, force, travel)
    if case.six_axes:
        data = replace(data, **_across(case, pressed.force_n, rng))
    return data, measured(_conditions(case), data)


def true_loading(case: Case) -> Branch:
    """The payload's deformation along its first loading, with its creep and without any error."""
    law = case.contact.law
    rng = np.random.default_rng([case.seed, 1])
    run = course(case.procedure, rng, float(law.force_n[0]), PULL_OFF * float(law.force_n[0]))
    happened = press(case.contact, run, 0.0)
    payload = replace(
        case.contact, system=nothing, drift=nothing, slips=(), ratchet_m=0.0, backlash_m=0.0,
        load_drift_m_per_n_s=0.0,
    )  # fmt: skip
    body_m = deformed(payload, run, happened.force_n)
    first = np.isin(run.phase, LOADING) & (run.cycle == 1) & (happened.force_n > 0.0)
    held = holds_of(run.phase[first])
    track = Track(run.time_s[first], happened.force_n[first], body_m[first], held)
    return loops_of([(1, track, None)], np.zeros_like, 0.0)[0].loading


def _quantised(values: FloatArray, quantum: float, offset: float) -> FloatArray:
    return np.asarray((np.round(values / quantum + offset) - offset) * quantum)


def _press_data(case: Case, run: Course, force: FloatArray, travel: FloatArray) -> PressData:
    """As `press_data` does: a lag taken out, tare, zero of travel at the first touch."""
    time_s = run.time_s
    busy = np.isin(run.phase, [*LOADING, *UNLOADING])
    lag = measure_lag(time_s, force, travel, busy)
    lag_s = lag.correction_s
    if lag_s:
        travel = np.interp(time_s - lag_s, time_s, travel)
    middle = np.array([0.5 * (time_s[each.start] + time_s[each.stop - 1]) for each in run.tares])
    means = np.array([force[each].mean() for each in run.tares])
    noises = np.array([force[each].std(ddof=1) for each in run.tares])
    tared = force - np.interp(time_s, middle, means)
    began = [each.index for each in run.touches if each.purpose in ("first", "again")][-1]
    since = travel - travel[began]
    touches = tuple(
        TouchPoint(
            time_s=float(time_s[each.index]),
            position_m=START_M + float(travel[each.index]),
            force_n=float(tared[each.index]),
            cycle=each.cycle,
            purpose=each.purpose,
            travel_m=float(since[each.index]),
        )
        for each in run.touches
    )
    return PressData(
        time_s=time_s,
        force_n=tared,
        travel_m=since,
        phase=run.phase,
        cycle=run.cycle,
        touches=touches,
        noise_n=float(np.median(noises)),
        zero_shift_n=float(means[-1] - means[0]),
        lag=lag,
        lag_corrected_s=lag_s,
        clocks=CLOCKS,
        gauge=False,
        zero_step_n=largest_step(means),
    )


def _across(case: Case, force: FloatArray, rng: np.random.Generator) -> dict[str, Any]:
    """The lateral force as measured by the two other axes of the sensor."""
    noise = rng.normal(0.0, case.rig.force_noise_n, (2, force.size))
    turned = rng.uniform(0.0, 2.0 * np.pi)
    vector = case.lateral * force * np.array([[np.cos(turned)], [np.sin(turned)]]) + noise
    return {
        "across_n": vector.T,
        "lateral_noise_n": float(np.sqrt(2.0)) * case.rig.force_noise_n,
    }


def _conditions(case: Case) -> Conditions:
    """As `planned` makes them of plan, profile and calibration."""
    rig, said = case.rig, case.declared
    sources = Sources(
        system_stiffness_n_per_m=rig.stiffness_n_per_m,
        smooth_error_m=rig.smooth_m,
        smooth_length_n=said.length_n,
        force_noise_n=rig.force_noise_n,
        force_resolution_n=rig.force_resolution_n,
        position_noise_m=rig.position_noise_m,
        position_resolution_m=rig.position_resolution_m,
        lag_sigma_s=rig.lag_sigma_s,
        gain_sigma=rig.gain_sigma,
        nonlinearity=ASSUMED_NONLINEARITY,
        temperature_sigma_k=said.temperature_sigma_k,
        position_m_per_k=said.position_m_per_k,
        **_load_path(case),
    )
    return Conditions(
        sources=sources,
        secant_force_n=case.procedure.top_n,
        touch_force_n=said.touch_n,
        position_resolution_m=rig.position_resolution_m,
        elastic_limit_n=said.elastic_limit_n,
        roughness_m=said.roughness_m,
        rough_length_m=_rough_length(case),
        theory_k=said.theory_k,
        theory_n=said.theory_n,
        modulus_pa=said.modulus_pa,
        plate_pa=None if said.modulus_pa is None else 3.0 * said.modulus_pa,
        pose="down",
        temperature_c=20.0,
    )


def _load_path(case: Case) -> dict[str, Any]:
    """The table with what its rows have in common, or K_s alone, by the rule of `planned`."""
    rig, table = case.rig, case.declared.table
    sigma = rig.stiffness_sigma * rig.stiffness_n_per_m
    if table is None:
        return {"system_stiffness_sigma_n_per_m": sigma}
    force, deflection = (values[1:] for values in table)
    return {
        "system_stiffness_sigma_n_per_m": sigma,
        "deflection_force_n": tuple(force.tolist()),
        "deflection_m": tuple(deflection.tolist()),
        "deflection_sigma_m": (0.0,) * force.size,
    }


def _rough_length(case: Case) -> float | None:
    """1.22 σ κ^-0.16 (11) from the plan's roughness data; None where it has none."""
    said = case.declared
    if not said.roughness_m:
        return said.roughness_m
    if said.modulus_pa is None or said.micro_hardness_pa is None or said.theory_k is None:
        return None
    radius_m = (0.75 * said.theory_k / said.modulus_pa) ** 2
    kappa = said.modulus_pa / said.micro_hardness_pa * np.sqrt(radius_m / said.roughness_m)
    return 1.22 * said.roughness_m * float(kappa**-0.16)
