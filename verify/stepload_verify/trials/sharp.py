"""Worlds whose errors are as a plan states them: do the intervals hold, and are they narrow?

A world is a run without error and the law of its payload. Each draw spoils it with K_s, its table,
the smooth error, gain, linearity, drift, noise and quanta of the sizes that are stated.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stepload.errors import SteploadError
from stepload.feasibility.conditions import expected_result
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.identification.conditions import Conditions
from stepload.identification.expected import SAMPLES_HZ
from stepload.identification.fit import FloatArray
from stepload.identification.loops import Track
from stepload.identification.quantity import ResultVerdict
from stepload.identification.run_data import RunData
from stepload.identification.smooth import NORMAL_95, smooth_correlation
from stepload.identification.verdict import Judgement, judge
from stepload.plan.load import load_plan
from stepload.record.curves import Curve
from stepload.report.conditions import Stated
from stepload.report.curve import prepare
from stepload_verify.trials.boundary.curves import Contact

Law = Callable[[FloatArray], FloatArray]
GRID = 60
DRIFT_M_PER_S = 0.5e-6 / 60.0
"""Standard deviation of an even drift of the travel. It is stated nowhere: two cycles show it."""
NEAR = 1e-3
TOUCH_N = 1e-3
FREE_M, FREE_S, FOOT_S = 30e-6, 1.0, 0.25
"""Of a curve: how far it is pulled back, how long in free air, and how long to its first force."""


@dataclass(frozen=True, slots=True)
class World:
    """A run without error, and its payload: deformation (N,) in m at forces (N,) along the first
    loading and along all that follows, and its exponent."""

    name: str
    run: RunData
    loading: Law
    again: Law
    n: float


Ask = Callable[[World, np.random.Generator], Judgement]


@dataclass(frozen=True, slots=True)
class Row:
    """Error of one figure, half of its interval, whether it held and was identified.

    Error and half width of a stiffness are logarithmic; those of n are its own.
    """

    error: float
    half: float
    held: bool
    identified: bool


@dataclass(frozen=True, slots=True)
class Score:
    """Rows of a figure in numbers: shares, median half width, and that over 1.96 rms error."""

    runs: int
    held: float
    identified: float
    true: float
    half: float
    ratio: float


def of_plan(path: Path) -> World:
    """A plan's payload by its theory, smooth."""
    preflight = _smooth(path)
    law = preflight.theory.stiffest
    run = expected_result(preflight.plan, preflight.theory, preflight.loading_times).run

    def deformation(force_n: FloatArray) -> FloatArray:
        return np.asarray((force_n / law.k) ** (1.0 / law.n))

    return World(path.stem, run, deformation, deformation, law.n)


def of_contacts(path: Path, contacts: Sequence[Contact]) -> Iterator[World]:
    """Bodies in place of a plan's payload; of shape and surface nothing is stated."""
    planned = _smooth(path)
    run = expected_result(planned.plan, planned.theory, planned.loading_times).run
    told = replace(
        run.conditions, theory_k=None, theory_n=None, modulus_pa=None, elastic_limit_n=None,
        roughness_m=None, rough_length_m=None,
    )  # fmt: skip
    for contact in contacts:
        loading, again = contact.loading.at, (contact.again or contact.loading).at
        tracks = [
            (k, _pressed(up, loading if k == 1 else again, told),
             _pressed(down, again, told) if down else None)
            for k, up, down in run.tracks
        ]  # fmt: skip
        first_n = run.tracks[0][1].force_n
        n = contact.exponent(float(first_n.min()), float(first_n.max()))
        own = replace(run, tracks=tracks, conditions=told)
        yield World(contact.name, own, loading, again, n)


def _pressed(track: Track, law: Law, told: Conditions) -> Track:
    return replace(track, travel_m=law(track.force_n) + told.bend(track.force_n))


def _smooth(path: Path) -> Preflight:
    plan = load_plan(path)
    # A surface stated as rough makes the secants those of a rough contact, which this is not.
    return preflight_of(replace(plan, payload=replace(plan.payload, roughness_m=0.0)))


def drawn(run: RunData, rng: np.random.Generator) -> RunData:
    """The same run with errors drawn from what its conditions state.

    K_s was measured with the same sensor, so its gain cancels in the system's deflection.
    """
    told = run.conditions
    sources = told.sources
    top_n = max(float(up.force_n.max()) for _, up, _ in run.tracks)
    grid = np.linspace(0.0, top_n, GRID)
    length_n = sources.smooth_length_n or top_n / 6.0
    root = np.linalg.cholesky(smooth_correlation(grid, length_n) + 1e-9 * np.eye(GRID))
    smooth_m = sources.smooth_error_m * root @ rng.standard_normal(GRID)
    rows_m = told.table_sigma(grid) * (root @ rng.standard_normal(GRID))
    scale_m = told.bend_sigma(grid) * rng.standard_normal()
    wrong_m = smooth_m + rows_m + scale_m
    gain = 1.0 + sources.gain_sigma * rng.standard_normal()
    bow = sources.nonlinearity * rng.uniform(-1.0, 1.0)
    drift = DRIFT_M_PER_S * rng.standard_normal()

    def spoiled(track: Track) -> Track:
        true_n, size = track.force_n, track.force_n.size
        u = true_n / top_n
        force_n = gain * true_n + 4.0 * bow * top_n * u * (1.0 - u)
        force_n = force_n + sources.force_noise_n * rng.standard_normal(size)
        travel_m = track.travel_m + np.interp(true_n, grid, wrong_m) + drift * track.time_s
        travel_m = travel_m + told.bend(gain * true_n) - told.bend(true_n)
        travel_m = travel_m + sources.position_noise_m * rng.standard_normal(size)
        return replace(
            track,
            force_n=_rounded(force_n, sources.force_resolution_n),
            travel_m=_rounded(travel_m, sources.position_resolution_m),
        )

    tracks = [(k, spoiled(up), spoiled(down) if down else None) for k, up, down in run.tracks]
    return replace(run, tracks=tracks)


