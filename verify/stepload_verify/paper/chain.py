"""Checks of the chain: numbers that are put into the simulation and have to come back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stepload.identification.system_stiffness import SystemStiffnessFit, fit_system_stiffness
from stepload_verify.paper.bands import HIGH, LOW
from stepload_verify.paper.rows import number
from stepload_verify.paper.section import Section
from stepload_verify.paper.simulated import RIG, RUNS, SEED
from stepload_verify.paper.step_load import (
    INSTRON,
    INSTRON_MSDE_M,
    STVF,
    STVF_MSDE_M,
    Errors,
    StepRig,
    press,
)


def system_stiffness() -> Section:
    """(26) on simulated K_s runs against a rigid contact, errors of the size printed."""
    whole = _calibrations(RIG, STVF_MSDE_M)
    high = _calibrations(RIG, STVF_MSDE_M, min_force_fraction=0.4)
    known = _calibrations(RIG, STVF_MSDE_M, min_force_fraction=0.4, known_error_m=STVF_MSDE_M)
    instron = _calibrations(replace(INSTRON, rate_hz=RIG.rate_hz), INSTRON_MSDE_M)
    lines = [
        f"{RUNS} simulated runs a rig of 50 N steps to 300 N against a rigid contact, with a "
        "smooth position error of the size of the printed MSDE, fitted with intercept.",
        "",
        "| quantity | put in | comes back: median | 5 to 95 % | |",
        "|---|---|---|---|---|",
        _came_back("STVF: K_s, N/m", STVF.stiffness_n_per_m, [f.stiffness_n_per_m for f in whole]),
        _came_back(
            "STVF: C_s, N·s/m",
            STVF.damping_n_s_per_m,
            [f.damping_n_s_per_m for f in whole],
            "not determined: quanta of the differentiated travel",
        ),
        _came_back(
            "STVF: MSDE, m",
            STVF_MSDE_M,
            [f.msde_m for f in whole],
            "the line absorbs part of the smooth error",
        ),
        _came_back(
            "Instron: K_s, N/m", INSTRON.stiffness_n_per_m, [f.stiffness_n_per_m for f in instron]
        ),
        "",
        f"K_s of the STVF scatters by {_scatter(whole)} from run to run, by {_scatter(high)} "
        f"without the lower 40 % of the range. σ from one such run is {_claimed(high)} (median), "
        f"and {_claimed(known)} where the smooth error is known from earlier runs.",
    ]
    return Section("System stiffness (26)", tuple(lines))


def _came_back(quantity: str, put_in: float, values: list[float], why: str = "") -> str:
    low, middle, high = np.quantile(values, [LOW, 0.5, HIGH])
    return (
        f"| {quantity} | {number(put_in)} | {number(middle)} ({100 * (middle / put_in - 1):+.1f} %)"
        f" | {number(low)} to {number(high)} | {why} |"
    )


def _scatter(fits: list[SystemStiffnessFit]) -> str:
    spread = np.std([f.stiffness_n_per_m for f in fits]) / STVF.stiffness_n_per_m
    return f"{100 * spread:.1f} %"


def _claimed(fits: list[SystemStiffnessFit]) -> str:
    sigma = np.median([f.sigma_n_per_m for f in fits]) / STVF.stiffness_n_per_m
    return f"{100 * sigma:.1f} %"


def _calibrations(
    rig: StepRig,
    error_m: float,
    *,
    min_force_fraction: float = 0.0,
    known_error_m: float | None = None,
) -> list[SystemStiffnessFit]:
    rng = np.random.default_rng(SEED)
    errors = Errors(touch_force_n=None, smooth_m=error_m)
    fits = []
    for _ in range(RUNS):
        run = press(np.zeros_like, rig, errors, rng)
        fits.append(
            fit_system_stiffness(
                run.time_s,
                run.travel_m,
                run.force_n,
                min_force_fraction=min_force_fraction,
                resolution_m=rig.position_resolution_m,
                known_error_m=known_error_m,
                length_n=errors.length_n,
            )
        )
    return fits
