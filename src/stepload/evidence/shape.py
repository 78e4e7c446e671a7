"""Whether a power law describes the loading, and how well any law does."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stepload.evidence.chord import Chord
from stepload.evidence.elastic import Elastic
from stepload.evidence.gates import Gate, fit_gate, shape_gates
from stepload.evidence.lawfit import LawFit, Roughness, Whitened
from stepload.evidence.laws import POWER, ROUGH
from stepload.evidence.loops import Branch
from stepload.evidence.rehearse import QUANTILE
from stepload.identify.fit import FloatArray

ANOTHER_LAW = 5.0
"""A law whose χ² is lower by more than this describes the data better than the power law."""
LEAST_OFF = 0.01
"""Chords of a fit and of the data may always differ by this share."""
LEAST_REDUCED_CHI2 = 1.5
"""A law is never refused for a χ² below this per degree of freedom."""
_NEAR, _TRIES = 0.12, 49


class Rehearsed(NamedTuple):
    """Power laws fitted to rehearsals: χ² (R,) and ln(chord of the fit / local chord) (R,)."""

    chi2: FloatArray
    off: FloatArray


def rehearse_power(
    data: Whitened, deformation_m: FloatArray, weights: FloatArray, main: Chord, q: float
) -> Rehearsed:
    """Fit the power law to rehearsed deformations (B, R)."""
    y = data.whiten(deformation_m)
    square = np.einsum("ij,ij->j", y, y)
    best = np.full(y.shape[1], math.inf)
    span = np.ones(y.shape[1])
    u = np.array([main.from_n, main.to_n]) / data.top_n
    for shape in np.linspace(max(q - _NEAR, 0.1), q + _NEAR, _TRIES).tolist():
        columns = data.columns(POWER, shape)
        norm = np.linalg.norm(columns, axis=0)
        orthogonal, r = np.linalg.qr(columns / norm)
        projected = orthogonal.T @ y
        chi2 = square - np.einsum("ij,ij->j", projected, projected)
        at_top = (np.linalg.inv(r)[1] @ projected) / norm[1] * data.scale_m
        better = chi2 < best
        best = np.where(better, chi2, best)
        span = np.where(better, at_top * (u[1] ** shape - u[0] ** shape), span)
    local = np.maximum(weights @ deformation_m, 1e-300)
    return Rehearsed(best, np.log(np.maximum(span, 1e-300) / local))


class Shape(NamedTuple):
    """Gates of the shape, and ln(chord of the believed law / measured chord)."""

    gates: list[Gate]
    off: float


def shape_of(
    first: Branch,
    main: Chord,
    elastic: Elastic,
    data: Whitened,
    laws: Mapping[str, LawFit],
    roughness: Roughness,
    drawn: FloatArray,
) -> Shape:
    """Hold the power law, or the rough one where the roughness is stated, against the others.

    Args:
        first: the loading.
        main: its chord.
        elastic: what was rehearsed.
        data: the loading with the covariance of its errors.
        laws: all laws fitted to it.
        roughness: what is known of the surface.
        drawn: (B, R) rehearsed travel of the loading.
    """
    believed = laws.get(POWER.name)
    if believed is None:
        return Shape([], 0.0)
    if roughness.length_m and ROUGH.name in laws:
        believed = laws[ROUGH.name]
    others = [fit for fit in laws.values() if fit is not believed]
    best = min(others, key=lambda fit: fit.chi2, default=believed)
    lowest = min(laws.values(), key=lambda fit: fit.chi2)
    shape = believed.best.shape
    gradient = believed.gradient(shape, main.to_n) - believed.gradient(shape, main.from_n)
    off = math.log(float(gradient @ believed.best.coefficients) / main.span_m)
    deformation = drawn - elastic.deflection(first.path.force_n)[:, None]
    rehearsed = rehearse_power(data, deformation, main.weights, main, elastic.q)
    allowed_off = max(float(np.quantile(np.abs(rehearsed.off), QUANTILE)), LEAST_OFF)
    allowed_chi2 = max(
        float(np.quantile(rehearsed.chi2, QUANTILE)), LEAST_REDUCED_CHI2 * lowest.degrees
    )
    advantage = max(believed.chi2 - best.chi2, 0.0)
    return Shape(
        [
            *shape_gates(advantage, ANOTHER_LAW, best.law.name, off, allowed_off),
            fit_gate(lowest.chi2, allowed_chi2, lowest.law.name),
        ],
        off,
    )
