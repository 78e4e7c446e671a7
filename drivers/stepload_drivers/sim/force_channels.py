"""Force sensors: what they feel of the load, their noise and errors, with one axis and with six."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np

from stepload.rig.mount import SensorMount
from stepload.rig.samples import ForceSample, Status
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.channels import FULL_SCALE, Channel, new
from stepload_drivers.sim.faults import Schedule
from stepload_drivers.sim.noise import noise_about, normal_source
from stepload_drivers.sim.plant import Plant
from stepload_drivers.sim.six_plant import SixPlant
from stepload_drivers.sim.springs import FloatArray, skew, turning

Wrench = tuple[float, float, float, float, float, float]
WRENCHES: dict[str, Callable[[float], Wrench]] = {
    "+fx": lambda force_n: (force_n, 0.0, 0.0, 0.0, 0.0, 0.0),
    "-fx": lambda force_n: (-force_n, 0.0, 0.0, 0.0, 0.0, 0.0),
    "+fy": lambda force_n: (0.0, force_n, 0.0, 0.0, 0.0, 0.0),
    "-fy": lambda force_n: (0.0, -force_n, 0.0, 0.0, 0.0, 0.0),
    "+fz": lambda force_n: (0.0, 0.0, force_n, 0.0, 0.0, 0.0),
    "-fz": lambda force_n: (0.0, 0.0, -force_n, 0.0, 0.0, 0.0),
}
_PLACES = {"z": (0, 1, 2), "x": (1, 2, 0), "y": (2, 0, 1)}
"""Index of the component of the sensor that shows axis 1, 2, 3 of the pressing frame."""
_OVERRANGE = int(Status.OVERRANGE)
_FULL_SHARE = 1.2
_LARGEST_NM = 1e3
"""Full scale of a torque that has none."""
_TORQUE_OFFSET_M = 0.05
"""Zero of the torques over that of the forces."""
_NAN: Wrench = (math.nan,) * 6
_MAIN_CLOCK_S, _SECOND_CLOCK_S = 300.0, 350.0
"""What the sensors' own clocks show when the world begins; devices have been up for a while."""
_MAIN_STREAM, _SECOND_STREAM = 20, 30


class SensorTruth(NamedTuple):
    """One force sensor as it really is.

    `offset_n` is its reading in free air; `stream` and `stream` + 1 are its streams of noise from
    `seed`.
    """

    axis: str
    rate_hz: float
    noise_n: float
    quantum_n: float
    delay_s: float
    range_n: float
    offset_n: float
    drift_n_per_s: float
    clock_s: float
    seed: int
    stream: int
    faults: Schedule


def main_sensor(spec: WorldSpec) -> SensorTruth:
    """The main force sensor."""
    return SensorTruth(
        axis=spec.force_axis,
        rate_hz=spec.force_rate_hz,
        noise_n=spec.force_noise_n,
        quantum_n=spec.force_quantum_n,
        delay_s=spec.force_delay_s,
        range_n=spec.force_range_n,
        offset_n=spec.start_force_bias_n,
        drift_n_per_s=spec.force_drift_n_per_s,
        clock_s=_MAIN_CLOCK_S,
        seed=spec.seed,
        stream=_MAIN_STREAM,
        faults=Schedule(spec.faults, prefix="force_"),
    )


def second_sensor(spec: WorldSpec, offset_n: float) -> SensorTruth:
    """The second one, which does not drift."""
    return SensorTruth(
        axis=spec.second_force_axis,
        rate_hz=spec.second_force_rate_hz,
        noise_n=spec.second_force_noise_n,
        quantum_n=spec.second_force_quantum_n,
        delay_s=spec.second_force_delay_s,
        range_n=spec.second_force_range_n,
        offset_n=offset_n,
        drift_n_per_s=0.0,
        clock_s=_SECOND_CLOCK_S,
        seed=spec.seed,
        stream=_SECOND_STREAM,
        faults=Schedule(spec.faults, prefix="second_"),
    )


class SensorChannel(Channel):
    """Common part of the force sensors of one axis and of six."""

    def __init__(self, truth: SensorTruth) -> None:
        super().__init__(
            rate_hz=truth.rate_hz,
            delay_s=truth.delay_s,
            clock_s=truth.clock_s,
            noise=normal_source(truth.seed, truth.stream, truth.noise_n),
            quantum=truth.quantum_n,
            limit=truth.range_n,
            faults=truth.faults,
        )


