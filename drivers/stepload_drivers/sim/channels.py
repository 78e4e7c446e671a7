"""From the truth to samples: noise, offset, drift, range, quantum, delay, and faults.

A channel is asked once per sample time and puts finished samples into `pending`, in the order in
which they reach the host. `back` is the share of a base step by which the sample time lies before
the plant's present time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from stepload.rig.samples import NOT_TOLD, ArmSample, DisplacementSample, SixFloats, Status
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.faults import LATE, Schedule
from stepload_drivers.sim.noise import normal_source, smooth_error
from stepload_drivers.sim.six_plant import Mechanics, SixPlant

ARM_CLOCK_S = 5000.0
"""What the arm's own clock shows when the world begins; devices have been up for a while."""
GAUGE_CLOCK_S = 400.0

_IGNORED_S = 1.0

new: Any = tuple.__new__
"""Makes a sample of a row three times as fast as its own constructor."""
FULL_SCALE = int(Status.OVERRANGE | Status.SATURATED)
_STOPPED = int(Status.STOPPED)


def quantised(value: float, quantum: float) -> float:
    return (value / quantum + 0.5) // 1.0 * quantum if quantum else value


Forces = tuple[float, ...]
NO_FAULTS: Mapping[str, float] = {}


class Lag:
    """The force that a channel shows, one call per sample; as many components as `shown` is given.

    Args:
        faults: those of the channel's device.
        period_s: between two samples.
        prefix: of the kinds, where the faults have one.
    """

    def __init__(self, faults: Schedule, period_s: float, prefix: str = "") -> None:
        self._aged, self._old, self._filter = (prefix + kind for kind in LATE)
        self._period_s = period_s
        longest_s = max(faults.largest(self._aged), faults.largest(self._old))
        self._past: deque[Forces] = deque(maxlen=round(longest_s / period_s) + 1)
        self.late = any(
            faults.largest(kind) > 0.0 for kind in (self._aged, self._old, self._filter)
        )
        """Whether it ever shows anything but the truth."""
        self.remembers = longest_s > 0.0
        """Whether `shown` must be asked before the fault begins, too."""
        self._aging = 0
        self._filtered: Forces = ()

    def shown(self, truth: Forces, active: Mapping[str, float]) -> Forces:
        """What is shown now instead of `truth`."""
        self._past.append(truth)
        self._aging = self._aging + 1 if self._aged in active else 0
        lag = round(active.get(self._old, 0.0) / self._period_s)
        if self._aging:
            lag = min(self._aging - 1, round(active[self._aged] / self._period_s))
        truth = self._past[max(0, len(self._past) - 1 - lag)]
        if self._filter not in active:
            self._filtered = truth
            return truth
        part = 1.0 - math.exp(-self._period_s / active[self._filter])
        pairs = zip(self._filtered or truth, truth, strict=True)
        self._filtered = tuple([was + part * (now - was) for was, now in pairs])
        return self._filtered


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
        late: str = "",
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
        self._lag = Lag(faults, self.period_s, late)
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
            value = quantised(value + shown - truth, self._quantum)
        if "reversed" in active:
            value = -value
        self.swapped = "swapped" in active
        if "gain" in active:
            value = quantised(value * active["gain"], self._quantum)
        if "bias" in active:
            value = quantised(value + active["bias"], self._quantum)
        if "gain_ramp" in active or "bias_ramp" in active:
            self._ramp += self.period_s
            value *= 1.0 + self._ramp * active.get("gain_ramp", 0.0)
            value = quantised(value + self._ramp * active.get("bias_ramp", 0.0), self._quantum)
        if "clipped" in active:
            value = max(-active["clipped"], min(active["clipped"], value))
        if "freeze" in active:
            value = self.last
        self.last = value
        if "saturated" in active:
            value, status = self._range, FULL_SCALE
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
        value = quantised(truth + self._offset + self._noise(), self._quantum)
        self.sequence += 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb(time_s, truth, value, 0)
            return
        self.last = value
        self._emit(self._clock_s + time_s, self.origin_s + time_s, 0, value)

    def _emit(self, device_s: float, receive_s: float, status: int, value: float) -> None:
        row = (self.sequence, device_s, receive_s, status, value)
        self.pending.append(new(DisplacementSample, row))


