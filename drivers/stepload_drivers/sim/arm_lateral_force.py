"""The force estimate of an arm with six axes across the press, in addition to that along it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from stepload.rig.samples import SixFloats
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.faults import Schedule
from stepload_drivers.sim.lag import Lag
from stepload_drivers.sim.noise import normal_source
from stepload_drivers.sim.six_plant import SixPlant

_HELD = ("arm_force_freeze", "arm_freeze")


class ArmLateralForce:
    """The arm's estimate across the press: as noisy as that along it, with zeros of its own.

    Faults of the arm's force along the press affect this one too.
    """

    def __init__(self, plant: SixPlant, spec: WorldSpec, faults: Schedule) -> None:
        self._plant = plant
        self._lag = Lag(faults, 1.0 / spec.arm_rate_hz, "arm_force_")
        self._noise_x = normal_source(spec.seed, 13, spec.arm_force_noise_n)
        self._noise_y = normal_source(spec.seed, 14, spec.arm_force_noise_n)
        chance = np.random.default_rng([spec.seed, 15])
        self._zero_x = float(chance.normal()) * spec.arm_force_noise_n
        self._zero_y = float(chance.normal()) * spec.arm_force_noise_n
        self._last = (0.0, 0.0)

    def wrench(self, along_n: float, active: Mapping[str, float]) -> SixFloats:
        """The whole wrench; the force along the press already includes its faults.

        It acts at the TCP; an arm reports no torque there.

        Args:
            active: faults of the arm that are active, with their magnitudes.
        """
        if not any(held in active for held in _HELD):
            self._last = self._estimate(active)
        x_n, y_n = self._last
        return x_n, y_n, along_n, math.nan, math.nan, math.nan

    def _estimate(self, active: Mapping[str, float]) -> tuple[float, float]:
        x_n, y_n = self._lag.shown(self._plant.load[:2], active)
        if "arm_force_deaf" in active:
            x_n = y_n = 0.0
        gain = active.get("arm_force_gain", 1.0) * (-1.0 if "arm_force_reversed" in active else 1.0)
        x_n = gain * (x_n + self._zero_x + self._noise_x())
        y_n = gain * (y_n + self._zero_y + self._noise_y())
        if "arm_force_clipped" in active:
            most = active["arm_force_clipped"]
            x_n, y_n = max(-most, min(most, x_n)), max(-most, min(most, y_n))
        return x_n, y_n
