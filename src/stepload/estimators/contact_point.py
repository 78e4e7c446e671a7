"""Where the plate is touched, by the torques about the force sensor's origin.

With r from the sensor's origin to the place on the pressing axis at the contact's height and e from
there to the contact, T = (r + e) × f. Of the two torques across the axis this leaves e (six axes,
item 4), whatever the force across.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.wrench import Wrench

OFF_AXIS_M = 2e-3
"""A contact that is further beside the axis is worth a warning."""


@dataclass(frozen=True, slots=True)
class ContactPoint:
    """Where the plate was touched during one hold while loading.

    `beside_m` is along the sensor's two axes across, in the order x, y, z; `sigma_m` the standard
    uncertainty of each by noise alone: an error of the lever, times the share across, comes on top.
    """

    cycle: int
    force_n: float
    beside_m: tuple[float, float]
    sigma_m: float

    @property
    def size_m(self) -> float:
        """Distance from the axis."""
        return math.hypot(*self.beside_m)


def contact_points(wrench: Wrench, lever_m: float) -> tuple[ContactPoint, ...]:
    """The place of every hold while loading, in the order of time; none without torques.

    Args:
        wrench: samples in contact, finite.
        lever_m: from the sensor's origin to the contact along the pressing axis.
    """
    if wrench.torque_n_m is None:
        return ()
    mask = wrench.rising & (wrench.held > 0) & (wrench.force_n > 0.0)
    numbers, where = np.unique(wrench.held[mask], return_inverse=True)
    count = np.bincount(where, minlength=numbers.size).astype(float)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(where, values[mask], numbers.size) / count)

    along = mean(wrench.force_n)
    lever = -wrench.turn * lever_m
    left = (
        mean(wrench.torque_n_m[:, 0]) + lever * mean(wrench.across_n[:, 1]),
        mean(wrench.torque_n_m[:, 1]) - lever * mean(wrench.across_n[:, 0]),
    )
    beside = (-wrench.turn * left[1] / along, wrench.turn * left[0] / along)
    noise = math.hypot(wrench.torque_noise_n_m, lever_m * wrench.noise_n)
    sigma = noise / (along * np.sqrt(count))
    cycles = np.rint(mean(wrench.cycle.astype(float))).astype(int)
    return tuple(
        ContactPoint(int(c), float(f), (float(x), float(y)), float(u))
        for c, f, x, y, u in zip(cycles, along, *beside, sigma, strict=True)
    )
