"""Rehearsals of the run's own ideal contact: the size of a sign that noise alone can cause.

The forces of the run are taken as they were, the deformation as the fitted power law gives it, and
the rig's stated errors are drawn: smooth error, quanta, noise, lag, a loop of up to 3 % of the
stored energy that repeats in every cycle. The 99 % quantile of a sign over the rehearsals is its
threshold. The same record gives the same thresholds: the seed is fixed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.linearity import linearity_errors
from stepload.estimators.smooth import smooth_correlation
from stepload.estimators.sources import Sources
from stepload.evidence.elastic import Elastic
from stepload.evidence.loops import Branch, Loop
from stepload.evidence.pressed import Pressed
from stepload.evidence.signs import HoldCreep, Sign

REHEARSALS = 400
QUANTILE = 0.99
TO_SIGMA = 2.576
"""The size of a normal error at that quantile in standard deviations."""
LARGEST_LOOP = 0.03
NOT_REPEATED = 0.2
"""Share of the smooth error that is different in every branch."""
_WITHIN = 5
"""Places within a stretch at which its quantum is looked at."""
_GRID = 48


def draws(
    branches: Sequence[Branch], ideal: Elastic, run: Pressed, length_n: float
) -> list[FloatArray]:
    """Travel (B, REHEARSALS) of every branch; the error of K_s is common to all of them."""
    sources = run.conditions.sources
    rng = np.random.default_rng(12345)
    grid = np.linspace(0.0, ideal.top_n, _GRID)
    root = np.linalg.cholesky(smooth_correlation(grid, length_n) + 1e-6 * np.eye(_GRID))
    common = root @ rng.standard_normal((_GRID, REHEARSALS))
    loop = 0.6 * LARGEST_LOOP * rng.uniform(0.0, 1.0, REHEARSALS)
    deep_m = float(ideal.deformation(np.array([ideal.top_n]))[0])
    bend, crooked = rng.standard_normal((2, 2, REHEARSALS))
    late_s = sources.lag_sigma_s * np.random.default_rng(6789).standard_normal(REHEARSALS)
    found = []
    for branch in branches:
        path = branch.path
        own = root @ rng.standard_normal((_GRID, REHEARSALS))
        # A slow drift moves every branch to another place within the quantum.
        place = rng.uniform(0.0, 1.0, REHEARSALS) * sources.position_resolution_m
        smooth = sources.smooth_error_m * (common + NOT_REPEATED * own)
        travel = ideal.travel(path.force_n)[:, None] + place + _interpolated(
            path.force_n, grid, smooth)  # fmt: skip
        soft = run.conditions.bend_sigma(path.force_n)
        travel = travel + soft.T @ bend[: len(soft)]
        bent = linearity_errors(path.force_n, sources.nonlinearity)
        travel = travel + (ideal.compliance(path.force_n) * bent).T @ crooked
        travel += (ideal.compliance(path.force_n) * path.rate_n_per_s)[:, None] * late_s
        if path.size > 1 and path.force_n[0] > path.force_n[-1]:
            share = np.clip(path.force_n / ideal.top_n, 0.0, 1.0)
            travel = travel + 4.0 * deep_m * (share * (1.0 - share))[:, None] * loop
        noise_n = np.hypot(
            sources.force_noise_n, sources.force_resolution_n / np.sqrt(12.0)
        ) / np.sqrt(path.count)  # fmt: skip
        travel += (ideal.compliance(path.force_n) * noise_n)[:, None] * rng.standard_normal(
            travel.shape)  # fmt: skip
        found.append(_read(travel, path.span_m, path.count, sources, rng))
    return found


def _interpolated(force_n: FloatArray, grid: FloatArray, values: FloatArray) -> FloatArray:
    place = np.clip(force_n / (grid[1] - grid[0]), 0.0, len(grid) - 1.000001)
    low = place.astype(np.intp)
    share = (place - low)[:, None]
    return np.asarray(values[low] * (1.0 - share) + values[low + 1] * share)


def _read(
    travel: FloatArray,
    span: FloatArray,
    count: FloatArray,
    sources: Sources,
    rng: np.random.Generator,
) -> FloatArray:
    """Mean of each stretch as read by a sensor with noise and a quantum."""
    quantum, noise = sources.position_resolution_m, sources.position_noise_m
    if quantum <= 0.0:
        return np.asarray(
            travel + noise / np.sqrt(count)[:, None] * rng.standard_normal(travel.shape)
        )
    total = np.zeros_like(travel)
    for k in range(_WITHIN):
        here = travel + ((k - 0.5 * (_WITHIN - 1)) / _WITHIN) * span[:, None]
        here = here + noise * rng.standard_normal(travel.shape)
        total += np.round(here / quantum)
    return np.asarray(total * (quantum / _WITHIN))


def thresholds(
    signs: Sequence[Sign], branches: Sequence[Branch], drawn: Sequence[FloatArray]
) -> dict[str, float]:
    """The 99 % quantile of the absolute value of every sign, in m."""
    index = {id(branch): travel for branch, travel in zip(branches, drawn, strict=True)}
    return {
        sign.name: float(
            np.quantile(
                np.abs(np.sum([weights @ index[id(b)] for b, weights in sign.terms], axis=0)),
                QUANTILE,
            )
        )
        for sign in signs
    }


def rate_threshold(
    rate: Sign, branches: Sequence[Branch], drawn: Sequence[FloatArray], elastic: Elastic
) -> float:
    """The same of the sign "rate", which compares deformations at forces that are not the same."""
    bent = [
        travel - elastic.travel(branch.path.force_n)[:, None]
        for branch, travel in zip(branches, drawn, strict=True)
    ]
    return thresholds([rate], branches, bent)[rate.name]


def creep_threshold(
    creep: HoldCreep, loops: Sequence[Loop], elastic: Elastic, sources: Sources
) -> float:
    """The 99 % quantile of the mean over all holds of their creep (see `loops.Hold`), in m."""
    loading = [hold for loop in loops[:2] for hold in loop.loading.holds]
    samples = min(hold.samples for hold in loading)
    whole_m_per_n = math.sqrt(sum(elastic.at(hold.force_n) ** 2 for hold in loading) / len(loading))
    rng = np.random.default_rng(54321)
    shape = (2, max(creep.holds, 1), REHEARSALS)
    quantum = sources.position_resolution_m
    noise = sources.position_noise_m
    place = rng.uniform(0.0, 1.0, shape[1:]) * quantum
    reads = np.zeros(shape)
    within = int(min(max(samples, 1), 12))
    for _ in range(within):
        here = place + noise * rng.standard_normal(shape)
        reads += np.round(here / quantum) * quantum if quantum > 0.0 else here
    reads *= 1.0 / within
    bend = whole_m_per_n * sources.force_noise_n / np.sqrt(max(samples, 1))
    change = reads[1] - reads[0] + np.sqrt(2.0) * bend * rng.standard_normal(shape[1:])
    return float(np.quantile(np.abs(change.mean(axis=0)), QUANTILE))
