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

from stepload_verify.trials.boundary.curves import contacts
from stepload_verify.trials.sharp import NEAR, TOUCH_N, World, drawn, of_contacts, of_plan, rows
from stepload_verify.trials.sharp import weigh as product

Array = NDArray[np.float64]
HOME = Path(__file__).parents[3]
PLANS = ("procedures/plastic-sphere.yaml", "bench/sharp/ur5e-silicone.yaml")
BINS = 12
"""Parts of a ramp between two holds, of one mean each."""
STEP = 1e-3


@dataclass(frozen=True)
class Figure:
    """A value, its relative standard uncertainty, and the forces in N that it is of."""

    value: float
    relative: float
    from_n: float
    to_n: float

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval."""
        spread = math.exp(1.96 * self.relative)
        return self.value / spread, self.value * spread


def parts_of(held: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Samples of each hold, and of the parts of each ramp."""
    ways = np.split(np.arange(held.size), np.flatnonzero(np.diff(held)) + 1)
    cut = [[way] if held[way[0]] else np.array_split(way, BINS) for way in ways]
    return [part for each in cut for part in each if part.size]


def means(track: Any, errors: Any, parts: Sequence[NDArray[np.intp]]) -> Array:
    """Means (3, N) of force, deformation and time, and (2, N) the standard uncertainties that
    noise and quanta leave of force and deformation."""
    kinds = (
        (track.force_n, errors.force_resolution_n, errors.force_noise_n),
        (track.travel_m, errors.position_resolution_m, errors.position_noise_m),
    )
    found = []
    for part in parts:
        sigmas = []
        for values, quantum, noise in kinds:
            # What the noise leaves of a quantum; less where the part crosses several.
            left = quantum / math.pi * math.exp(-2.0 * (math.pi * noise / quantum) ** 2)
            left /= max(1.0, abs(float(values[part[-1]] - values[part[0]])) / quantum)
            white = (noise**2 + quantum**2 / 12.0) / part.size
            sigmas.append(math.sqrt(white + left**2 / 2.0))
        force_n, travel_m = float(track.force_n[part].mean()), float(track.travel_m[part].mean())
        deformation_m = travel_m - force_n / errors.system_stiffness_n_per_m
        found.append((force_n, deformation_m, float(track.time_s[part].mean()), *sigmas))
    return np.array(found).T


def covariance(points: Array, slope_m_per_n: Array, errors: Any, zero_n: float) -> Array:
    """Covariance (N, N) of the deformations in m²; an error of force acts by the compliance."""
    force_n, _, _, force_sigma_n, deformation_sigma_m = points
    top_n, bend = float(force_n.max()), 1.0 / errors.system_stiffness_n_per_m
    whole = slope_m_per_n + bend
    kernel = np.exp(-0.5 * (np.subtract.outer(force_n, force_n) / errors.smooth_length_n) ** 2)
    table_m = np.zeros(force_n.size)
    if errors.deflection_force_n:
        table_m = np.interp(force_n, errors.deflection_force_n, errors.deflection_sigma_m)
    bow_n = 4.0 * errors.nonlinearity / math.sqrt(3.0) * force_n * (1.0 - force_n / top_n)
    common = np.stack([
        bend**2 * force_n * errors.system_stiffness_sigma_n_per_m,
        slope_m_per_n * force_n * errors.gain_sigma,
        whole * bow_n,
        whole * zero_n,
    ])  # fmt: skip
    own = np.diag(deformation_sigma_m**2 + (whole * force_sigma_n) ** 2)
    smooth = kernel * (errors.smooth_error_m**2 + np.outer(table_m, table_m))
    return np.asarray(own + smooth + common.T @ common)


