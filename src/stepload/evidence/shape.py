"""Whether the chosen law describes the loading, and how well any law does."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.evidence.chord import Chord
from stepload.evidence.elastic import Elastic
from stepload.evidence.gates import Gate, fit_gate, shape_gates
from stepload.evidence.lawfit import LawFit, Whitened
from stepload.evidence.laws import POWER, ROUGH
from stepload.evidence.loops import Branch
from stepload.evidence.rehearse import QUANTILE

ANOTHER_LAW = 5.0
"""Least χ² difference by which another law describes the data better than the power law."""
LEAST_OFF = 0.01
"""Difference of the chords of fit and data that is always allowed, as a share."""
LEAST_REDUCED_CHI2 = 1.5
"""χ² per degree of freedom below which a law is never rejected."""
_NEAR, _TRIES = 0.12, 49


class Rehearsed(NamedTuple):
    """A law fitted to rehearsals: χ² (R,) and ln(chord of the fit / local chord) (R,)."""

    chi2: FloatArray
    off: FloatArray


def rehearse_law(
    data: Whitened, fit: LawFit, shapes: Sequence[float], deformation_m: FloatArray, main: Chord
) -> Rehearsed:
    """Fit a law to rehearsed deformations (B, R) at the shape parameters to try."""
    y = data.whiten(deformation_m)
    square = np.einsum("ij,ij->j", y, y)
    best = np.full(y.shape[1], math.inf)
    span = np.ones(y.shape[1])
    for shape, columns in zip(shapes, data.columns(fit.law, shapes), strict=True):
        norm = np.linalg.norm(columns, axis=0)
        orthogonal, r = np.linalg.qr(columns / norm)
        if np.abs(np.diag(r)).min() < 1e-9:
            continue
        projected = orthogonal.T @ y
        chi2 = square - np.einsum("ij,ij->j", projected, projected)
        gradient = fit.gradient(shape, main.to_n) - fit.gradient(shape, main.from_n)
        found = (gradient / norm) @ np.linalg.solve(r, projected) * data.scale_m
        better = chi2 < best
        best = np.where(better, chi2, best)
        span = np.where(better, found, span)
    local = np.maximum(main.weights @ deformation_m, 1e-300)
    return Rehearsed(best, np.log(np.maximum(span, 1e-300) / local))


class Shape(NamedTuple):
    """Gates of the shape, ln(chord of the law used without a choice / measured chord), and the law
    that the gates are about; None where no power law fits."""

    gates: list[Gate]
    off: float
    law: LawFit | None


def shape_of(
    first: Branch,
    main: Chord,
    elastic: Elastic,
    data: Whitened,
    laws: Mapping[str, LawFit],
    chosen: Mapping[str, LawFit],
    told: Conditions,
    drawn: FloatArray,
) -> Shape:
    """Compare the power law, or the rough one where the roughness is stated, with the others; where
    laws were chosen, the best of them.

    Args:
        first: the loading.
        main: its chord.
        elastic: what was rehearsed.
        data: the loading with the covariance of its errors.
        laws: all laws fitted to it.
        chosen: those that the user chose; empty where he left the choice to the data.
        told: the conditions, with what is known of the surface.
        drawn: (B, R) rehearsed travel of the loading.
    """
    power = laws.get(POWER.name)
    if power is None:
        return Shape([], 0.0, None)
    believed = laws.get(ROUGH.name, power) if told.rough_length_m else power
    lowest = min(laws.values(), key=lambda fit: fit.chi2)
    deformation = drawn - elastic.deflection(first.path.force_n)[:, None]
    near = np.linspace(max(elastic.q - _NEAR, 0.1), elastic.q + _NEAR, _TRIES).tolist()
    rehearsed = rehearse_law(data, power, near, deformation, main)
    allowed_chi2 = max(
        float(np.quantile(rehearsed.chi2, QUANTILE)), LEAST_REDUCED_CHI2 * lowest.degrees
    )
    lack = fit_gate(lowest.chi2, allowed_chi2, lowest.law.name)
    off = _off(believed, main)
    if not chosen:
        others = [fit for fit in laws.values() if fit is not believed]
        return Shape(
            [*_against("a power law", believed, others, off, rehearsed), lack], off, believed
        )
    own = min(chosen.values(), key=lambda fit: fit.chi2)
    if own is not power:
        force_n, best = first.path.force_n, own.best
        ideal = np.array([own.gradient(best.shape, each) @ best.coefficients for each in force_n])
        errors = deformation - elastic.deformation(force_n)[:, None]
        shapes = own.law.grid.tolist()
        rehearsed = rehearse_law(data, own, shapes, ideal[:, None] + errors, main)
    others = [fit for name, fit in laws.items() if name not in chosen]
    said = f"the one that was chosen ({own.law.name})"
    return Shape([*_against(said, own, others, _off(own, main), rehearsed), lack], off, own)


def _off(fit: LawFit, main: Chord) -> float:
    """ln(chord of a law / measured chord).

    Raises:
        DomainError: the deformation of the best law decreases with the force.
    """
    shape = fit.best.shape
    gradient = fit.gradient(shape, main.to_n) - fit.gradient(shape, main.from_n)
    chord = float(gradient @ fit.best.coefficients) / main.span_m
    if not chord > 0.0:
        raise DomainError(f"the best {fit.law.name} has no deformation along the chord")
    return math.log(chord)


def _against(
    said: str, law: LawFit, others: Sequence[LawFit], off: float, rehearsed: Rehearsed
) -> list[Gate]:
    """The gates of a law compared with others."""
    best = min(others, key=lambda fit: fit.chi2, default=law)
    allowed = max(float(np.quantile(np.abs(rehearsed.off), QUANTILE)), LEAST_OFF)
    advantage = max(law.chi2 - best.chi2, 0.0)
    return shape_gates(said, advantage, ANOTHER_LAW, best.law.name, off, allowed)
