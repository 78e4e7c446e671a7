"""A second implementation of chord, tangent, secant and exponent beside the product's.

    python -m stepload_verify.trials.second --curves 50

It follows the equations of docs/identify.md: generalised least squares over the first loading, and
the top of the second for the drift. Both get the same samples, of the worlds of `sharp`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from stepload_verify.trials import sharp
from stepload_verify.trials.boundary.curves import contacts
from stepload_verify.trials.sharp import NEAR, TOUCH_N, World, of_contacts, of_plan

Array = NDArray[np.float64]
HOME = Path(__file__).parents[3]
PLANS = ("procedures/plastic-sphere.yaml", "bench/sharp/ur5e-silicone.yaml")
BINS, STEP = 12, 1e-3
"""Parts of a ramp between two holds, of one mean each; step of q of a derivative."""


@dataclass(frozen=True)
class Figure:
    """A value, its relative standard uncertainty, and the forces in N that it is of."""

    value: float
    relative: float
    from_n: float
    to_n: float


def parts_of(held: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Samples of each hold, and of the parts of each ramp."""
    ways = np.split(np.arange(held.size), np.flatnonzero(np.diff(held)) + 1)
    cut = [[way] if held[way[0]] else np.array_split(way, BINS) for way in ways]
    return [part for each in cut for part in each if part.size]


def means(track: Any, errors: Any, parts: Sequence[NDArray[np.intp]]) -> Array:
    """(5, N): means of force, deformation and time; what noise and quanta leave of the first two,
    less where a part crosses several quanta."""
    sampled, found = (track.force_n, track.travel_m, track.time_s), []
    quanta = errors.force_resolution_n, errors.position_resolution_m
    noises = errors.force_noise_n, errors.position_noise_m
    for part in parts:
        sigmas = []
        for values, quantum, noise in zip(sampled, quanta, noises, strict=False):
            left = quantum / math.pi * math.exp(-2.0 * (math.pi * noise / quantum) ** 2)
            left /= max(1.0, abs(float(values[part[-1]] - values[part[0]])) / quantum)
            white = (noise**2 + quantum**2 / 12.0) / part.size
            sigmas.append(math.sqrt(white + left**2 / 2.0))
        force_n, travel_m, time_s = (float(each[part].mean()) for each in sampled)
        bend_m = force_n / errors.system_stiffness_n_per_m
        found.append((force_n, travel_m - bend_m, time_s, *sigmas))
    return np.array(found).T


def covariance(points: Array, slope_m_per_n: Array, errors: Any, zero_n: float) -> Array:
    """Covariance (N, N) of the deformations in m²; an error of force acts by the compliance."""
    force_n, _, _, force_sigma_n, deformation_sigma_m = points
    top_n, bend = float(force_n.max()), 1.0 / errors.system_stiffness_n_per_m
    whole = slope_m_per_n + bend
    kernel = np.exp(-0.5 * (np.subtract.outer(force_n, force_n) / errors.smooth_length_n) ** 2)
    table = errors.deflection_force_n or (0.0,), errors.deflection_sigma_m or (0.0,)
    table_m = np.interp(force_n, *table)
    bow_n = 4.0 * errors.nonlinearity / math.sqrt(3.0) * force_n * (1.0 - force_n / top_n)
    system_m = bend**2 * force_n * errors.system_stiffness_sigma_n_per_m
    scale_m = slope_m_per_n * force_n * errors.gain_sigma
    common = np.stack([system_m, scale_m, whole * bow_n, whole * zero_n])
    own = np.diag(deformation_sigma_m**2 + (whole * force_sigma_n) ** 2)
    smooth = kernel * (errors.smooth_error_m**2 + np.outer(table_m, table_m))
    return np.asarray(own + smooth + common.T @ common)