class ArmChannel(Channel):
    """The arm's state: measured position and, where it has one, its own force estimate.

    With six axes its pose shows where its drives across the press are, and it estimates the force
    along all three axes where it estimates any. Like an arm with encoders on its motors it does not
    see what gives way behind them.
    """

    def __init__(
        self, plant: Mechanics, spec: WorldSpec, *, force_offset_n: float, faults: Schedule
    ) -> None:
        super().__init__(
            rate_hz=spec.arm_rate_hz,
            clock_s=ARM_CLOCK_S,
            noise=normal_source(spec.seed, 10, spec.position_noise_m),
            quantum=spec.position_quantum_m,
            faults=faults,
            late="arm_force_",
        )
        self._plant = plant
        self._six = plant if isinstance(plant, SixPlant) else None
        self._sign = -1.0 if faults.turned else 1.0
        self._error = smooth_error(spec.seed, 11, spec.kinematic_error_m, spec.kinematic_length_m)
        self._error_at_m, self._error_m = math.nan, 0.0
        self._has_force = spec.arm_has_force
        sd_n = spec.arm_force_noise_n
        self._force_noise = normal_source(spec.seed, 12, sd_n)
        self._force_offset = force_offset_n
        self.arm_force_n = math.nan
        self._drift_m = 0.0
        self._lag_across = Lag(faults, self.period_s, "arm_force_")
        self._noise_x, self._noise_y = (normal_source(spec.seed, i, sd_n) for i in (13, 14))
        self._zeros = (np.random.default_rng([spec.seed, 15]).normal(size=2) * sd_n).tolist()
        self._across_n = (0.0, 0.0)

    def sample(self, time_s: float, back: float) -> None:
        plant = self._plant
        value = self._sign * plant.measured_m
        if self._error is not None:
            if value != self._error_at_m:
                self._error_at_m, self._error_m = value, self._error(value)
            value += self._error_m
        value += self._noise()
        if quantum := self._quantum:
            value = (value / quantum + 0.5) // 1.0 * quantum
        if self._has_force:
            self.arm_force_n = plant.force_n + self._force_offset + self._force_noise()
        self.sequence += 1
        if self.disturbed or time_s >= self._faults.next_s:
            self._disturb(time_s, plant.force_n, value, 0)
            return
        self.last = value
        device_s, receive_s = self._clock_s + time_s, self.origin_s + time_s
        self._tell(device_s, receive_s, 0, value, self.arm_force_n, NO_FAULTS)

    def _tell(
        self,
        device_s: float,
        receive_s: float,
        status: int,
        value: float,
        force: float,
        active: Mapping[str, float],
    ) -> None:
        pose, wrench = (0.0, 0.0, -value, 0.0, 0.0, 0.0), NOT_TOLD
        if (six := self._six) is not None:
            x_m, y_m = six.shift_m
            if x_m or y_m:
                pose = (-x_m, y_m, -value, 0.0, 0.0, 0.0)
            if self._has_force:
                wrench = self._force_across(six, force, active)
        row = (self.sequence, device_s, receive_s, status, value, force, pose, wrench)
        self.pending.append(new(ArmSample, row))

    def _force_across(
        self, six: SixPlant, along_n: float, active: Mapping[str, float]
    ) -> SixFloats:
        """The whole wrench at the TCP, where an arm reports no torque.

        Across the press it is as noisy as along it, with zeros of its own and the same faults.
        """
        if "arm_force_freeze" not in active and "arm_freeze" not in active:
            x_n, y_n, _ = six.load
            if self._lag_across.late:
                x_n, y_n = self._lag_across.shown((x_n, y_n), active)
            if "arm_force_deaf" in active:
                x_n = y_n = 0.0
            x_n = x_n + self._zeros[0] + self._noise_x()
            y_n = y_n + self._zeros[1] + self._noise_y()
            if active:
                gain = active.get("arm_force_gain", 1.0)
                gain *= -1.0 if "arm_force_reversed" in active else 1.0
                most = active.get("arm_force_clipped", math.inf)
                x_n, y_n = (max(-most, min(most, gain * force)) for force in (x_n, y_n))
            self._across_n = (x_n, y_n)
        x_n, y_n = self._across_n
        return x_n, y_n, along_n, math.nan, math.nan, math.nan

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
            value = quantised(value + self._drift_m, self._quantum)
        if "position_jump" in active:
            value = quantised(value + active["position_jump"], self._quantum)
        held = self._kept("position_frozen", active, self.last)
        if "position_frozen" in active:
            value = held
        value, force = self._kept("arm_freeze", active, (value, force))
        self.last = value
        if "arm_nan" in active:
            value = math.nan
        if arrives := self._arrives(time_s, active, "arm_"):
            self._tell(arrives[0], arrives[1], status, value, force, active)