def _rounded(values: FloatArray, quantum: float) -> FloatArray:
    return np.round(values / quantum) * quantum if quantum > 0.0 else values


def rows(world: World, found: Judgement) -> Iterator[tuple[str, Row]]:
    """Every figure of the first loading against its truth."""
    for kind in ("chord", "secant_from_touch", "tangent"):
        each = found.quantities.get(kind)
        if each is None or not each.value_n_per_m > 0.0:
            yield kind, Row(math.nan, math.inf, held=True, identified=False)
            continue
        from_n, to_n = each.from_n, each.to_n
        if kind == "tangent":
            from_n, to_n = (1.0 - NEAR) * to_n, (1.0 + NEAR) * to_n
        low_m, high_m = world.loading(np.array([max(from_n, TOUCH_N), to_n]))
        true = (to_n - from_n) / float(high_m - (low_m if from_n > 0.0 else 0.0))
        low, high = each.interval_n_per_m
        yield kind, Row(
            math.log(each.value_n_per_m / true), math.log(high / low) / 2.0, low <= true <= high,
            each.verdict is ResultVerdict.IDENTIFIED,
        )  # fmt: skip
    if (n := found.exponent) is not None:
        low, high = n.interval
        yield "n", Row(
            n.value - world.n, (high - low) / 2.0, low <= world.n <= high,
            n.verdict is ResultVerdict.IDENTIFIED,
        )  # fmt: skip


def stated(world: World, rng: np.random.Generator) -> Judgement:
    """What is said of a drawn run where all its errors are stated."""
    return judge(drawn(world.run, rng))


def unstated(world: World, rng: np.random.Generator) -> Judgement:
    """What is said of the same run as a file of which K_s and its σ alone are stated."""
    sources = world.run.conditions.sources
    track = drawn(replace(world.run, tracks=[(1, _whole(world), None)]), rng).tracks[0][1]
    given = Stated(
        system_stiffness_n_per_m=sources.system_stiffness_n_per_m,
        system_stiffness_sigma_n_per_m=sources.system_stiffness_sigma_n_per_m,
    )
    curve = Curve(track.time_s, track.travel_m, None, track.force_n)
    return judge(prepare(curve, given).run)


def _whole(world: World) -> Track:
    """A run in one piece, with what a file has of free air before and after each cycle."""
    told = world.run.conditions
    force: list[FloatArray] = []
    travel: list[FloatArray] = []
    away_m = np.linspace(-FREE_M, 0.0, round(FREE_S * SAMPLES_HZ))

    def foot(to_n: float, law: Law) -> tuple[FloatArray, FloatArray]:
        force_n = np.linspace(0.0, to_n, round(FOOT_S * SAMPLES_HZ) + 1)[1:-1]
        return force_n, law(force_n) + told.bend(force_n)

    for k, up, down in world.run.tracks:
        there = foot(float(up.force_n[0]), world.loading if k == 1 else world.again)
        force += [np.zeros_like(away_m), there[0], up.force_n]
        travel += [away_m, there[1], up.travel_m]
        if down is not None:
            back = foot(float(down.force_n[-1]), world.again)
            force += [down.force_n, back[0][::-1], np.zeros_like(away_m)]
            travel += [down.travel_m, back[1][::-1], away_m[::-1]]
    force_n, travel_m = np.concatenate(force), np.concatenate(travel)
    time_s = np.arange(force_n.size) / SAMPLES_HZ
    return Track(time_s, force_n, travel_m, np.zeros(force_n.size, dtype=np.intp))


def table(
    world: World, runs: int, seed: int, ask: Ask = stated
) -> tuple[Mapping[str, list[Row]], int]:
    """All rows of a world by figure, and how many runs were refused."""
    found: dict[str, list[Row]] = {}
    refused = 0
    for number in range(runs):
        try:
            evidence = ask(
                world, np.random.default_rng([seed, number, zlib.crc32(world.name.encode())])
            )
        except SteploadError:
            refused += 1
            continue
        for kind, row in rows(world, evidence):
            found.setdefault(kind, []).append(row)
    return found, refused


def score(made: Sequence[Row]) -> Score:
    """Rows of one figure in numbers; those that the data leave open count as held."""
    known = [row for row in made if row.identified]
    errors = np.array([row.error for row in made if math.isfinite(row.error)])
    half = float(np.median([row.half for row in made]))
    return Score(
        len(made),
        float(np.mean([row.held for row in made])),
        len(known) / len(made),
        float(np.mean([row.held for row in known])) if known else math.nan,
        half,
        half / (NORMAL_95 * math.sqrt(float(np.mean(errors**2)))),
    )