def figures(run: Any) -> Mapping[str, Figure]:
    """Chord, tangent and secant in N/m, and n, of the first loading of a run of two cycles."""
    errors = run.conditions.sources
    first, second = (up for _, up, _ in run.tracks[:2])
    points = means(first, errors, parts_of(first.held))
    top_n = float(points[0, -1])
    top = np.flatnonzero(second.held == second.held.max())
    points = np.hstack([points, means(second, errors, [top])])
    u, seen_m, time_s = points[0] / top_n, points[1], points[2] / points[2].max()
    unit = np.ones_like(u)

    def estimator(*columns: Array) -> Array:
        stacked = np.stack([unit, time_s, *columns], axis=1)
        return np.asarray(np.linalg.pinv(white @ stacked) @ white)[2:]

    def left(q: float) -> float:
        columns = white @ np.stack([unit, time_s, u**q], axis=1)
        seen = white @ seen_m
        return float(((columns @ np.linalg.lstsq(columns, seen)[0] - seen) ** 2).sum())

    q, slope = 2.0 / 3.0, np.full(u.size, np.ptp(seen_m) / top_n)
    for _ in range(3):
        errors_m2 = covariance(points, slope, errors, run.zero_step_n / 2.0)
        white = np.linalg.inv(np.linalg.cholesky(errors_m2))
        q = float(minimize_scalar(left, bounds=(0.3, 1.3), method="bounded").x)
        size_m = float(estimator(u**q)[0] @ seen_m)
        slope = size_m * q * u ** (q - 1.0) / top_n

    at_n = min(run.conditions.secant_force_n, top_n)
    v = at_n / top_n
    of_size, of_q = estimator(u**q, size_m * u**q * np.log(u))

    def figure(weights: Array, q_weights: Array, rise_n: float, *forces_n: float) -> Figure:
        rise_m = float(weights @ seen_m)
        both = weights + q_weights
        return Figure(
            rise_n / rise_m, math.sqrt(both @ errors_m2 @ both) / abs(rise_m), *forces_n
        )  # fmt: skip

    def chord(q: float) -> Array:
        return np.array([1.0 - 0.1**q, 1.0 - 0.01**q]) @ estimator(u**q, u ** (2.0 * q))

    def tangent(q: float) -> Array:
        steep = np.array([q * v**q, 2.0 * q * v ** (2.0 * q)]) / at_n
        return np.asarray(steep @ estimator(u**q, u ** (2.0 * q)))

    def turned(weights: Callable[[float], Array]) -> Array:
        """What a change of q, fitted to the same data, adds to the weights."""
        change = weights(q + STEP) - weights(q - STEP)
        return float(change @ seen_m) / (2.0 * STEP) * of_q

    spread = math.sqrt(of_q @ errors_m2 @ of_q)
    deep = v**q * size_m * math.log(v) * of_q
    return {
        "chord": figure(chord(q), turned(chord), 0.9 * top_n, 0.1 * top_n, top_n),
        "secant_from_touch": figure(v**q * of_size, deep, at_n, 0.0, at_n),
        "tangent": figure(tangent(q), turned(tangent), 1.0, at_n, at_n),
        "n": Figure(1.0 / q, spread / q, 0.0, top_n),
    }


def pairs(curves: int) -> Iterator[tuple[World, str, Array]]:
    """World, kind, and error, half width and whether it held (2, 3) of product and second.

    Errors and half widths of stiffnesses are logarithmic; those of n are its own.
    """
    worlds = [of_plan(HOME / each) for each in PLANS]
    worlds += of_contacts(HOME / PLANS[0], list(contacts()))
    for seed in range(curves):
        world = worlds[seed % len(worlds)]
        run = drawn(world.run, np.random.default_rng([43, seed]))
        own = figures(run)
        for kind, row in rows(world, product(run)):
            true, (low, high) = truth(world, kind, own[kind]), own[kind].interval
            ends = np.array([low, own[kind].value, high])
            low, value, high = ends - true if kind == "n" else np.log(ends / true)
            second = value, (high - low) / 2.0, low <= 0.0 <= high
            yield world, kind, np.array([(row.error, row.half, row.held), second], dtype=float)


def truth(world: World, kind: str, figure: Figure) -> float:
    """The same figure of the world's law."""
    if kind == "n":
        return world.n
    from_n, to_n = figure.from_n, figure.to_n
    if kind == "tangent":
        from_n, to_n = (1.0 - NEAR) * to_n, (1.0 + NEAR) * to_n
    low_m, high_m = world.loading(np.array([max(from_n, TOUCH_N), to_n]))
    return (to_n - from_n) / float(high_m - (low_m if from_n > 0.0 else 0.0))


@dataclass(frozen=True)
class Agreement:
    """One figure over all curves.

    `most` and `rms` of the difference of the values over the product's half width; `ratio` of the
    half widths, second over product (least, median, largest); of both in this order the share that
    held and the median half width over 1.96 rms error.
    """

    most: float
    rms: float
    ratio: tuple[float, float, float]
    held: tuple[float, float]
    sharp: tuple[float, float]


def agreements(curves: int) -> Mapping[str, Agreement]:
    """What both say of the same curves, by figure."""
    found: dict[str, list[Array]] = {}
    for _, kind, pair in pairs(curves):
        found.setdefault(kind, []).append(pair)
    return {kind: _agreement(np.array(each)) for kind, each in found.items()}


def _agreement(pair: Array) -> Agreement:
    error, half, held = np.moveaxis(pair, 2, 0)
    apart = np.abs(error[:, 1] - error[:, 0]) / half[:, 0]
    ratio = half[:, 1] / half[:, 0]
    sharp = np.median(half, axis=0) / (1.96 * np.sqrt(np.mean(error**2, axis=0)))
    return Agreement(
        float(apart.max()),
        float(np.sqrt(np.mean(apart**2))),
        (float(ratio.min()), float(np.median(ratio)), float(ratio.max())),
        (float(held[:, 0].mean()), float(held[:, 1].mean())),
        (float(sharp[0]), float(sharp[1])),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="The product against a second implementation.")
    parser.add_argument("--curves", type=int, default=50)
    told = parser.parse_args()
    print(
        "figure             apart: most   rms  half widths: least median  most"
        "  held: product second  over 1.96 rms"
    )
    for kind, each in agreements(told.curves).items():
        least, median, most = each.ratio
        print(
            f"{kind:18} {each.most:11.2f} {each.rms:5.2f} {least:19.2f} {median:6.2f} {most:5.2f}"
            f" {each.held[0]:14.3f} {each.held[1]:6.3f} {each.sharp[0]:8.2f} {each.sharp[1]:5.2f}"
        )


if __name__ == "__main__":
    main()
