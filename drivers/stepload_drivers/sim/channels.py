"""From the truth to samples: noise, offset, drift, range, quantum, delay, and faults.

A channel is asked once per sample time and puts finished samples into `pending`, in the order in
which they reach the host. `back` is the share of a base step by which the sample time lies before
the plant's present time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Any

from stepload.rig.samples import NOT_TOLD, ArmSample, DisplacementSample, ForceSample, Status
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.faults import Schedule
from stepload_drivers.sim.lag import Lag
from stepload_drivers.sim.mechanics import Mechanics, Pressed
from stepload_drivers.sim.noise import normal_source, smooth_error
from stepload_drivers.sim.sensor_truth import SensorTruth

ARM_CLOCK_S = 5000.0
"""What the arm's own clock shows when the world begins; devices have been up for a while."""
GAUGE_CLOCK_S = 400.0

Wrench = tuple[float, float, float, float, float, float]
WRENCHES: dict[str, Callable[[float], Wrench]] = {
    "+fx": lambda force_n: (force_n, 0.0, 0.0, 0.0, 0.0, 0.0),
    "-fx": lambda force_n: (-force_n, 0.0, 0.0, 0.0, 0.0, 0.0),
    "+fy": lambda force_n: (0.0, force_n, 0.0, 0.0, 0.0, 0.0),
    "-fy": lambda force_n: (0.0, -force_n, 0.0, 0.0, 0.0, 0.0),
    "+fz": lambda force_n: (0.0, 0.0, force_n, 0.0, 0.0, 0.0),
    "-fz": lambda force_n: (0.0, 0.0, -force_n, 0.0, 0.0, 0.0),
}

_IGNORED_S = 1.0

_new: Any = tuple.__new__
_FULL_SCALE = int(Status.OVERRANGE | Status.SATURATED)
_OVERRANGE = int(Status.OVERRANGE)
_STOPPED = int(Status.STOPPED)


def _quantised(value: float, quantum: float) -> float:
    return (value / quantum + 0.5) // 1.0 * quantum if quantum else value


