"""Seeded noise as plain floats, and the smooth error of a position over travel.

Endless generators.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

_BLOCK = 4096
_CELLS_PER_LENGTH = 32
_LENGTHS = 64


def normal_source(seed: int, stream: int, sd: float) -> Callable[[], float]:
    """A function that gives the next normal deviate of standard deviation `sd`."""
    if sd == 0.0:
        return repeat(0.0).__next__
    generator = np.random.default_rng([seed, stream])
    blocks = ((generator.standard_normal(_BLOCK) * sd).tolist() for _ in repeat(None))
    return chain.from_iterable(blocks).__next__


def noise_about(
    zeros: NDArray[np.float64], spread: NDArray[np.float64], seed: list[int]
) -> Callable[[], list[float]]:
    """A function that gives the next six deviates of standard deviation `spread` about `zeros`."""
    generator = np.random.default_rng(seed)
    blocks = (
        (zeros + spread * generator.standard_normal((_BLOCK, 6))).tolist() for _ in repeat(None)
    )
    return chain.from_iterable(blocks).__next__


def smooth_error(
    seed: int, stream: int, sd_m: float, length_m: float
) -> Callable[[float], float] | None:
    """A Gaussian random function of travel, correlated over `length_m`; None for none.

    Periodic over 64 lengths, linear between 32 points per length; correlation exp(−s²/2 length²).
    """
    if sd_m == 0.0 or not 0.0 < length_m < math.inf:
        return None
    count = _CELLS_PER_LENGTH * _LENGTHS
    generator = np.random.default_rng([seed, stream])
    frequency = 2.0 * math.pi * np.fft.rfftfreq(count, d=1.0 / _CELLS_PER_LENGTH)
    amplitude = np.exp(-0.25 * frequency**2)
    spectrum = amplitude * np.fft.rfft(generator.standard_normal(count))
    values = np.fft.irfft(spectrum, n=count)
    power = np.sum(np.concatenate([amplitude**2, amplitude[1:-1] ** 2])) / count
    table: list[float] = (values * sd_m / math.sqrt(power)).tolist()
    table.append(table[0])
    cells_per_m = _CELLS_PER_LENGTH / length_m

    def error(travel_m: float) -> float:
        place = travel_m * cells_per_m % count
        i = int(place)
        return table[i] + (place - i) * (table[i + 1] - table[i])

    return error
