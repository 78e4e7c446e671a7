"""Fits of all laws to one loading, weighted with the covariance of its errors.

A length that laws give has as interval the union of the profile-likelihood intervals of all laws
that the data cannot distinguish: they prefer none of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stepload.identification.conditions import Conditions
from stepload.identification.fit import FloatArray
from stepload.identification.laws import (
    ADHESIVE,
    BILINEAR,
    HERTZ_LINEAR,
    PLASTIC,
    POWER,
    ROUGH,
    STIFFENING,
    Law,
)
from stepload.identification.smooth import CHI2_95

CANNOT_TELL = 4.0
"""Laws whose χ² is within this distance of the best cannot be distinguished by the data."""
ROUGHEST = 0.15
"""Largest 1.22 σ κ^-0.16 of a surface of unstated roughness, as a share of the smooth deformation
at the top: 5 µm rms on the paper's plastic sphere at 300 N."""


class Whitened:
    """One loading with the covariance of its errors, ready for many fits."""

    def __init__(self, force_n: FloatArray, deformation_m: FloatArray, covariance: FloatArray):
        """Take (B,) forces above 0, deformations and (B, B) covariance in m²."""
        self.top_n = float(force_n.max())
        self.u = force_n / self.top_n
        self.scale_m = float(np.ptp(deformation_m))
        root = np.linalg.cholesky(covariance / self.scale_m**2)
        self._inverse = np.linalg.inv(root)
        self.y = self._inverse @ (deformation_m / self.scale_m)
        self.ones = self._inverse @ np.ones_like(self.u)

    def columns(self, law: Law, shapes: Sequence[float]) -> FloatArray:
        """Whitened columns (S, B, 1 + k) of every shape parameter: the zero and the law's."""
        own = self._inverse @ np.stack([law.basis(self.u, shape) for shape in shapes])
        ones = np.broadcast_to(self.ones[:, None], (*own.shape[:2], 1))
        return np.concatenate([ones, own], axis=2)

    def whiten(self, values: FloatArray) -> FloatArray:
        """Deformations (B, ...) in m as errors of unit variance."""
        return np.asarray(self._inverse @ (values / self.scale_m))


@dataclass(frozen=True, slots=True)
class Point:
    """One law at one shape parameter; coefficients (1 + k,) in m, their covariance in m²."""

    shape: float
    chi2: float
    coefficients: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class LawFit:
    """One law: all its points, the best first in `best`."""

    law: Law
    points: tuple[Point, ...]
    top_n: float
    degrees: int

    @cached_property
    def best(self) -> Point:
        """The point of least χ²."""
        return min(self.points, key=lambda point: point.chi2)

    @property
    def chi2(self) -> float:
        """Least χ² of this law."""
        return self.best.chi2

    def gradient(self, shape: float, force_n: float) -> FloatArray:
        """(1 + k,): the deformation since touch at a force is this @ coefficients."""
        column = self.law.basis(np.array([force_n / self.top_n]), shape)[0]
        return np.concatenate([[0.0], column - self.law.at_touch(shape)])

    def plane_gradient(self, shape: float, force_n: float) -> FloatArray:
        """The same since the mean plane of the asperities, which is the law's zero."""
        return np.concatenate([[0.0], self.law.basis(np.array([force_n / self.top_n]), shape)[0]])


def fit_law(data: Whitened, law: Law, told: Conditions | None = None) -> LawFit | None:
    """Fit a law at every shape parameter of its grid; None where none is possible.

    A stated roughness restricts the rough law to its length, within its uncertainty; a surface that
    was declared smooth is not fitted as a rough one.
    """
    if law is ROUGH and told is not None and told.rough_length_m == 0.0:
        return None
    points = _points(data, law, law.grid.tolist(), told)
    if not points:
        return None
    if len(law.grid) > 2:
        best = int(np.argmin([p.chi2 for p in points]))
        low = points[max(best - 1, 0)].shape
        high = points[min(best + 1, len(points) - 1)].shape
        finer = np.linspace(low, high, 17)[1:-1].tolist()
        points += _points(data, law, finer, told)
        points.sort(key=lambda point: point.shape)
    degrees = data.u.size - 1 - law.parameters
    return LawFit(law, tuple(points), data.top_n, degrees)


