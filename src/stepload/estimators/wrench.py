"""Force and torque across the pressing axis while in contact, as the estimators take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.estimators.fit import FloatArray


@dataclass(frozen=True, slots=True)
class Wrench:
    """Samples in contact, (N,) each, in the order of time; zeros taken out.

    Attributes:
        time_s: in s, not falling.
        force_n: along the pressing axis, positive when pressing.
        across_n: (N, 2) force along the sensor's two other axes, in the order x, y, z.
        rising: whether a sample belongs to a loading; else it belongs to an unloading.
        cycle: number of the cycle.
        held: number of the hold that a sample lies in, 0 between holds.
        noise_n: standard deviation of one reading across, of each of the two.
        torque_n_m: (N, 2) torque about the same two axes; None where the sensor measures none.
        torque_noise_n_m: standard deviation of one reading of each.
        turn: +1 where the two axes and the direction of the plate's push are right-handed in this
            order, -1 where they are left-handed; see `turn_of`.
    """

    time_s: FloatArray
    force_n: FloatArray
    across_n: FloatArray
    rising: NDArray[np.bool_]
    cycle: NDArray[np.integer]
    held: NDArray[np.integer]
    noise_n: float
    torque_n_m: FloatArray | None = None
    torque_noise_n_m: float = 0.0
    turn: float = 1.0

    def finite(self) -> Wrench:
        """Without the samples that contain a non-finite number."""
        keep = np.isfinite(self.force_n) & np.isfinite(self.time_s)
        keep &= np.isfinite(self.across_n).all(axis=1)
        if self.torque_n_m is not None:
            keep &= np.isfinite(self.torque_n_m).all(axis=1)
        if keep.all():
            return self
        torque = None if self.torque_n_m is None else self.torque_n_m[keep]
        return Wrench(
            self.time_s[keep], self.force_n[keep], self.across_n[keep], self.rising[keep],
            self.cycle[keep], self.held[keep], self.noise_n, torque, self.torque_noise_n_m,
            self.turn,
        )  # fmt: skip


def turn_of(axis: str) -> float:
    """Handedness of a pressing axis "+fx" … "-fz" and the two other axes in the order x, y, z."""
    sign = -1.0 if axis[0] == "-" else 1.0
    return -sign if axis[1:] == "fy" else sign
