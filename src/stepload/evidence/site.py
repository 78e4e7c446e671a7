"""The deformation at one force, read locally from a branch: a weighted sum, without a law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.estimators.fit import FloatArray
from stepload.evidence.path import HEAVIEST, Path

REACH = 0.2
"""Samples within this share of the force about it are used."""
TOP_REACH = 0.15
AT_TOP = 0.97
"""A hold of at least this share of the largest force is the top."""
_FEWEST = 3


@dataclass(frozen=True, slots=True)
class Site:
    """The deformation at `force_n` is `weights` (B,) @ deformation."""

    force_n: float
    weights: FloatArray


def top_site(path: Path) -> Site:
    """At the largest force: the hold there, or the end of the loading."""
    largest_n = float(path.force_n.max())
    held = (path.held > 0) & (path.force_n >= AT_TOP * largest_n)
    if held.any():
        # The first hold at the top is used; a later one of the same level adds creep.
        return _mean_site(path, held & (path.held == path.held[held][0]))
    return site(path, largest_n, TOP_REACH)


def site(path: Path, force_n: float, reach: float = REACH) -> Site:
    """At a force within the path: a straight line through the stretches about it."""
    near = np.abs(path.force_n - force_n) <= reach * force_n
    if near.sum() < _FEWEST:
        near = np.zeros(path.size, dtype=bool)
        near[np.argsort(np.abs(path.force_n - force_n))[:_FEWEST]] = True
    usual = float(np.median(path.count[near & (path.held == 0)])) if (
        near & (path.held == 0)).any() else float(path.count.max())  # fmt: skip
    weight = np.where(near, np.minimum(path.count, HEAVIEST * usual), 0.0)
    weight /= weight.sum()
    mean_n = float(weight @ path.force_n)
    away = path.force_n - mean_n
    spread = float(weight @ away**2)
    if spread > (1e-3 * force_n) ** 2:
        weight = weight * (1.0 + (force_n - mean_n) * away / spread)
    return Site(force_n, weight)


def hold_site(path: Path, hold_force_n: float) -> Site | None:
    """In the hold nearest to a force; None where there is none within a tenth of it."""
    held = path.held > 0
    if not held.any():
        return None
    nearest = int(np.argmin(np.where(held, np.abs(path.force_n - hold_force_n), np.inf)))
    if abs(path.force_n[nearest] - hold_force_n) > 0.1 * hold_force_n:
        return None
    return _mean_site(path, path.held == path.held[nearest])


def _mean_site(path: Path, stretches: NDArray[np.bool_]) -> Site:
    """The mean over some stretches (B,), at their mean force."""
    weights = np.where(stretches, path.count, 0.0)
    weights /= weights.sum()
    return Site(float(weights @ path.force_n), weights)
