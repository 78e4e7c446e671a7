"""Errors along the stroke: draws of smooth curves over force or position."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Curve = Callable[[FloatArray], FloatArray]

MARGIN = 0.1
"""How far a curve is drawn beyond 0 … 1 on either side."""
KNOTS_A_LENGTH = 6


def squared(length: float, rng: np.random.Generator) -> Curve:
    """Unit variance, correlation exp(−½ (Δ/length)²) over arguments 0 … 1 (convolved noise)."""
    step = length / KNOTS_A_LENGTH
    reach = int(np.ceil(4.0 * KNOTS_A_LENGTH))
    kernel = np.exp(-((np.arange(-reach, reach + 1) / KNOTS_A_LENGTH) ** 2))
    kernel /= np.sqrt(np.sum(kernel**2))
    knots = np.arange(-MARGIN, 1.0 + MARGIN + step, step)
    noise = rng.standard_normal(knots.size + 2 * reach)
    values = np.convolve(noise, kernel, "valid")
    return lambda at: np.asarray(np.interp(at, knots, values))


def exponential(length: float, rng: np.random.Generator) -> Curve:
    """Unit variance, correlation exp(−|Δ|/length): rough, with no slope."""
    knots = np.linspace(-MARGIN, 1.0 + MARGIN, 2000)
    keep = float(np.exp(-(knots[1] - knots[0]) / length))
    values = np.empty(knots.size)
    noise = rng.standard_normal(knots.size)
    values[0] = noise[0]
    for i in range(1, knots.size):
        values[i] = keep * values[i - 1] + np.sqrt(1.0 - keep**2) * noise[i]
    return lambda at: np.asarray(np.interp(at, knots, values))


def ripple(period: float, rng: np.random.Generator) -> Curve:
    """A sinusoid of unit variance with a harmonic: a gear, a screw, an encoder."""
    phase, second = rng.uniform(0.0, 2.0 * np.pi, 2)
    share = rng.uniform(0.0, 0.5)
    size = np.sqrt(2.0 / (1.0 + share**2))

    def curve(at: FloatArray) -> FloatArray:
        turn = 2.0 * np.pi * at / period
        return np.asarray(size * (np.sin(turn + phase) + share * np.sin(2.0 * turn + second)))

    return curve