def figures(run: Any) -> Mapping[str, Figure]:
    """Chord, tangent and secant in N/m, and n, of the first loading of a run of two cycles."""
    errors = run.conditions.sources
    first, second = (up for _, up, _ in run.tracks[:2])
    points = means(first, errors, parts_of(first.held))
    top_n = float(points[0, -1])
    again = means(second, errors, [np.flatnonzero(second.held == second.held.max())])
    points = np.hstack([points, again])
    u, seen_m, time_s = points[0] / top_n, points[1], points[2] / points[2].max()

    def columns(*shapes: Array) -> Array:
        return np.asarray(white @ np.stack([*shapes, np.ones_like(u), time_s], axis=1))

    def estimator(*shapes: Array) -> Array:
        return np.asarray(np.linalg.pinv(columns(*shapes)) @ white)[: len(shapes)]

    def chi2(q: float) -> float:
        return float(np.linalg.lstsq(columns(u**q), white @ seen_m, rcond=None)[1][0])

    q, slope = 2.0 / 3.0, np.full(u.size, np.ptp(seen_m) / top_n)
    for _ in range(3):
        errors_m2 = covariance(points, slope, errors, run.zero_step_n / 2.0)
        white = np.linalg.inv(np.linalg.cholesky(errors_m2))
        q = float(minimize_scalar(chi2, bounds=(0.3, 1.3), method="bounded").x)
        size_m = float(estimator(u**q)[0] @ seen_m)
        slope = size_m * q * u ** (q - 1.0) / top_n

    v = min(run.conditions.secant_force_n / top_n, 1.0)
    at_n = v * top_n
    of_size, of_q = estimator(u**q, size_m * u**q * np.log(u))

    def figure(weights: Array, of_q: Array, rise_n: float, from_n: float, to_n: float) -> Figure:
        rise_m, both = float(weights @ seen_m), weights + of_q
        relative = math.sqrt(both @ errors_m2 @ both) / abs(rise_m)
        return Figure(rise_n / rise_m, relative, from_n, to_n)

    def chord(q: float) -> Array:
        return np.array([1.0 - 0.1**q, 1.0 - 0.01**q]) @ estimator(u**q, u ** (2.0 * q))

    def tangent(q: float) -> Array:
        steep = np.array([q * v**q, 2.0 * q * v ** (2.0 * q)]) / at_n
        return np.asarray(steep @ estimator(u**q, u ** (2.0 * q)))

    def turned(weights: Callable[[float], Array]) -> Array:
        """What a change of q, fitted to the same data, adds to the weights."""
        change = weights(q + STEP) - weights(q - STEP)
        return np.asarray(float(change @ seen_m) / (2.0 * STEP) * of_q)

    deep = v**q * size_m * math.log(v) * of_q
    return {
        "chord": figure(chord(q), turned(chord), 0.9 * top_n, 0.1 * top_n, top_n),
        "secant_from_touch": figure(v**q * of_size, deep, at_n, 0.0, at_n),
        "tangent": figure(tangent(q), turned(tangent), 1.0, at_n, at_n),
        "n": Figure(1.0 / q, math.sqrt(of_q @ errors_m2 @ of_q) / q, 0.0, top_n),
    }


def pairs(curves: int) -> Iterator[tuple[str, Array]]:
    """Figure, and (2, 3) error, half width (logarithmic but those of n) and whether it held, of
    product and second."""
    worlds = [of_plan(HOME / each) for each in PLANS]
    worlds += of_contacts(HOME / PLANS[0], list(contacts()))
    for seed in range(curves):
        world = worlds[seed % len(worlds)]
        own = figures(sharp.drawn(world.run, np.random.default_rng([43, seed])))
        product = sharp.stated(world, np.random.default_rng([43, seed]))
        for kind, row in sharp.rows(world, product):
            true = truth(world, kind, own[kind])
            ends = own[kind].value * np.exp(1.96 * own[kind].relative * np.array([-1.0, 0.0, 1.0]))
            low, value, high = ends - true if kind == "n" else np.log(ends / true)
            second = value, (high - low) / 2.0, low <= 0.0 <= high
            yield kind, np.array([(row.error, row.half, row.held), second], dtype=float)


def truth(world: World, kind: str, figure: Figure) -> float:
    """The same figure of the world's law."""
    if kind == "n":
        return world.n
    from_n, to_n = figure.from_n, figure.to_n
    if kind == "tangent":
        from_n, to_n = (1.0 - NEAR) * to_n, (1.0 + NEAR) * to_n
    low_m, high_m = world.loading(np.array([max(from_n, TOUCH_N), to_n]))
    return (to_n - from_n) / float(high_m - (low_m if from_n > 0.0 else 0.0))


def agreements(curves: int) -> Mapping[str, Array]:
    """Of each figure nine numbers: difference of the values over the product's half width (largest,
    rms); half widths, second over product (least, median, largest); of product and second the share
    that held, and the median half width over 1.96 rms error."""
    found: dict[str, list[Array]] = {}
    for kind, pair in pairs(curves):
        found.setdefault(kind, []).append(pair)
    return {kind: _agreement(*np.moveaxis(np.array(each), 2, 0)) for kind, each in found.items()}


def _agreement(error: Array, half: Array, held: Array) -> Array:
    apart, ratio = (error[:, 1] - error[:, 0]) / half[:, 0], half[:, 1] / half[:, 0]
    sharp = np.median(half, axis=0) / (1.96 * np.sqrt(np.mean(error**2, axis=0)))
    most, rms = np.abs(apart).max(), np.sqrt(np.mean(apart**2))
    return np.array([most, rms, *np.quantile(ratio, [0.0, 0.5, 1.0]), *held.mean(axis=0), *sharp])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="The product against a second implementation.")
    parser.add_argument("--curves", type=int, default=50)
    print("figure              apart: most, rms   half widths: least, median, most   held   sharp")
    for kind, each in agreements(parser.parse_args().curves).items():
        print(f"{kind:20}", *(f"{value:6.3f}" for value in each.tolist()))


if __name__ == "__main__":
    main()
