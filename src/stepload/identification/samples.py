"""Selection of the samples of a loading, made once for every fit and figure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray, IntArray, checked

FORCE_BINS = 60
SAMPLES = 3000
"""Samples that a batch fit is made from."""
RECURSIVE_RATE_HZ = 100.0


def uniform_in_force(force_n: ArrayLike, count: int = 3000) -> IntArray:
    """Indices, rising, of about `count` of the forces (L,) in N, spread evenly over the force.

    A step protocol spends most of its time in holds, which would dominate a batch fit. Each of 60
    equal bins of force gives at most `count`/60 samples, evenly spaced in time.
    """
    force = np.asarray(force_n, dtype=np.float64)
    if force.size == 0:
        return np.empty(0, dtype=np.intp)
    low, high = float(force.min()), float(force.max())
    if high <= low:
        return _evenly(np.arange(force.size), count)
    bins = np.minimum((force - low) * (FORCE_BINS / (high - low)), FORCE_BINS - 1).astype(np.int16)
    order = np.argsort(bins, kind="stable")
    edges = np.searchsorted(bins[order], np.arange(FORCE_BINS + 1))
    share = math.ceil(count / FORCE_BINS)
    chosen = [_evenly(order[a:b], share) for a, b in pairwise(edges)]
    return np.sort(np.concatenate(chosen))


def at_rate(time_s: ArrayLike, rate_hz: float) -> IntArray:
    """Indices of the first of the times (L,) in s in every period of `rate_hz`.

    Raises:
        DomainError: the times are not 1-D, finite and rising.
    """
    time = np.asarray(time_s, dtype=np.float64)
    if time.ndim != 1 or not np.isfinite(time).all() or (np.diff(time) < 0.0).any():
        raise DomainError(f"times of shape {time.shape} must be 1-D, finite and not falling")
    if time.size == 0:
        return np.empty(0, dtype=np.intp)
    # A small margin, so that a sample at the edge of a period counts to it.
    periods = np.floor((time - time[0]) * rate_hz + 1e-6)
    return np.flatnonzero(np.diff(periods, prepend=-1.0) > 0.0)


def rest_band(force_n: FloatArray) -> float:
    """Band in N within which the force of a step protocol rests: five times its noise at rest.

    The noise is the median step from sample to sample (most samples of a step protocol are taken
    at rest), and at least one quantum of the force where the force is quantised.
    """
    steps = np.abs(np.diff(force_n))
    if steps.size == 0:
        return 0.0
    noise = 1.4826 / math.sqrt(2.0) * float(np.median(steps))
    moving = steps[steps > 0.0]
    quantised = moving.size < 0.9 * steps.size
    quantum = float(moving.min()) if quantised and moving.size else 0.0
    return max(5.0 * noise, 1.5 * quantum)


def _evenly(indices: IntArray, count: int) -> IntArray:
    if indices.size <= count:
        return indices
    return indices[((np.arange(count) + 0.5) * (indices.size / count)).astype(np.intp)]


class Samples(NamedTuple):
    """Samples that a fit is made from, (N,) each."""

    deformation_m: FloatArray
    force_n: FloatArray


@dataclass(frozen=True, slots=True)
class Selected:
    """A loading and the samples chosen from it.

    Attributes:
        deformation_m, force_n: (L,) every sample, in the order of time; the payload's deformation.
        batch: indices (M,) of samples in contact, spread evenly over the force.
        recursive: indices of samples at 100 Hz, for the recursive fit.
        rest_band_n: band within which the force counts as resting: such samples are left out.
    """

    deformation_m: FloatArray
    force_n: FloatArray
    batch: IntArray
    recursive: IntArray
    rest_band_n: float

    def samples(self, indices: IntArray) -> Samples:
        """The samples at these indices."""
        return Samples(self.deformation_m[indices], self.force_n[indices])


def select(
    deformation_m: ArrayLike, force_n: ArrayLike, *, time_s: ArrayLike | None = None
) -> Selected:
    """Choose the samples of a loading, (L,) in the order of time.

    Args:
        deformation_m: of the payload since the touch (27).
        force_n: contact forces.
        time_s: without times the recursive fit takes the samples of the batch fits.

    Raises:
        DomainError: arrays of different lengths, or numbers that are not finite.
    """
    deformation, force = checked(deformation_m, force_n)
    loaded = np.flatnonzero(force > 0.0)
    batch = loaded[uniform_in_force(force[loaded], SAMPLES)]
    recursive = batch
    if time_s is not None:
        recursive = at_rate(time_s, RECURSIVE_RATE_HZ)
        if np.shape(time_s) != force.shape:
            raise DomainError(f"times have shape {np.shape(time_s)}, forces {force.shape}")
    return Selected(deformation, force, batch, recursive, rest_band(force[recursive]))