class Channel:
    """Common part of the channels: the queue, the sequence, and faults of one reading."""

    def __init__(
        self,
        *,
        rate_hz: float,
        clock_s: float,
        noise: Any,
        quantum: float,
        faults: Schedule,
        delay_s: float = 0.0,
        limit: float = math.inf,
    ) -> None:
        self.period_s = 1.0 / rate_hz
        self.pending: deque[Any]
        self.ignore()
        self.samples = 0
        """Sample times that have passed."""
        self.next_s = self.period_s
        self.sequence = 0
        self.origin_s = 0.0
        """Host time of world time 0."""
        self._lag = self._lag_of(faults)
        self.disturbed = self._lag.remembers
        """Whether a fault has ever been active, or shows what was before it."""
        self.raising = self.swapped = False
        self._delay_s = delay_s
        self._clock_s = clock_s
        self._noise = noise
        self._quantum = quantum
        self._range = limit
        self._faults = faults
        self._held: dict[str, Any] = {}
        self._ramp = 0.0
        self.last = 0.0
        """The newest reading, as the device reports it."""
        self._newest_s = -math.inf

    def _lag_of(self, faults: Schedule) -> Lag:
        return Lag(faults, self.period_s)

    def listen(self) -> None:
        """Keep every sample from now on, until it is drained."""
        self.pending = deque()

    def ignore(self) -> None:
        """Keep only a second of samples: nobody drains them."""
        self.pending = deque(maxlen=math.ceil(_IGNORED_S / self.period_s))

    def sample(self, time_s: float, back: float) -> None:
        """Take the sample of world time `time_s`."""
        raise NotImplementedError

    def _emit(self, device_s: float, receive_s: float, status: int, value: float) -> None:
        raise NotImplementedError

    def _disturb(self, time_s: float, truth: float, value: float, status: int) -> None:
        """Send a sample while faults are or have been active."""
        self.disturbed = True
        active = self._faults.active(time_s)
        self.raising = "raise" in active
        shown = self._kept("stuck_mean", active, self._lag.shown((truth,), active))[0]
        if shown != truth:
            value = _quantised(value + shown - truth, self._quantum)
        if "reversed" in active:
            value = -value
        self.swapped = "swapped" in active
        if "gain" in active:
            value = _quantised(value * active["gain"], self._quantum)
        if "bias" in active:
            value = _quantised(value + active["bias"], self._quantum)
        if "gain_ramp" in active or "bias_ramp" in active:
            self._ramp += self.period_s
            value *= 1.0 + self._ramp * active.get("gain_ramp", 0.0)
            value = _quantised(value + self._ramp * active.get("bias_ramp", 0.0), self._quantum)
        if "clipped" in active:
            value = max(-active["clipped"], min(active["clipped"], value))
        if "freeze" in active:
            value = self.last
        self.last = value
        if "saturated" in active:
            value, status = self._range, _FULL_SCALE
        if "nan" in active:
            value = math.nan
        if arrives := self._arrives(time_s, active):
            self._emit(arrives[0], arrives[1], status, value)

    def _kept(self, kind: str, active: dict[str, float], value: Any) -> Any:
        """`value`, or while the fault `kind` is active what it was when that began."""
        if kind in active:
            return self._held.setdefault(kind, value)
        self._held.pop(kind, None)
        return value

    def _arrives(
        self, time_s: float, active: dict[str, float], prefix: str = ""
    ) -> tuple[float, float] | None:
        """The sample's time by the device and by the host; None where it is lost on the way."""
        if f"{prefix}sequence_repeat" in active:
            self.sequence -= 1
        if f"{prefix}dropout" in active or f"{prefix}lost" in active:
            return None
        device_s = self._clock_s + time_s + active.get(f"{prefix}clock_step", 0.0)
        receive_s = self.origin_s + time_s + self._delay_s + active.get(f"{prefix}delay", 0.0)
        self._newest_s = receive_s = max(receive_s, self._newest_s)
        return device_s, receive_s


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
    """A force sensor: contact force → wrench.

    Args:
        pressed: what it feels along its axis.
        truth: the sensor as it is.
        wrench: from that reading to the whole wrench; along the axis alone if None.
    """

    def __init__(
        self,
        pressed: Pressed,
        truth: SensorTruth,
        *,
        wrench: Callable[[float], Wrench] | None = None,
    ) -> None:
        super().__init__(truth)
        self._pressed = pressed
        self._offset = truth.offset_n
        self._drift = truth.drift_n_per_s
        self._wrench = wrench or WRENCHES[truth.axis]

    def sample(self, time_s: float, back: float) -> None:
        pressed = self._pressed
        truth = pressed.force_n
        if back:
            truth -= back * (truth - pressed.last_force_n)
        value = truth + self._offset + self._drift * time_s + self._noise()
        limit = self._range
        status = 0
        if not -limit <= value <= limit:
            status = _OVERRANGE
            if not -1.2 * limit <= value <= 1.2 * limit:
                status = _FULL_SCALE
                value = math.copysign(1.2 * limit, value)
        value = _quantised(value, self._quantum)
        self.sequence += 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb(time_s, truth, value, status)
            return
        self.last = value
        self._emit(self._clock_s + time_s, self.origin_s + time_s + self._delay_s, status, value)

    def _emit(self, device_s: float, receive_s: float, status: int, value: float) -> None:
        wrench = self._wrench(value)
        if self.swapped:
            fx, fy, fz, tx, ty, tz = wrench
            noise = self._noise  # that of the axis which feels nothing now
            wrench = (fz + noise(), fx + noise(), fy + noise(), tz, tx, ty)
        row = (self.sequence, device_s, receive_s, status, wrench, math.nan)
        self.pending.append(_new(ForceSample, row))


