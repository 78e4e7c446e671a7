"""Means over short blocks of time, and the uncertainty that quantisation leaves in them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stepload.estimators.fit import FloatArray

BLOCK_S = 0.05
_HARMONICS = 20


class Blocks(NamedTuple):
    """Means (B,) over blocks of equal length that hold a sample; `samples` of them in each."""

    time_s: FloatArray
    deformation_m: FloatArray
    force_n: FloatArray
    samples: FloatArray


def blocks(time_s: FloatArray, deformation_m: FloatArray, force_n: FloatArray) -> Blocks:
    """Means over blocks of `BLOCK_S` from the first time on; empty blocks are left out.

    Args:
        time_s, deformation_m, force_n: (N,) samples in the order of time, N at least 1.
    """
    number = np.floor((time_s - time_s[0]) / BLOCK_S).astype(np.intp)
    count = np.bincount(number)
    used = count > 0
    # Times are taken from the first one: sums of large clock readings would lose digits.
    means = [
        np.bincount(number, values)[used] / count[used]
        for values in (time_s - time_s[0], deformation_m, force_n)
    ]
    return Blocks(means[0] + time_s[0], means[1], means[2], count[used].astype(np.float64))


def quantum_sigma(quantum: float, noise: float) -> float:
    """Standard uncertainty of a mean of many quantised readings at rest.

    Noise carries the readings over the edges of the quanta, so their mean follows the true value,
    with the error of a sawtooth damped by the noise: harmonics q/(π k) times exp(−2 (π k σ/q)²).
    Without noise the true value lies anywhere in the quantum, q/√12.
    """
    if quantum <= 0.0:
        return 0.0
    k = np.arange(1.0, _HARMONICS + 1.0)
    left = np.exp(-2.0 * (math.pi * k * noise / quantum) ** 2) / (math.pi * k)
    rest = 1.0 / 12.0 - 0.5 * float(np.sum(1.0 / (math.pi * k) ** 2))  # of a sawtooth cut off
    rest *= math.exp(-4.0 * (math.pi * _HARMONICS * noise / quantum) ** 2)
    return quantum * math.sqrt(0.5 * float(left @ left) + rest)
