"""Worlds whose errors are as a plan states them: do the intervals hold, and are they narrow?

A world is a run without error and the law of its payload. Each draw spoils it with K_s, its table,
the smooth error, gain, linearity, drift, noise and quanta of the sizes that are stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stepload.envelope.envelope import Envelope, envelope_of
from stepload.envelope.until import planned_run
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.estimators.judge import ResultVerdict
from stepload.estimators.smooth import NORMAL_95, smooth_correlation
from stepload.evidence.answer import Evidence, weigh
from stepload.evidence.path import Track
from stepload.evidence.pressed import Pressed
from stepload.plan.load import load_plan
from stepload_verify.trials.boundary.curves import Branch, Contact

GRID = 60
DRIFT_M_PER_S = 0.5e-6 / 60.0
"""Standard deviation of an even drift of the travel. It is stated nowhere: two cycles show it."""
NEAR = 1e-3


@dataclass(frozen=True, slots=True)
class World:
    """A run without error; deformation in m at a force in N, and exponent of its payload."""

    name: str
    run: Pressed
    deformation: Callable[[float], float]
    n: float


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
    envelope = _smooth(path)
    law = envelope.theory.stiffest
    run = planned_run(envelope.plan, envelope.theory, envelope.climbs)
    return World(path.stem, run, law.deformation, law.n)


def of_contacts(path: Path, contacts: Sequence[Contact]) -> Iterator[World]:
    """Bodies in place of a plan's payload; of shape and surface nothing is stated."""
    planned = _smooth(path)
    run = planned_run(planned.plan, planned.theory, planned.climbs)
    told = replace(
        run.conditions, theory_k=None, theory_n=None, modulus_pa=None, elastic_limit_n=None,
        roughness_m=None, rough_length_m=None,
    )  # fmt: skip
    for contact in contacts:
        again = contact.again or contact.loading
        tracks = [
            (k, _pressed(up, contact.loading if k == 1 else again, told),
             _pressed(down, again, told) if down else None)
            for k, up, down in run.tracks
        ]  # fmt: skip
        top_n = float(tracks[0][1].force_n.max())
        yield World(
            contact.name,
            replace(run, tracks=tracks, conditions=told),
            lambda force_n, contact=contact: float(contact.loading.at(force_n)),
            contact.exponent(float(tracks[0][1].force_n.min()), top_n),
        )


def _pressed(track: Track, branch: Branch, told: Conditions) -> Track:
    return replace(track, travel_m=branch.at(track.force_n) + told.bend(track.force_n))


def _smooth(path: Path) -> Envelope:
    plan = load_plan(path)
    # A surface stated as rough makes the secants those of a rough contact, which this is not.
    return envelope_of(replace(plan, payload=replace(plan.payload, roughness_m=0.0)))


def drawn(run: Pressed, rng: np.random.Generator) -> Pressed:
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


def rows(world: World, found: Evidence) -> Iterator[tuple[str, Row]]:
    """Every figure of the first loading against its truth."""
    law = world.deformation
    for kind in ("chord", "secant_from_touch", "tangent"):
        each = found.quantities.get(kind)
        if each is None or not each.value_n_per_m > 0.0:
            yield kind, Row(math.nan, math.inf, held=True, identified=False)
            continue
        from_n, to_n = each.from_n, each.to_n
        if kind == "tangent":
            from_n, to_n = (1.0 - NEAR) * to_n, (1.0 + NEAR) * to_n
        below_m = law(from_n) if from_n > 0.0 else 0.0
        true = (to_n - from_n) / (law(to_n) - below_m)
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


def table(world: World, runs: int, seed: int) -> Mapping[str, list[Row]]:
    """All rows of a world, by figure."""
    found: dict[str, list[Row]] = {}
    for number in range(runs):
        rng = np.random.default_rng([seed, number])
        for kind, row in rows(world, weigh(drawn(world.run, rng))):
            found.setdefault(kind, []).append(row)
    return found


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