class GaugeChannel(Channel):
    """A displacement gauge across the contact; its zero is anywhere within ±20 µm."""

    def __init__(
        self, plant: Mechanics, spec: WorldSpec, *, offset_m: float, stream: int, faults: Schedule
    ) -> None:
        super().__init__(
            rate_hz=spec.gauge_rate_hz,
            clock_s=GAUGE_CLOCK_S,
            noise=normal_source(spec.seed, stream, spec.gauge_noise_m),
            quantum=spec.gauge_quantum_m,
            faults=faults,
        )
        self._plant = plant
        self._offset = offset_m

    def sample(self, time_s: float, back: float) -> None:
        plant = self._plant
        truth = plant.closed_m - back * plant.step_s * plant.tip_speed
        value = _quantised(truth + self._offset + self._noise(), self._quantum)
        self.sequence += 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb(time_s, truth, value, 0)
            return
        self.last = value
        self._emit(self._clock_s + time_s, self.origin_s + time_s, 0, value)

    def _emit(self, device_s: float, receive_s: float, status: int, value: float) -> None:
        row = (self.sequence, device_s, receive_s, status, value)
        self.pending.append(_new(DisplacementSample, row))


class ArmChannel(Channel):
    """The arm's state: measured position and, where it has one, its own force estimate."""

    def __init__(
        self, plant: Mechanics, spec: WorldSpec, *, force_offset_n: float, faults: Schedule
    ) -> None:
        super().__init__(
            rate_hz=spec.arm_rate_hz,
            clock_s=ARM_CLOCK_S,
            noise=normal_source(spec.seed, 10, spec.position_noise_m),
            quantum=spec.position_quantum_m,
            faults=faults,
        )
        self._plant = plant
        self._sign = -1.0 if faults.turned else 1.0
        self._error = smooth_error(spec.seed, 11, spec.kinematic_error_m, spec.kinematic_length_m)
        self._error_at_m, self._error_m = math.nan, 0.0
        self._has_force = spec.arm_has_force
        self._force_noise = normal_source(spec.seed, 12, spec.arm_force_noise_n)
        self._force_offset = force_offset_n
        self.arm_force_n = math.nan
        self._drift_m = 0.0

    def sample(self, time_s: float, back: float) -> None:
        plant = self._plant
        value = self._sign * plant.measured_m
        if self._error is not None:
            if value != self._error_at_m:
                self._error_at_m, self._error_m = value, self._error(value)
            value += self._error_m
        value += self._noise()
        value = _quantised(value, self._quantum)
        if self._has_force:
            self.arm_force_n = plant.force_n + self._force_offset + self._force_noise()
        self.sequence += 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb(time_s, plant.force_n, value, 0)
            return
        self.last = value
        self._tell(self._clock_s + time_s, self.origin_s + time_s, 0, value, self.arm_force_n)

    def _lag_of(self, faults: Schedule) -> Lag:
        return Lag(faults, self.period_s, "arm_force_")

    def _tell(
        self, device_s: float, receive_s: float, status: int, value: float, force: float
    ) -> None:
        pose = (0.0, 0.0, -value, 0.0, 0.0, 0.0)
        row = (self.sequence, device_s, receive_s, status, value, force, pose, NOT_TOLD)
        self.pending.append(_new(ArmSample, row))

    def _disturb(self, time_s: float, truth: float, value: float, status: int) -> None:
        active = self._faults.active(time_s)
        self.disturbed = True
        self.raising = "arm_raise" in active
        self._plant.braked = "protective_stop" in active
        if self._plant.braked:
            status |= _STOPPED
        shown = self._lag.shown((truth,), active)[0]
        force = (self.arm_force_n + (shown - truth)) * active.get("arm_force_gain", 1.0)
        if "arm_force_deaf" in active:
            force -= self._plant.force_n
        if "arm_force_reversed" in active:
            force = -force
        force += active.get("arm_force_bias", 0.0)
        if "arm_force_clipped" in active:
            force = max(-active["arm_force_clipped"], min(active["arm_force_clipped"], force))
        force = self._kept("arm_force_freeze", active, force)
        if "position_drift" in active:
            self._drift_m += active["position_drift"] * self.period_s
            value = _quantised(value + self._drift_m, self._quantum)
        if "position_jump" in active:
            value = _quantised(value + active["position_jump"], self._quantum)
        held = self._kept("position_frozen", active, self.last)
        if "position_frozen" in active:
            value = held
        value, force = self._kept("arm_freeze", active, (value, force))
        self.last = value
        if "arm_nan" in active:
            value = math.nan
        if arrives := self._arrives(time_s, active, "arm_"):
            self._tell(arrives[0], arrives[1], status, value, force)
