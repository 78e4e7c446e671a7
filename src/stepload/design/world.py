"""Simulated runs of one cell, with errors of the sizes that the rig states, and their truth.

The simulation deliberately differs from the assumptions of the identification: payloads have
unstated roughness and creep, the smooth error has another correlation length than the stated one,
its size is as uncertain as the calibration was, and the second loading does not repeat the first
one's error exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from stepload.design.course import RATE_HZ, Course
from stepload.design.law import Payload
from stepload.envelope.order import CYCLES, DEFAULT, Order
from stepload.estimators.conditions import ROUGH_LENGTH_SIGMA, Conditions
from stepload.estimators.fit import BoolArray, FloatArray
from stepload.estimators.linearity import linearity_errors
from stepload.estimators.smooth import LONGEST, SHORTEST, smooth_correlation

Rng = np.random.Generator

ROUGHEST_M, FINEST_M = 3e-6, 0.1e-6
"""Range of roughness lengths 1.22 σ κ^-0.16 of machined surfaces, where the payload does not state
its own; half of the runs have none."""
ROUGH_SIGMA = 0.1
"""Relative standard uncertainty of a stated roughness length, unless a larger one is stated."""
CREEP = 0.01
"""Largest delayed deformation, as a share of the prompt one, in half of the runs."""
CREEP_TAUS_S = (1.0, 3.0, 10.0, 30.0)
LOOP = 0.03
"""Largest energy lost in a cycle, as a share of what is stored."""
NOT_REPEATED = 0.2
"""Largest share of the smooth error that differs in every branch."""
LENGTH_FACTOR = 2.0
"""Factor within which the true correlation length lies about a stated one."""
DRIFT_SHARE = 0.002
"""Largest drift of the travel over a cycle of a map, as a share of the deformation at the top; in a
longer cycle it grows."""
ZERO_BOW = 0.25
"""Share of a zero drift from tare to tare that is not linear in time."""
_GRID, _LENGTHS = 48, 4

DRAWN = (
    "K_s and its table wrong within the stated uncertainty, with a seat at small force where there "
    "is no table of the pose; force gain, bend and noise; drift of the force's zero; lag; damping "
    "of the load path as stated; warming; quanta and noise of the travel; a smooth error of the "
    f"stated size whose length is unknown within a factor of {LENGTH_FACTOR:g} and which does not "
    f"repeat by up to {NOT_REPEATED:.0%}; drift of the travel up to {DRIFT_SHARE:.1%} in "
    f"{DEFAULT.cycle_s:.0f} s; a loop of up to {LOOP:.0%}; in half of the runs a "
    f"roughness length of {FINEST_M * 1e6:g} to {ROUGHEST_M * 1e6:g} µm that nobody has stated (a "
    f"stated one within {ROUGH_SIGMA:.0%}, or its own ± where that comes to more than "
    f"{ROUGH_LENGTH_SIGMA:.0%}), in half of them creep of up to {CREEP:.0%}"
)
NOT_DRAWN = (
    "yield, slip, adhesion, backlash, lateral force, a K_s that is further off than it is "
    "said to be, a touch that is found late, runs that are stopped: a rig with these measures less"
)


@dataclass(frozen=True, slots=True)
class Cell:
    """One point of a map: a payload on a rig.

    Attributes:
        payload: its law, with the top force.
        conditions: the conditions of the identification.
        touch_n: force at which a touch is seen.
        zero_drift_n_per_s: largest drift of the force's zero.
        damping_n_s_per_m: C_s of the load path, which delays its deflection.
        order: steps and holds of its runs.
    """

    payload: Payload
    conditions: Conditions
    touch_n: float
    zero_drift_n_per_s: float = 0.0
    damping_n_s_per_m: float = 0.0
    order: Order = DEFAULT


@dataclass(frozen=True, slots=True)
class Runs:
    """R runs of one cell, sample by sample.

    Attributes:
        force_n, travel_m: (R, N) as measured, tared.
        zero_step_n: (R,) change of the force's zero from tare to tare.
        rough_m: (R,) roughness lengths, which with the payload are the truth.
    """

    force_n: FloatArray
    travel_m: FloatArray
    zero_step_n: FloatArray
    rough_m: FloatArray


def press(cell: Cell, run: Course, count: int, rng: Rng) -> Runs:
    """Draw and simulate `count` runs."""
    told = cell.conditions
    sources = told.sources
    forces, place = np.unique(run.force_n, return_inverse=True)
    ends = np.flatnonzero(run.force_n == 0.0)
    rough = _roughness(told, count, rng)
    law = cell.payload.deformation_m(forces, rough)
    gain = sources.gain_sigma * rng.standard_normal((count, 1))

    at_force = law + _system(told, forces, gain, rng)
    softer = sources.temperature_sigma_k * sources.modulus_per_k * rng.standard_normal((count, 1))
    at_force -= softer * law / cell.payload.exponent
    # A sensor's nonlinearity is in its readings, and so in the forces that are held.
    bent = linearity_errors(forces, sources.nonlinearity).T @ rng.standard_normal((2, count))
    travel = at_force[:, place]
    creeping = np.where(rng.uniform(size=count) < 0.5, rng.uniform(0.0, CREEP, count), 0.0)
    _add_creep(travel, law[:, place], creeping, rng)
    _add_loop(travel, run, cell.payload, rng.uniform(0.0, LOOP, count))
    _add_smooth(travel, told, run, rng)
    _add_in_time(travel, cell, run, rng)
    _add_lag(travel, run, sources.lag_sigma_s * rng.standard_normal(count))
    _add_damping(travel, cell, run)
    travel += sources.position_noise_m * rng.standard_normal(travel.shape)
    travel = _quantised(travel, sources.position_resolution_m, rng.uniform(size=(count, 1)))

    cycle_s = float(run.time_s[-1]) / CYCLES
    step = cell.zero_drift_n_per_s * cycle_s * rng.uniform(-1.0, 1.0, count)
    share = np.mod(run.time_s, cycle_s) / cycle_s
    bow = 4.0 * share * (1.0 - share) * ZERO_BOW
    force = (1.0 + gain) * run.force_n + bent.T[:, place] + np.outer(
        step * rng.standard_normal(count), bow)  # fmt: skip
    force += sources.force_noise_n * rng.standard_normal(force.shape)
    force = _quantised(force, sources.force_resolution_n, rng.uniform(size=(count, 1)))
    # A tare takes out the mean reading in free air.
    force -= force[:, ends].mean(axis=1, keepdims=True)
    return Runs(force, travel, step, rough)


def _roughness(told: Conditions, count: int, rng: Rng) -> FloatArray:
    """(R,) roughness lengths: near the stated one, or of a surface of unstated roughness."""
    if told.rough_length_m is not None:
        stated = told.rough_length_sigma
        sigma = stated if stated > ROUGH_LENGTH_SIGMA else ROUGH_SIGMA
        return np.asarray(told.rough_length_m * np.exp(sigma * rng.standard_normal(count)))
    drawn = np.exp(rng.uniform(math.log(FINEST_M), math.log(ROUGHEST_M), count))
    return np.where(rng.uniform(size=count) < 0.5, drawn, 0.0)


def _system(told: Conditions, forces: FloatArray, gain: FloatArray, rng: Rng) -> FloatArray:
    """(R, M) true deflection of the load path; the gain of the sensor was in its calibration."""
    count = gain.size
    deflection = np.stack([told.bend(forces * (1.0 + float(each))) for each in gain[:, 0]])
    modes = told.bend_sigma(forces)
    deflection += rng.standard_normal((count, modes.shape[0])) @ modes
    rows = told.table_sigma(forces)
    if rows.any():
        deflection += rows * _curves(told, forces, count, rng)
    return deflection


def _curves(told: Conditions, forces: FloatArray, count: int, rng: Rng) -> FloatArray:
    """(R, M) random smooth functions of force with unit variance and uncertain lengths."""
    top_n = float(forces.max())
    stated = told.sources.smooth_length_n
    low, high = (
        (SHORTEST * top_n, LONGEST * top_n)
        if stated is None
        else (stated / LENGTH_FACTOR, stated * LENGTH_FACTOR)
    )
    lengths = np.exp(rng.uniform(math.log(low), math.log(high), _LENGTHS))
    grid = np.linspace(0.0, top_n, _GRID)
    cut = np.clip(np.searchsorted(grid, forces) - 1, 0, _GRID - 2)
    share = (forces - grid[cut]) / (grid[1] - grid[0])
    found = np.empty((count, forces.size))
    for part, length_n in zip(np.array_split(np.arange(count), _LENGTHS), lengths, strict=True):
        root = np.linalg.cholesky(smooth_correlation(grid, float(length_n)) + 1e-6 * np.eye(_GRID))
        knots = rng.standard_normal((part.size, _GRID)) @ root.T
        found[part] = knots[:, cut] * (1.0 - share) + knots[:, cut + 1] * share
    return found


def _add_smooth(travel: FloatArray, told: Conditions, run: Course, rng: Rng) -> None:
    """The error of the kinematics, nearly the same in every branch."""
    sources, count = told.sources, travel.shape[0]
    if sources.smooth_error_m == 0.0:
        return
    size = np.full((count, 1), sources.smooth_error_m)
    if sources.smooth_degrees is not None:
        degrees = max(sources.smooth_degrees, 1.0)
        size *= np.sqrt(degrees / rng.chisquare(degrees, (count, 1)))
    forces, place = np.unique(run.force_n, return_inverse=True)
    travel += size * _curves(told, forces, count, rng)[:, place]
    own = size * rng.uniform(0.0, NOT_REPEATED, (count, 1))
    for cycle in (1, 2):
        for loading in (True, False):
            part = run.branch(cycle, loading=loading)
            inside = slice(part[0].start, part[-1].stop)
            here, where = np.unique(run.force_n[inside], return_inverse=True)
            travel[:, inside] += own * _curves(told, here, count, rng)[:, where]


def _add_creep(travel: FloatArray, body: FloatArray, share: FloatArray, rng: Rng) -> None:
    """Add delayed deformation, with one time constant in each run."""
    taus = rng.integers(len(CREEP_TAUS_S), size=share.size)
    for number, tau_s in enumerate(CREEP_TAUS_S):
        rows = np.flatnonzero((taus == number) & (share > 0.0))
        if rows.size:
            keep = math.exp(-1.0 / (RATE_HZ * tau_s))
            late = lfilter([1.0 - keep], [1.0, -keep], body[rows], axis=1)
            travel[rows] += share[rows, None] * late


def _add_loop(travel: FloatArray, run: Course, payload: Payload, loss: FloatArray) -> None:
    """Add hysteresis: the unloading lies beyond the loading, equally in both cycles."""
    q = 1.0 / payload.exponent
    area = 4.0 * (1.0 / (q + 1.0) - 1.0 / (2.0 * q + 1.0))
    height = loss * payload.at_n / payload.secant_n_per_m / ((payload.exponent + 1.0) * area)
    for cycle in (1, 2):
        part = run.branch(cycle, loading=False)
        inside = slice(part[0].start, part[-1].stop)
        share = (run.force_n[inside] / run.top_n) ** q
        travel[:, inside] += np.outer(height, 4.0 * share * (1.0 - share))


def _add_in_time(travel: FloatArray, cell: Cell, run: Course, rng: Rng) -> None:
    """Add drift over the run, and thermal growth over a loading."""
    sources, count = cell.conditions.sources, travel.shape[0]
    loading = run.branch(1, loading=True)
    loading_s = float(run.time_s[loading[-1].stop - 1] - run.time_s[loading[0].start])
    depth_m = cell.payload.at_n / cell.payload.secant_n_per_m
    rate = DRIFT_SHARE * depth_m * rng.uniform(-1.0, 1.0, count) / DEFAULT.cycle_s
    growth = sources.temperature_sigma_k * sources.position_m_per_k
    rate += growth * rng.standard_normal(count) / loading_s
    travel += np.outer(rate, run.time_s)


def _add_lag(travel: FloatArray, run: Course, lag_s: FloatArray) -> None:
    """Add the error of a time lag of the travel: its rate times the lag."""
    rate = np.diff(travel, axis=1, prepend=travel[:, :1]) * RATE_HZ
    travel += np.where(_moving(run), rate * lag_s[:, None], 0.0)


def _add_damping(travel: FloatArray, cell: Cell, run: Course) -> None:
    """Subtract the reduction of the deflection by damping in a steady ramp: C_s/K_s² dF/dt."""
    stiffness = cell.conditions.sources.system_stiffness_n_per_m
    if stiffness is None:
        return
    rate = np.diff(run.force_n, prepend=run.force_n[0]) * RATE_HZ
    travel -= np.where(_moving(run), rate * cell.damping_n_s_per_m / stiffness**2, 0.0)


def _moving(run: Course) -> BoolArray:
    """(N,) the samples of the ramps, but for the first of each."""
    found = np.zeros(run.force_n.size, dtype=bool)
    for each in run.stretches:
        if not each.held:
            found[each.start + 1 : each.stop] = True
    return found


def _quantised(values: FloatArray, quantum: float, offset: FloatArray) -> FloatArray:
    if quantum <= 0.0:
        return values
    return np.asarray((np.round(values / quantum + offset) - offset) * quantum)