class ForceChannel(SensorChannel):
    """A force sensor of a rig with one axis: contact force → wrench.

    Args:
        plant: what it feels.
        spec: the truth of the rig.
        truth: the sensor as it is.
        bent: whether it has the errors of the main sensor besides noise, and feels the cross-talk.
    """

    def __init__(
        self, plant: Plant, spec: WorldSpec, truth: SensorTruth, *, bent: bool = False
    ) -> None:
        super().__init__(truth)
        self._plant = plant
        self._bend = _bend_of(spec) if bent else None
        self._offset = truth.offset_n
        self._drift = truth.drift_n_per_s
        self._wrench = WRENCHES[truth.axis]
        if spec.lateral or spec.six_components:
            self._wrench = _sideways(plant, spec, truth)

    def sample(self, time_s: float, back: float) -> None:
        plant, bend = self._plant, self._bend
        truth = plant.force_n
        if bend is not None:
            truth = bend(truth)
        if back:
            last = plant.last_force_n
            truth -= back * (truth - (last if bend is None else bend(last)))
        value = truth + self._offset + self._drift * time_s + self._noise()
        limit = self._range
        status = 0
        if not -limit <= value <= limit:
            status = _OVERRANGE
            if not -_FULL_SHARE * limit <= value <= _FULL_SHARE * limit:
                status = FULL_SCALE
                value = math.copysign(_FULL_SHARE * limit, value)
        if quantum := self._quantum:
            value = (value / quantum + 0.5) // 1.0 * quantum
        self.sequence = sequence = self.sequence + 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb(time_s, truth, value, status)
            return
        self.last = value
        device_s, receive_s = self._clock_s + time_s, self.origin_s + time_s + self._delay_s
        row = (sequence, device_s, receive_s, status, self._wrench(value), math.nan)
        self.pending.append(new(ForceSample, row))

    def _emit(self, device_s: float, receive_s: float, status: int, value: float) -> None:
        wrench = self._wrench(value)
        if self.swapped:
            fx, fy, fz, tx, ty, tz = wrench
            noise = self._noise  # that of the axis which feels nothing now
            wrench = (fz + noise(), fx + noise(), fy + noise(), tz, tx, ty)
        row = (self.sequence, device_s, receive_s, status, wrench, math.nan)
        self.pending.append(new(ForceSample, row))


def _bend_of(spec: WorldSpec) -> Callable[[float], float] | None:
    """Reading along the axis over the force, of a sensor with a nonlinear characteristic.

    F + cross-talk of the lateral force + q2 F²/F_max + q3 F³/F_max², F_max its rated force.
    """
    linear = 1.0 + spec.cross_talk * spec.lateral
    quadratic = spec.sensor_quadratic / spec.force_range_n
    cubic = spec.sensor_cubic / spec.force_range_n**2
    if linear == 1.0 and not (quadratic or cubic):
        return None
    return lambda force_n: force_n * (linear + force_n * (quadratic + force_n * cubic))


def _sideways(plant: Plant, spec: WorldSpec, truth: SensorTruth) -> Callable[[float], Wrench]:
    """The wrench of a sensor on which a share of the contact force also acts sideways.

    It acts along the component after the pressing one (x after z). A sensor of six components has
    its noise across the axis too.
    """
    along, share, six = WRENCHES[truth.axis], spec.lateral, spec.six_components
    noise = normal_source(truth.seed, truth.stream + 1, truth.noise_n)
    index = "xyz".index(truth.axis[-1])
    across, other = (index + 1) % 3, (index + 2) % 3

    def felt(value: float) -> Wrench:
        wrench = list(along(value))
        wrench[across] = share * plant.force_n + noise()
        if six:
            wrench[other] = noise()
        return wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]

    return felt


class SensorLoad:
    """The wrench at the origin of one sensor, without noise and offset.

    Everything between load and reading is linear: the lever, the frame of the sensor and its
    cross-talk.
    """

    def __init__(self, plant: SixPlant, sensor: SensorMount, axis: str) -> None:
        self._plant = plant
        contact = np.vstack([np.eye(3), skew(sensor.lever_m)])
        self._of_load: Any = (_shows(sensor, axis) @ contact).tolist()

    def wrench(self, back: float = 0.0) -> Wrench:
        """Now, or a share `back` of a base step earlier."""
        x, y, z = self._plant.load
        if back:
            p, q, r = self._plant.last_load
            x, y, z = x - back * (x - p), y - back * (y - q), z - back * (z - r)
        return cast(Wrench, tuple([a * x + b * y + c * z for a, b, c in self._of_load]))


def _shows(sensor: SensorMount, axis: str) -> FloatArray:
    """(6, 6): what a sensor shows of a wrench at its origin in the pressing frame."""
    into = turning(sensor.rotation_rad).T
    named = np.zeros((3, 3))
    for of_press, component in enumerate(_PLACES[axis[-1]]):
        named[component, of_press] = -1.0 if axis[0] == "-" else 1.0
    frame = np.kron(np.eye(2), named @ into)
    mixing = np.eye(6)
    if sensor.cross_talk is not None:
        mixing += np.array(sensor.cross_talk)
    shown: FloatArray = mixing @ frame
    return shown


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
        self.sequence = sequence = self.sequence + 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb_wrench(time_s, truth, six, status)
            return
        self._last_wrench = six
        self.last = six[press]
        device_s, receive_s = self._clock_s + time_s, self.origin_s + time_s + self._delay_s
        self.pending.append(
            new(ForceSample, (sequence, device_s, receive_s, status, six, math.nan))
        )

    def _limited(self, values: list[float]) -> int:
        """Cut every component at 1.2 times its full scale; returns the status."""
        status = 0
        for i, (value, limit) in enumerate(zip(values, self._limits, strict=True)):
            if not -limit <= value <= limit:
                status |= _OVERRANGE
                if not -_FULL_SHARE * limit <= value <= _FULL_SHARE * limit:
                    status |= FULL_SCALE
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
            a = (a / force + 0.5) // 1.0 * force
            b = (b / force + 0.5) // 1.0 * force
            c = (c / force + 0.5) // 1.0 * force
        if torque:
            d = (d / torque + 0.5) // 1.0 * torque
            e = (e / torque + 0.5) // 1.0 * torque
            f = (f / torque + 0.5) // 1.0 * torque
        return a, b, c, d, e, f

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
            six, status = self._rounded(forces), FULL_SCALE
        if "nan" in active:
            six = _NAN
        if arrives := self._arrives(time_s, active):
            row = (self.sequence, *arrives, status, six, math.nan)
            self.pending.append(new(ForceSample, row))

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
