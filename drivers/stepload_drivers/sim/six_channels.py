"""The force sensor and the arm of a rig with six axes: what `channels` has for one axis."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stepload.rig.mount import SensorMount
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.sim.channels import SensorChannel, Wrench
from stepload_drivers.sim.noise import noise_about
from stepload_drivers.sim.sensor_load import SensorLoad
from stepload_drivers.sim.sensor_truth import SensorTruth

_FULL_SCALE = int(Status.OVERRANGE | Status.SATURATED)
_OVERRANGE = int(Status.OVERRANGE)
_FULL_SHARE = 1.2
_LARGEST_NM = 1e3
"""Full scale of a torque that has none."""
_TORQUE_OFFSET_M = 0.05
"""Zero of the torques over that of the forces."""
_NAN: Wrench = (math.nan,) * 6
_floor = math.floor
_new: Any = tuple.__new__


class WrenchChannel(SensorChannel):
    """A six-axis force sensor: every component has noise, a zero, a resolution and a full scale.

    Args:
        felt: what it feels.
        sensor: how it sits in the rig, and what it has across its axis.
        truth: its axis shows the press, and alone drifts and is bent; the readings of the other
            components in free air are drawn below that of the axis.
        bend: errors at full scale that grow as F² and F³, share of full scale.
    """

    def __init__(
        self,
        felt: SensorLoad,
        sensor: SensorMount,
        truth: SensorTruth,
        *,
        bend: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        super().__init__(truth)
        axis, range_n, offset_n = truth.axis, truth.range_n, truth.offset_n
        self._felt = felt
        self._press = "xyz".index(axis[-1])
        self._sign = -1.0 if axis[0] == "-" else 1.0
        self._drift = self._sign * truth.drift_n_per_s
        self._bent = bend if any(bend) else None
        forces = [sensor.lateral_range_n if sensor.lateral_range_n < math.inf else range_n] * 3
        forces[self._press] = range_n
        self._limits = (*forces, *[sensor.torque_range_nm] * 3)
        self._least_limit = min(self._limits)
        self._quanta = truth.quantum_n, sensor.torque_quantum_nm
        chance = np.random.default_rng([truth.seed, truth.stream, 1])
        zeros = chance.uniform(-abs(offset_n), abs(offset_n), 6)
        zeros[3:] *= _TORQUE_OFFSET_M
        zeros[self._press] = self._sign * offset_n
        spread = [truth.noise_n] * 3 + [sensor.torque_noise_nm] * 3
        self._aside = noise_about(zeros, np.array(spread), [truth.seed, truth.stream, 2])
        self._last_wrench: Wrench = (0.0,) * 6

    def sample(self, time_s: float, back: float) -> None:
        truth = self._felt.wrench(back)
        fx, fy, fz, tx, ty, tz = truth
        a, b, c, d, e, f = self._aside()
        values = [fx + a, fy + b, fz + c, tx + d, ty + e, tz + f]
        press = self._press
        if self._drift:
            values[press] += self._drift * time_s
        if self._bent is not None:
            values[press] += self._bending(truth[press])
        least = self._least_limit
        beyond = max(values) > least or min(values) < -least
        status = self._limited(values) if beyond else 0
        six = self._rounded(values)
        self.sequence += 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb_wrench(time_s, truth, six, status)
            return
        self._last_wrench = six
        self.last = six[press]
        self._send(self._clock_s + time_s, self.origin_s + time_s + self._delay_s, status, six)

    def _limited(self, values: list[float]) -> int:
        """Cut every component at 1.2 times its full scale; returns the status."""
        status = 0
        for i, (value, limit) in enumerate(zip(values, self._limits, strict=True)):
            if not -limit <= value <= limit:
                status |= _OVERRANGE
                if not -_FULL_SHARE * limit <= value <= _FULL_SHARE * limit:
                    status |= _FULL_SCALE
                    values[i] = math.copysign(_FULL_SHARE * limit, value)
        return status

    def _bending(self, true_n: float) -> float:
        assert self._bent is not None
        share = self._sign * true_n / self._range
        return self._sign * self._range * share**2 * (self._bent[0] + share * self._bent[1])

    def _rounded(self, values: list[float]) -> Wrench:
        force, torque = self._quanta
        a, b, c, d, e, f = values
        if force:
            a, b, c = (_floor(value / force + 0.5) * force for value in (a, b, c))
        if torque:
            d, e, f = (_floor(value / torque + 0.5) * torque for value in (d, e, f))
        return a, b, c, d, e, f

    def _send(self, device_s: float, receive_s: float, status: int, six: Wrench) -> None:
        self.pending.append(ForceSample(self.sequence, device_s, receive_s, status, six, math.nan))

    def _disturb_wrench(self, time_s: float, truth: Wrench, six: Wrench, status: int) -> None:
        """Send a sample while faults are or have been active; they act on the whole wrench."""
        self.disturbed = True
        active = self._faults.active(time_s)
        self.raising = "raise" in active
        values = list(six)
        shown = self._kept("stuck_mean", active, self._lag.shown(truth, active))
        if shown != truth:
            values = [v + h - t for v, h, t in zip(six, shown, truth, strict=True)]
        gain = active.get("gain", 1.0) * (-1.0 if "reversed" in active else 1.0)
        added = active.get("bias", 0.0)
        if "gain_ramp" in active or "bias_ramp" in active:
            self._ramp += self.period_s
            gain *= 1.0 + self._ramp * active.get("gain_ramp", 0.0)
            added += self._ramp * active.get("bias_ramp", 0.0)
        values = [value * gain for value in values]
        values[self._press] += self._sign * added
        if "clipped" in active:
            most = active["clipped"]
            values[:3] = [max(-most, min(most, value)) for value in values[:3]]
        if "swapped" in active:
            fx, fy, fz, tx, ty, tz = values
            values = [fz, fx, fy, tz, tx, ty]
        self._cut_across(active, values)
        six = self._last_wrench if "freeze" in active else self._rounded(values)
        self._last_wrench = six
        self.last = six[self._press]
        if "saturated" in active:
            forces = [0.0] * 6
            forces[self._press] = self._sign * self._range
            six, status = self._rounded(forces), _FULL_SCALE
        if "nan" in active:
            six = _NAN
        if arrives := self._arrives(time_s, active):
            self._send(arrives[0], arrives[1], status, six)

    def _cut_across(self, active: dict[str, float], values: list[float]) -> None:
        """Faults that leave the component along the axis what it is."""
        i, j = (index for index in range(3) if index != self._press)
        if "lateral_swapped" in active:
            values[i], values[j] = values[j], values[i]
        if "torque_dead" in active:
            values[3:] = [0.0] * 3
        if "torque_saturated" in active:
            values[3 + i] = min(self._limits[3 + i], _LARGEST_NM)
        if "lateral_dead" in active:
            values[:] = [v if k == self._press else 0.0 for k, v in enumerate(values)]
