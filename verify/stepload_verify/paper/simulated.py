"""Seeded simulated runs of the paper's sequence on both rigs: what its estimators make of them.

What they give is kept in `simulated.csv` beside the page, with the first run by itself: a test
makes that one again.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stepload.errors import DomainError
from stepload.identification.estimators import recursive_fit
from stepload.identification.fit import Fit
from stepload.identification.ls import rs_btls
from stepload.identification.samples import select
from stepload.identification.system_stiffness import fit_system_stiffness
from stepload_verify.paper import intervals, laws
from stepload_verify.paper.laws import Test
from stepload_verify.paper.printed import PAYLOADS, SECANT_FORCE_N, Payload
from stepload_verify.paper.step_load import (
    INSTRON,
    INSTRON_MSDE_M,
    SCENARIO_C,
    STVF,
    STVF_MSDE_M,
    Errors,
    FloatArray,
    RawRun,
    StepRig,
    press,
)

RUNS = 100
SEED = 2009
LOW, HIGH = 0.05, 0.95
"""Quantiles that bound a band."""
QUANTITIES = ("K̂", "n̂", "secant")
TOUCH, KNOWN = "touch at 3 N", "zero known"
"""Where δ begins: at a threshold of force, or at the mean plane, which only a simulation knows."""
RIGS = {
    "STVF": (replace(STVF, rate_hz=200.0), SCENARIO_C),
    "Instron": (replace(INSTRON, rate_hz=200.0), replace(SCENARIO_C, smooth_m=INSTRON_MSDE_M)),
}
SYSTEMS = {"STVF": STVF_MSDE_M, "Instron": INSTRON_MSDE_M}

Key = tuple[str, str, str, str, str]
"""Payload or rig, test, estimator, zero, quantity."""


class Scatter(NamedTuple):
    """What `RUNS` runs give for one number: quantiles, and the first of them."""

    median: float
    low: float
    high: float
    first: float


Kept = dict[Key, Scatter]


def simulate(runs: int | None = None) -> Kept:
    """Everything that is simulated; `RUNS` of each unless told."""
    runs = runs or RUNS
    return {key: scatter for part in (_payloads(runs), _systems(runs), _intervals(runs))
            for key, scatter in part}  # fmt: skip


def read(path: Path) -> Kept:
    """What is kept in a file."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return {(a, b, c, d, e): Scatter(*map(float, rest)) for a, b, c, d, e, *rest in rows}


def csv_of(kept: Kept) -> str:
    """The file's text."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["of", "test", "estimator", "zero", "quantity", *Scatter._fields])
    writer.writerows([*key, *(f"{value:.4g}" for value in found)] for key, found in kept.items())
    return out.getvalue()


def seed_of(payload: Payload, test: Test) -> int:
    """Another draw for every test of every payload."""
    return SEED + 10 * PAYLOADS.index(payload) + list(Test).index(test)


def rig_of(test: Test) -> tuple[StepRig, Errors]:
    """The rig of a test and its errors."""
    return RIGS["Instron" if test is Test.INSTRON else "STVF"]


def points(run: RawRun, payload: Payload, test: Test) -> tuple[FloatArray, FloatArray]:
    """Deformation in m and force in N (N,); that of the Instron for an aluminium plate (V-A)."""
    scale = laws.counter_body(payload) if test is Test.INSTRON else 1.0
    return run.deformation_m(), scale * run.loaded_n()


def curve_csv(deformation_m: FloatArray, force_n: FloatArray) -> str:
    """A curve as `stepload identify` and `stepload compare --curve` read it."""
    rows = (f"{d:.6e},{f:g}\n" for d, f in zip(deformation_m, force_n, strict=True))
    return "displacement_m,force_n\n" + "".join(rows)


def batch(deformation_m: FloatArray, force_n: FloatArray) -> Fit:
    """RS-BTLS of a run."""
    selected = select(deformation_m, force_n)
    chosen = selected.samples(selected.batch)
    return rs_btls(chosen.deformation_m, chosen.force_n, secant_force_n=SECANT_FORCE_N)


def _payloads(runs: int) -> Iterator[tuple[Key, Scatter]]:
    for payload in PAYLOADS:
        for test in Test:
            rig, errors = rig_of(test)
            law = laws.measured(payload, test)
            for zero, touch_n in ((TOUCH, errors.touch_force_n), (KNOWN, None)):
                rng = np.random.default_rng(seed_of(payload, test))
                these = replace(errors, touch_force_n=touch_n)
                fits = [_fits(press(law, rig, these, rng), payload, test) for _ in range(runs)]
                for name in fits[0]:
                    found = np.array([_numbers(fit[name]) for fit in fits if name in fit])
                    for quantity, values in zip(QUANTITIES, found.T, strict=True):
                        yield (payload.name, test, name, zero, quantity), _scatter(values)


def _fits(run: RawRun, payload: Payload, test: Test) -> dict[str, Fit]:
    deformation, force = points(run, payload, test)
    fits = {"RS-BTLS": batch(deformation, force)}
    if test is not Test.INSTRON:
        chosen = select(deformation, force, time_s=run.time_s[run.touch :])
        try:
            fits["RS-RTLS"] = recursive_fit(chosen, SECANT_FORCE_N)
        except (DomainError, ArithmeticError):  # points that determine no law
            return fits
    return fits


def _numbers(fit: Fit) -> tuple[float, float, float]:
    return fit.k, fit.n, fit.secant_n_per_m


def _systems(runs: int) -> Iterator[tuple[Key, Scatter]]:
    """(26) against a rigid contact, with a smooth error of the size of the printed MSDE."""
    for name, (rig, _) in RIGS.items():
        rng = np.random.default_rng(SEED)
        errors = Errors(touch_force_n=None, smooth_m=SYSTEMS[name])
        fits = []
        for _ in range(runs):
            run = press(np.zeros_like, rig, errors, rng)
            fits.append(
                fit_system_stiffness(
                    run.time_s, run.travel_m, run.force_n,
                    min_force_fraction=0.0,
                    resolution_m=rig.position_resolution_m,
                    length_n=errors.length_n,
                )
            )  # fmt: skip
        for quantity, values in (
            ("K_s", [fit.stiffness_n_per_m for fit in fits]),
            ("C_s", [fit.damping_n_s_per_m for fit in fits]),
            ("MSDE", [fit.msde_m for fit in fits]),
        ):
            yield (name, "calibration", "(26)", KNOWN, quantity), _scatter(np.array(values))


def _intervals(runs: int) -> Iterator[tuple[Key, Scatter]]:
    """How often the product's interval holds the secants of the law put in; and its chord."""
    held = np.array([intervals.held(SEED + run) for run in range(runs)], dtype=float)
    for quantity, values in zip(intervals.HELD, held.T, strict=True):
        found = _scatter(values)
        share = float(values.mean())
        yield (
            ("plastic sphere", "intervals", "judge", TOUCH, quantity),
            found if quantity == intervals.HELD[-1] else found._replace(median=share),
        )


def _scatter(values: FloatArray) -> Scatter:
    low, middle, high = np.quantile(values, [LOW, 0.5, HIGH])
    return Scatter(float(middle), float(low), float(high), float(values[0]))
