"""A second implementation of chord, tangent, secant and exponent, beside the product's.

    python -m stepload_verify.trials.second --curves 50

It is written from the equations of docs/identify.md: generalised least squares of the first
loading and of the top of the second, with the covariance of the stated errors. Both get the same
samples of the worlds of `sharp`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize_scalar

from stepload_verify.trials.boundary.curves import contacts
from stepload_verify.trials.sharp import NEAR, TOUCH_N, World, drawn, of_contacts, of_plan, rows
from stepload_verify.trials.sharp import weigh as product

Array = NDArray[np.float64]
HOME = Path(__file__).parents[3]
PLANS = ("procedures/plastic-sphere.yaml", "bench/sharp/ur5e-silicone.yaml")
BINS = 6
"""Parts of a ramp between two holds, of one mean each."""
NORMAL_95 = 1.96


@dataclass(frozen=True)
class Means:
    """Means over holds and parts of ramps (N,), with the error that differs from mean to mean."""

    force_n: Array
    deformation_m: Array
    time_s: Array
    force_sigma_n: Array
    deformation_sigma_m: Array

    def __add__(self, other: Means) -> Means:
        return Means(*(np.append(a, b) for a, b in zip(vars(self).values(),
                                                       vars(other).values(), strict=True)))  # fmt: skip


@dataclass(frozen=True)
class Figure:
    """A value, its relative standard uncertainty, and the forces in N that it is of."""

    value: float
    relative: float
    from_n: float
    to_n: float

    @property
    def interval(self) -> tuple[float, float]:
        spread = math.exp(NORMAL_95 * self.relative)
        return self.value / spread, self.value * spread


def means(track: Any, errors: Any, parts: Sequence[NDArray[np.intp]]) -> Means:
    """Means of force, deformation and time, with noise and what the dither leaves of the quanta."""
    quanta = errors.force_resolution_n, errors.position_resolution_m
    noises = errors.force_noise_n, errors.position_noise_m
    found = []
    for part in parts:
        force_n, travel_m = track.force_n[part], track.travel_m[part]
        sigmas = []
        for values, quantum, noise in zip((force_n, travel_m), quanta, noises, strict=True):
            left = quantum / math.pi * math.exp(-2.0 * (math.pi * noise / quantum) ** 2)
            passed = max(1.0, abs(float(values[-1] - values[0])) / quantum)
            white = (noise**2 + quantum**2 / 12.0) / part.size
            sigmas.append(math.sqrt(white + (left / passed) ** 2 / 2.0))
        bend_m = force_n / errors.system_stiffness_n_per_m
        found.append((force_n.mean(), (travel_m - bend_m).mean(), track.time_s[part].mean(), *sigmas))
    return Means(*np.array(found).T)


def parts_of(held: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Samples of each hold, and of the parts of each ramp."""
    ways = np.split(np.arange(held.size), np.flatnonzero(np.diff(held)) + 1)
    cut = [[way] if held[way[0]] else np.array_split(way, BINS) for way in ways]
    return [part for each in cut for part in each if part.size]


def covariance(points: Means, slope_m_per_n: Array, errors: Any, zero_n: float) -> Array:
    """Covariance of the deformations in m²; errors of the force act by the compliance."""
    force_n, top_n = points.force_n, float(points.force_n.max())
    bend = 1.0 / errors.system_stiffness_n_per_m
    whole = slope_m_per_n + bend
    kernel = np.exp(-0.5 * (np.subtract.outer(force_n, force_n) / errors.smooth_length_n) ** 2)
    table_m = np.zeros(force_n.size)
    if errors.deflection_force_n:
        sigmas = (0.0, *errors.deflection_sigma_m)
        table_m = np.interp(force_n, (0.0, *errors.deflection_force_n), sigmas)
    common = (
        bend * force_n * errors.system_stiffness_sigma_n_per_m / errors.system_stiffness_n_per_m,
        slope_m_per_n * force_n * errors.gain_sigma,
        whole * 4.0 * errors.nonlinearity / math.sqrt(3.0) * force_n * (1.0 - force_n / top_n),
        whole * zero_n,
    )
    own = points.deformation_sigma_m**2 + (whole * points.force_sigma_n) ** 2
    total = np.diag(own) + kernel * (errors.smooth_error_m**2 + np.outer(table_m, table_m))
    return np.asarray(total + sum(np.outer(each, each) for each in common))


def solved(rows_m: Array, seen_m: Array, factor: Array) -> tuple[Array, Array, float]:
    """Parameters of generalised least squares, their covariance, and χ²."""
    normal = np.linalg.inv(rows_m.T @ cho_solve((factor, True), rows_m))
    fitted = normal @ rows_m.T @ cho_solve((factor, True), seen_m)
    left = seen_m - rows_m @ fitted
    return fitted, normal, float(left @ cho_solve((factor, True), left))


