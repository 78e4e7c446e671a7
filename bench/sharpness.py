"""Are the intervals true, and how narrow are they? Drawn worlds with errors as a plan states them.

    python bench/sharpness.py --runs 300

Each run presses the payload of a plan by its theory, quasi-static. K_s, its table, the smooth
error, the gain and the linearity are drawn from what the plan states, noise and quanta too. A row
tells how often the interval of a figure held its truth, how often it was identified and true, and
its half width over 1.96 times the rms error.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stepload.envelope.envelope import Envelope, envelope_of
from stepload.envelope.until import planned_run
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import smooth_correlation
from stepload.evidence.answer import Evidence, weigh
from stepload.evidence.loops import Track
from stepload.evidence.pressed import Pressed
from stepload.evidence.quantity import ResultVerdict
from stepload.plan.load import load_plan

HOME = Path(__file__).parents[1]
PLANS = ("procedures/plastic-sphere.yaml", "bench/sharp/ur5e-silicone.yaml")
GRID = 60


class Row(NamedTuple):
    """Logarithmic error of one figure, half of its interval, whether it held and was identified."""

    error: float
    half: float
    held: bool
    identified: bool


def drawn(run: Pressed, told: Conditions, rng: np.random.Generator) -> Pressed:
    """The same run with errors drawn from what is stated."""
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

    def spoiled(track: Track) -> Track:
        true_n, size = track.force_n, track.force_n.size
        u = true_n / top_n
        force_n = gain * true_n + 4.0 * bow * top_n * u * (1.0 - u)
        force_n = force_n + sources.force_noise_n * rng.standard_normal(size)
        travel_m = track.travel_m + np.interp(true_n, grid, wrong_m)
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


def rows(envelope: Envelope, found: Evidence) -> Iterator[tuple[str, Row]]:
    """Every figure of a run against its truth."""
    law = envelope.theory.stiffest
    for kind, each in found.quantities.items():
        if kind == "secant_from_mean_plane" or not each.value_n_per_m > 0.0:
            continue
        from_n, to_n = each.from_n, each.to_n
        if kind == "tangent":
            from_n, to_n = 0.999 * to_n, 1.001 * to_n
        below_m = law.deformation(from_n) if from_n > 0.0 else 0.0
        true = (to_n - from_n) / (law.deformation(to_n) - below_m)
        low, high = each.interval_n_per_m
        yield kind, Row(
            math.log(each.value_n_per_m / true), math.log(high / low) / 2.0, low <= true <= high,
            each.verdict is ResultVerdict.IDENTIFIED,
        )  # fmt: skip


def table(path: Path, runs: int, seed: int) -> Mapping[str, list[Row]]:
    """All rows of a plan, by figure."""
    plan = load_plan(path)
    # A surface stated as rough makes the secants those of a rough contact, which this is not.
    envelope = envelope_of(replace(plan, payload=replace(plan.payload, roughness_m=0.0)))
    run = planned_run(envelope.plan, envelope.theory, envelope.climbs)
    found: dict[str, list[Row]] = {}
    for number in range(runs):
        rng = np.random.default_rng([seed, number])
        for kind, row in rows(envelope, weigh(drawn(run, run.conditions, rng))):
            found.setdefault(kind, []).append(row)
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Are the intervals true, and how narrow?")
    parser.add_argument("plans", nargs="*", type=Path, default=[HOME / each for each in PLANS])
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    told = parser.parse_args()
    print(f"{'figure':20} held  identified  true of those  half width  over 1.96 rms")
    for path in told.plans:
        print(path.stem)
        for kind, each in table(path, told.runs, told.seed).items():
            error, half = (np.array(column) for column in list(zip(*each, strict=True))[:2])
            known = [row for row in each if row.identified]
            true = np.mean([row.held for row in known]) if known else math.nan
            held = np.mean([row.held for row in each])
            sharp = np.median(half) / (1.96 * math.sqrt(float(np.mean(error**2))))
            print(
                f"  {kind:18} {held:5.3f} {len(known) / len(each):11.2f} {true:14.3f}"
                f" {np.median(half):10.2%} {sharp:14.2f}"
            )


if __name__ == "__main__":
    main()
