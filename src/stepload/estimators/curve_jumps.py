"""Jumps of the travel at nearly constant force: pop-in, slip, a crack. No contact law has them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepload.estimators.curve_parts import white_noise
from stepload.estimators.fit import FloatArray

LEAST_JUMP = 0.01
"""Smallest jump, as a share of the deformation."""
SUDDEN = 6.0
"""Least ratio of the jump to the median travel of its neighbourhood in the same time."""
SOFT = 0.2
"""Largest rise of the force in a jump, as a share of the jump times the mean stiffness."""
_LEAST_FORCE = 0.05
_BLOCKS, _NEIGHBOURS = 4000, 20
_NOISE, _QUANTA = 8.0, 3.0


class Jump(NamedTuple):
    """The force at which the travel jumped, and by how much."""

    force_n: float
    travel_m: float


def largest_jump(
    travel_m: FloatArray, force_n: FloatArray, *, quantum_m: float = 0.0
) -> Jump | None:
    """The largest jump of a loading; None where there is none.

    Args:
        travel_m, force_n: (N,) from the touch, in the order of time.
        quantum_m: resolution of the travel; a change of a few quanta is no jump.
    """
    size = max(1, travel_m.size // _BLOCKS)
    count = travel_m.size // size
    if count < 2 * _NEIGHBOURS:
        return None
    x = travel_m[: count * size].reshape(count, size).mean(axis=1)
    f = force_n[: count * size].reshape(count, size).mean(axis=1)
    step_m, step_n = x[2:] - x[:-2], f[2:] - f[:-2]
    padded = np.pad(np.abs(step_m), _NEIGHBOURS, mode="reflect")
    about = np.lib.stride_tricks.sliding_window_view(padded, 2 * _NEIGHBOURS + 1)
    usual_m = np.median(about, axis=1)
    span_m, top_n = float(np.ptp(x)), float(f.max())
    noise_m = white_noise(travel_m) / np.sqrt(size)
    jumped = (
        (step_m > max(LEAST_JUMP * span_m, _NOISE * noise_m, _QUANTA * quantum_m))
        & (step_m > SUDDEN * usual_m)
        & (step_n < SOFT * top_n / max(span_m, 1e-300) * step_m)
        & (f[:-2] > _LEAST_FORCE * top_n)
    )
    if not jumped.any():
        return None
    at = int(np.argmax(np.where(jumped, step_m, 0.0)))
    return Jump(float(f[at]), float(step_m[at]))
