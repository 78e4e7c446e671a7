"""Selection of the samples of a loading, made once for every fit and figure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray, IntArray, checked

FORCE_BINS = 60


def uniform_in_force(force_n: ArrayLike, count: int = 3000) -> IntArray:
    """Indices, rising, of about `count` samples that are spread about evenly over the force.

    A step protocol spends most of its time in holds, which would dominate a batch fit. The force
    range is cut into 60 equal bins; each gives at most `count`/60 samples, evenly spaced in time.

    Args:
        force_n: (L,) forces in N, in the order of time.
        count: samples wanted; sparse bins give what they have.

    Raises:
        DomainError: `count` is below 1 or the forces are not 1-D and finite.
    """
    force = np.asarray(force_n, dtype=np.float64)
    if force.ndim != 1 or not np.isfinite(force).all():
        raise DomainError(f"forces of shape {force.shape} must be 1-D and finite")
    if count < 1:
        raise DomainError(f"{count} samples wanted; it must be at least 1")
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
    """Indices of the first sample in every period of `rate_hz`.

    Args:
        time_s: (L,) times in s, not falling.
        rate_hz: rate wanted in Hz; slower data are kept whole.

    Raises:
        DomainError: times are not 1-D, finite and rising, or the rate is not positive.
    """
    time = np.asarray(time_s, dtype=np.float64)
    if time.ndim != 1 or not np.isfinite(time).all() or (np.diff(time) < 0.0).any():
        raise DomainError(f"times of shape {time.shape} must be 1-D, finite and not falling")
    if not 0.0 < rate_hz < math.inf:
        raise DomainError(f"rate is {rate_hz:g} Hz; it must be finite and greater than 0 Hz")
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


SAMPLES = 3000
"""Samples that a batch fit is made from."""
RECURSIVE_RATE_HZ = 100.0
RATE_WINDOW_S = 0.1
"""Window of the force rate: long against noise, short against a ramp."""


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples that a fit is made from, (N,) each, with the force rate at them in N/s."""

    deformation_m: FloatArray
    force_n: FloatArray
    force_rate_n_per_s: FloatArray


@dataclass(frozen=True, slots=True)
class Selected:
    """A loading and the samples chosen from it.

    Attributes:
        deformation_m, force_n: (L,) every sample, in the order of time; the payload's deformation.
        force_rate_n_per_s: (L,) rate of the force; 0 where there are no times.
        batch: indices (M,) of samples in contact, spread evenly over the force.
        recursive: indices of samples at 100 Hz, for the recursive fit.
        rest_band_n: band within which the force counts as resting: such samples are left out.
    """

    deformation_m: FloatArray
    force_n: FloatArray
    force_rate_n_per_s: FloatArray
    batch: IntArray
    recursive: IntArray
    rest_band_n: float

    def samples(self, indices: IntArray) -> Samples:
        """The samples at these indices."""
        return Samples(
            self.deformation_m[indices], self.force_n[indices], self.force_rate_n_per_s[indices]
        )


def select(
    deformation_m: ArrayLike, force_n: ArrayLike, *, time_s: ArrayLike | None = None
) -> Selected:
    """Choose the samples of a loading.

    Args:
        deformation_m: (L,) of the payload since the touch in m (27), in the order of time.
        force_n: (L,) contact forces in N.
        time_s: (L,) times in s; without them the recursive fit takes the samples of the batch fits.

    Raises:
        DomainError: arrays of different lengths, or numbers that are not finite.
    """
    deformation, force = checked(deformation_m, force_n)
    loaded = np.flatnonzero(force > 0.0)
    batch = loaded[uniform_in_force(force[loaded], SAMPLES)]
    recursive, rate = batch, np.zeros_like(force)
    if time_s is not None:
        time = np.asarray(time_s, dtype=np.float64)
        if time.shape != force.shape:
            raise DomainError(f"times have shape {time.shape}, forces {force.shape}")
        recursive, rate = at_rate(time, RECURSIVE_RATE_HZ), _force_rate(time, force)
    return Selected(deformation, force, rate, batch, recursive, rest_band(force[recursive]))


def _force_rate(time_s: FloatArray, force_n: FloatArray) -> FloatArray:
    """Force rate (N,) in N/s over a window that is long against the noise."""
    interval_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else math.nan
    reach = max(1, round(0.5 * RATE_WINDOW_S / interval_s)) if interval_s > 0.0 else 1
    index = np.arange(len(time_s))
    before, after = np.maximum(index - reach, 0), np.minimum(index + reach, len(index) - 1)
    elapsed_s = np.maximum(time_s[after] - time_s[before], 1e-9)
    return np.asarray((force_n[after] - force_n[before]) / elapsed_s)
