"""Location of the contact on the plate, from the torques about the force sensor's origin.

With r from the sensor's origin to the place on the pressing axis at the contact's height and e from
there to the contact, T = (r + e) × f. Of the two torques across the axis this leaves e (six axes,
item 4), whatever the force across.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.missing import Missing
from stepload.estimators.wrench import Wrench

OFF_AXIS_M = 2e-3
"""Largest distance of a contact from the pressing axis without a warning."""
HIGH_SHARE = 0.3
"""Only holds above this share of the largest force are compared with one another."""
APART, LEAST_APART_M, SIGMAS = 3.0, 5e-4, 6.0
"""Limits of the scatter of the places beyond which the lever must be on the other side: as a
multiple of the scatter with that lever, in m, and in standard uncertainties by noise."""
NO_HOLDS = "where the plate is touched is not known: there is no hold"
OTHER_SIDE = (
    "where the plate is touched is not known: the torques fit a contact on the other side of the "
    "force sensor; it tells the force that it exerts, or axis or lever are wrong"
)


@dataclass(frozen=True, slots=True)
class ContactPoint:
    """Where the plate was touched during one hold while loading.

    `beside_m` is along the sensor's two axes across, in the order x, y, z; `sigma_m` the standard
    uncertainty of each by noise alone; an error of the lever, times the lateral share, adds to it.
    """

    cycle: int
    force_n: float
    beside_m: tuple[float, float]
    sigma_m: float

    @property
    def size_m(self) -> float:
        """Distance from the axis."""
        return math.hypot(*self.beside_m)


def contact_points(wrench: Wrench, lever_m: float) -> tuple[ContactPoint, ...] | Missing:
    """Place of the contact in every hold while loading, in the order of time.

    The sensor is assumed to report the force that acts on it. For one that reports the force that
    it exerts, the lever is on the other side: where the lateral share varies, the places computed
    with that lever scatter less, and `Missing` is returned.

    Args:
        wrench: samples in contact, finite, with torques.
        lever_m: from the sensor's origin to the contact along the pressing axis.
    """
    assert wrench.torque_n_m is not None
    held = np.where(wrench.force_n > 0.0, wrench.held, 0)
    numbers, where = np.unique(held, return_inverse=True)
    count = np.bincount(where).astype(float)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(where, values) / count)[numbers > 0]

    along, across = mean(wrench.force_n), [mean(wrench.across_n[:, i]) for i in (0, 1)]
    torque = [mean(wrench.torque_n_m[:, i]) for i in (0, 1)]
    if not along.size:
        return Missing(NO_HOLDS)

    def places(lever: float) -> FloatArray:
        left = torque[0] + lever * across[1], torque[1] - lever * across[0]
        turn = wrench.turn / along
        return np.stack([-turn * left[1], turn * left[0]], axis=1)

    lever = -wrench.turn * lever_m
    beside, other = places(lever), places(-lever)
    sigma = math.hypot(wrench.torque_noise_n_m, lever_m * wrench.noise_n)
    sigma = sigma / (along * np.sqrt(count[numbers > 0]))
    high = along > HIGH_SHARE * float(along.max())
    scatter, of_other = (float(np.hypot(*each[high].std(axis=0))) for each in (beside, other))
    if scatter > max(APART * of_other, LEAST_APART_M, SIGMAS * float(sigma[high].max())):
        return Missing(OTHER_SIDE)
    rising, cycle = mean(wrench.rising.astype(float)) > 0.5, mean(wrench.cycle.astype(float))
    return tuple(
        ContactPoint(int(c), float(f), (float(x), float(y)), float(u))
        for up, c, f, (x, y), u in zip(rising, np.rint(cycle), along, beside, sigma, strict=True)
        if up
    )