def _points(
    data: Whitened, law: Law, shapes: Sequence[float], told: Conditions | None
) -> list[Point]:
    """The law at the shape parameters where it is determined and has a positive compliance."""
    columns = data.columns(law, shapes)
    norm = np.linalg.norm(columns, axis=1)
    q, r = np.linalg.qr(columns / norm[:, None])
    determined = np.flatnonzero(~(np.abs(np.diagonal(r, axis1=1, axis2=2)).min(axis=1) < 1e-9))
    if not determined.size:
        return []
    inverse = np.linalg.inv(r[determined]) / norm[determined][:, :, None]
    projected = q[determined].swapaxes(1, 2) @ data.y
    scaled = (inverse @ projected[:, :, None])[:, :, 0]
    gives_way = ~((scaled[:, 1:] < 0.0).any(axis=1) | (scaled[:, 1:].sum(axis=1) <= 0.0))
    chi2 = data.y @ data.y - (projected**2).sum(axis=1)
    coefficients = scaled * data.scale_m
    covariance = inverse @ inverse.swapaxes(1, 2) * data.scale_m**2
    stated_m = None if told is None else told.rough_length_m
    points = []
    for i in np.flatnonzero(gives_way).tolist():
        shape, misfit = shapes[determined[i]], float(chi2[i])
        if law is ROUGH and stated_m is None and shape > ROUGHEST:
            continue
        if law is ROUGH and told is not None and stated_m:
            length_m = shape * float(coefficients[i, 1])
            misfit += (math.log(length_m / stated_m) / told.rough_length_sigma) ** 2
        points.append(Point(shape, max(misfit, 0.0), coefficients[i], covariance[i]))
    return points


def fit_laws(data: Whitened, told: Conditions, *, adhesive: bool) -> dict[str, LawFit]:
    """All laws that may hold here, by name.

    Args:
        told: the conditions, with what is known of the roughness.
        adhesive: whether the force was negative near the touch.
    """
    laws: list[Law] = [POWER, HERTZ_LINEAR, BILINEAR, STIFFENING, PLASTIC, ROUGH]
    if adhesive:
        laws.append(ADHESIVE)
    found = {law.name: fit_law(data, law, told) for law in laws}
    return {name: fit for name, fit in found.items() if fit is not None}


def alike(fits: Sequence[LawFit]) -> tuple[LawFit, ...]:
    """The laws that the data cannot distinguish, the best first."""
    ordered = sorted(fits, key=lambda fit: fit.chi2)
    return tuple(fit for fit in ordered if fit.chi2 <= ordered[0].chi2 + CANNOT_TELL)


Read = Callable[[LawFit, float], FloatArray]
"""From a law and its shape parameter to the gradient of a length over the coefficients."""


def _profile(fit: LawFit, read: Read) -> tuple[float, float] | None:
    """The profile-likelihood interval (95 %) of the logarithm of a length under one law; None where
    the length may be 0."""
    low, high = math.inf, -math.inf
    for point in fit.points:
        beyond = point.chi2 - fit.chi2
        if beyond > CHI2_95:
            continue
        found = at_point(fit, point, read)
        if found is None:
            return None
        value, sigma = found
        reach = math.sqrt(CHI2_95 - beyond) * sigma
        low, high = min(low, value - reach), max(high, value + reach)
    return low, high


def shape_interval(fit: LawFit) -> tuple[float, float]:
    """The profile-likelihood interval (95 %) of the shape parameter of a law; between two points of
    the profile χ² is taken as straight."""
    shape = np.array([point.shape for point in fit.points])
    beyond = np.array([point.chi2 - fit.chi2 - CHI2_95 for point in fit.points])
    inside = np.flatnonzero(beyond <= 0.0)

    def end(last: int, out: int) -> float:
        if not 0 <= out < shape.size:
            return float(shape[last])
        share = beyond[last] / (beyond[last] - beyond[out])
        return float(shape[last] + share * (shape[out] - shape[last]))

    first, last = int(inside[0]), int(inside[-1])
    return end(first, first - 1), end(last, last + 1)


def at_point(fit: LawFit, point: Point, read: Read) -> tuple[float, float] | None:
    """Logarithm of a length at one point of a law, and its standard uncertainty."""
    gradient = read(fit, point.shape)
    length = float(gradient @ point.coefficients)
    if not length > 0.0:
        return None
    return math.log(length), math.sqrt(
        max(float(gradient @ point.covariance @ gradient), 0.0)
    ) / length


def union(law_sets: Sequence[Sequence[LawFit]], read: Read) -> tuple[float, float] | None:
    """The interval of the logarithm of a length over the laws that the data cannot distinguish, in
    each of several sets (one per assumption about the errors); None where one of them leaves the
    length undetermined."""
    low, high = math.inf, -math.inf
    for laws in law_sets:
        for fit in alike(laws):
            found = _profile(fit, read)
            if found is None:
                return None
            low, high = min(low, found[0]), max(high, found[1])
    return (low, high) if low <= high else None