def figures(run: Any) -> Mapping[str, Figure]:
    """Chord, tangent and secant in N/m, and n, of the first loading of a run."""
    errors, asked_n = run.conditions.sources, run.conditions.secant_force_n
    ups = [up for _, up, _ in run.tracks]
    points = means(ups[0], errors, parts_of(ups[0].held))
    top_n = float(points.force_n[-1])
    if len(ups) > 1:  # the travel from top to top shows the drift
        points += means(ups[1], errors, [np.flatnonzero(ups[1].held == ups[1].held.max())])
    seen_m, scale_s = points.deformation_m, float(points.time_s.max())
    drift = points.time_s[:, None] / scale_s
    if len(ups) < 2:
        drift = drift[:, :0]
    u = points.force_n / top_n

    def power(q: float, *powers: float) -> Array:
        return np.hstack([np.stack([u ** (q * p) for p in (0.0, *powers)], axis=1), drift])

    slope, q = np.full(u.size, seen_m.max() / top_n), 2.0 / 3.0
    for _ in range(3):
        factor = cholesky(covariance(points, slope, errors, run.zero_step_n / 2.0), lower=True)
        q = float(minimize_scalar(
            lambda q: solved(power(q, 1.0), seen_m, factor)[2], bounds=(0.3, 1.3), method="bounded",
            options={"xatol": 1e-6},
        ).x)  # fmt: skip
        fitted, _, _ = solved(power(q, 1.0), seen_m, factor)
        slope = fitted[1] * q * u ** (q - 1.0) / top_n
    deep = fitted[1] * u**q * np.log(u)
    _, spread, _ = solved(np.column_stack([power(q, 1.0), deep]), seen_m, factor)
    at_n = min(asked_n, top_n)
    v = at_n / top_n
    turn = np.zeros(len(spread))
    turn[1], turn[-1] = 1.0 / fitted[1], math.log(v)
    secant = at_n / (fitted[1] * v**q)
    found = {
        "secant_from_touch": Figure(secant, math.sqrt(turn @ spread @ turn), 0.0, at_n),
        "n": Figure(1.0 / q, math.sqrt(spread[-1, -1]) / q, 0.0, top_n),
    }
    fitted, spread, _ = solved(power(q, 1.0, 2.0), seen_m, factor)
    powers = np.array([q, 2.0 * q])
    steep = powers * v ** (powers - 1.0) / top_n
    for kind, gain, rise_n, from_n, to_n in (
        ("chord", 1.0 - 0.1**powers, 0.9 * top_n, 0.1 * top_n, top_n),
        ("tangent", steep, 1.0, at_n, at_n),
    ):
        rise_m = float(gain @ fitted[1:3])
        relative = math.sqrt(gain @ spread[1:3, 1:3] @ gain) / rise_m
        found[kind] = Figure(rise_n / rise_m, relative, from_n, to_n)
    return found


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
class Pair:
    """One figure of one curve: its truth, and half widths, errors and lines of both.

    Those of stiffnesses are logarithmic; those of n are its own.
    """

    name: str
    seed: int
    kind: str
    first: tuple[float, float, bool]
    second: tuple[float, float, bool]

    @property
    def apart(self) -> float:
        """Difference of the values over the product's half width."""
        return (self.second[0] - self.first[0]) / self.first[1]

    @property
    def ratio(self) -> float:
        return self.second[1] / self.first[1]


def pairs(worlds: Sequence[World], curves: int) -> Iterator[Pair]:
    """Figures of both from the same samples, world after world, each curve of its own seed."""
    for seed in range(curves):
        world = worlds[seed % len(worlds)]
        run = drawn(world.run, np.random.default_rng([43, seed]))
        own = figures(run)
        for kind, row in rows(world, product(run)):
            figure = own[kind]
            true = truth(world, kind, figure)
            low, high = figure.interval
            held = low <= true <= high
            if kind == "n":
                mine = figure.value - true, (high - low) / 2.0, held
            else:
                mine = math.log(figure.value / true), math.log(high / low) / 2.0, held
            yield Pair(world.name, seed, kind, (row.error, row.half, row.held), mine)


def all_worlds() -> list[World]:
    """Two plans by their theory, and the bodies of boundary elements."""
    of_plans = [of_plan(HOME / each) for each in PLANS]
    return of_plans + list(of_contacts(HOME / PLANS[0], list(contacts())))


def main() -> None:
    """Print the table, then the curves on which the two differ."""
    parser = argparse.ArgumentParser(description="The product against a second implementation.")
    parser.add_argument("--curves", type=int, default=50)
    parser.add_argument("--each", action="store_true", help="every curve that differs")
    told = parser.parse_args()
    found = list(pairs(all_worlds(), told.curves))
    print("figure             curves  apart: max   rms  ratio: median   min   max  held: first second")
    for kind in dict.fromkeys(each.kind for each in found):
        own = [each for each in found if each.kind == kind]
        apart = np.abs([each.apart for each in own])
        ratio = np.array([each.ratio for each in own])
        held = np.mean([(each.first[2], each.second[2]) for each in own], axis=0)
        print(
            f"{kind:18} {len(own):6} {apart.max():11.2f} {math.sqrt(np.mean(apart**2)):5.2f}"
            f" {np.median(ratio):14.2f} {ratio.min():5.2f} {ratio.max():5.2f}"
            f" {held[0]:12.3f} {held[1]:6.3f}"
        )
    for each in found if told.each else ():
        if abs(each.apart) > 0.25 or not 0.75 <= each.ratio <= 1.25:
            print(
                f"{each.seed:3} {each.name:36} {each.kind:18} apart {each.apart:+5.2f}"
                f" ratio {each.ratio:4.2f} error {each.first[0]:+.4f} {each.second[0]:+.4f}"
                f" half {each.first[1]:.4f} {each.second[1]:.4f}"
            )


if __name__ == "__main__":
    main()
