"""Selection of the samples of a loading, made once for every fit, budget line and figure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray, IntArray, checked
from stepload.estimators.recursive import moving
from stepload.estimators.sampling import at_rate, rest_band, uniform_in_force

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

    @property
    def recursive_used(self) -> IntArray:
        """Those of the `recursive` samples that enter the recursive fit."""
        deformation, force = self.deformation_m[self.recursive], self.force_n[self.recursive]
        return self.recursive[moving(deformation, force, self.rest_band_n)]

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
