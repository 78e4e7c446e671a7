"""Worlds in real time: for emulators in other processes, and for devices that share one here."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from stepload.errors import DeviceError
from stepload.rig.clock import MonotonicClock
from stepload.rig.faults import FaultCode
from stepload.rig.mount import ZERO, Vector3
from stepload.rig.samples import SixFloats
from stepload.rig.world import DEFAULT_SPEC, WorldSpec
from stepload_drivers.sim.force_channels import SensorLoad
from stepload_drivers.sim.simulation import World
from stepload_drivers.sim.six_plant import SixPlant


def damping(stiffness_n_per_m: float, mass_kg: float) -> float:
    """Critical damping C_s of mass and K_s, in N·s/m."""
    return 2.0 * math.sqrt(stiffness_n_per_m * mass_kg)


_HISTORY_S = 2.0
_SAME_TIME_S = 1e-6


class LiveState(NamedTuple):
    """State of a world that a server process may report, all at `time_s` of the monotonic clock.

    `position_m` as the arm measures it; `drive_m`, `tip_m` true; `force_n` the true contact force
    (a sensor's emulator adds its own noise and quantum); `arm_force_n` the arm's estimate, NaN for
    none; `deformation_m` the true approach of the bodies, negative apart.

    Of a rig with six axes also `load_n`, the contact force in the pressing frame, `shift_m`, where
    the drives across the press are, and `felt`, what the main sensor feels without its noise and
    zero; `felt` is None with one axis.
    """

    time_s: float
    position_m: float
    speed_m_s: float
    drive_m: float
    tip_m: float
    force_n: float
    arm_force_n: float
    deformation_m: float
    peak_force_n: float
    load_n: Vector3 = ZERO
    shift_m: tuple[float, float] = (0.0, 0.0)
    felt: SixFloats | None = None


class LiveWorld:
    """A world tied to the monotonic clock; all methods may be called from any thread.

    Threads that serve devices come late when the host stalls, each by a different time. The state
    at a device's own time is read with `at`, even if other threads have advanced the world since.

    Args:
        spec: the truth. Commands take effect after its command delay.
        start_s: monotonic time of world time 0; now if None.
    """

    def __init__(self, spec: WorldSpec, *, start_s: float | None = None) -> None:
        self.world = World(spec)
        self.clock = MonotonicClock()
        self.origin_s = time.monotonic() if start_s is None else start_s
        for channel in self.world.channels:
            channel.origin_s = self.origin_s
        self._delay_s = spec.command_delay_s
        plant = self.world.plant
        self._six = plant if isinstance(plant, SixPlant) else None
        self._felt: SensorLoad | None = None
        if self._six is not None:
            self._felt = SensorLoad(self._six, self._six.mount.sensor, spec.force_axis)
        self._lock = threading.Lock()
        steps = round(_HISTORY_S / self.world.plant.step_s)
        self._states = deque([self._state()], maxlen=steps)

    def advance_to(self, time_s: float) -> None:
        """Simulate up to `time_s` of the monotonic clock; nothing happens if that is past."""
        with self._lock:
            self._advance(time_s)

    def _advance(self, time_s: float) -> None:
        world, step_s = self.world, self.world.plant.step_s
        until_s = time_s - self.origin_s - step_s + _SAME_TIME_S
        while world.time_s <= until_s:
            world.advance(world.time_s + step_s)
            self._states.append(self._state())

    def command(self, position_m: float) -> None:
        """An absolute target, given at the time that has been simulated so far."""
        with self._lock:
            self.world.plant.command(self.world.time_s + self._delay_s, position_m)

    def command_shift(self, x_m: float, y_m: float) -> None:
        """Likewise across the press; nothing happens in a world with one axis."""
        with self._lock:
            if self._six is not None:
                self._six.command_shift(self.world.time_s + self._delay_s, x_m, y_m)

    def state(self) -> LiveState:
        """The world at the time that has been simulated so far."""
        with self._lock:
            return self._states[-1]

    def at(self, time_s: float) -> LiveState:
        """The world at `time_s` of the monotonic clock, to a base step; of the last 2 s."""
        with self._lock:
            self._advance(time_s)
            newest_s = time_s + _SAME_TIME_S
            known = (state for state in reversed(self._states) if state.time_s <= newest_s)
            return next(known, self._states[0])

    def _state(self) -> LiveState:
        plant = self.world.plant
        state = LiveState(
            time_s=self.origin_s + plant.time_s,
            position_m=self.world.arm.last,
            speed_m_s=plant.drive_speed,
            drive_m=plant.drive_m,
            tip_m=plant.tip_m,
            force_n=plant.force_n,
            arm_force_n=self.world.arm.arm_force_n,
            deformation_m=plant.closed_m,
            peak_force_n=plant.peak_n,
        )
        if self._six is None or self._felt is None:
            return state
        six = self._six
        return state._replace(load_n=six.load, shift_m=six.shift_m, felt=self._felt.wrench())

    def catch_up(self) -> float:
        """Simulate up to now; returns the monotonic time."""
        now_s = time.monotonic()
        self.advance_to(now_s)
        return now_s


class _Shared:
    """One named world of this process: the settings of its devices, and which of them are open."""

    def __init__(self) -> None:
        self.truth: dict[str, Any] = {}
        self.live: LiveWorld | None = None
        self.leases: set[Lease] = set()


_worlds: dict[str, _Shared] = {}
_worlds_lock = threading.Lock()


class Lease:
    """A device's share in a named world: adds its settings, opens the world, and releases it."""

    def __init__(self, name: str, truth: Mapping[str, Any]) -> None:
        self._name = name
        self._truth = dict(truth)
        with _worlds_lock:
            _worlds.setdefault(name, _Shared()).truth.update(self._truth)

    def host(self) -> LiveWorld:
        """The running world; it is made if this device is the first.

        Raises:
            DeviceError: it already runs, and was made without the settings of this device.
        """
        with _worlds_lock:
            shared = _worlds.setdefault(self._name, _Shared())
            shared.truth.update(self._truth)
            if shared.live is None:
                shared.live = LiveWorld(replace(DEFAULT_SPEC, **shared.truth))
            spec = shared.live.world.spec
            for name, value in self._truth.items():
                if getattr(spec, name) != value:
                    raise DeviceError(
                        f"simulated world {self._name!r} already runs with {name} = "
                        f"{getattr(spec, name)}, this device needs {value}",
                        code=FaultCode.WRONG_DEVICE,
                        hint="construct all devices of a rig before opening the first, or name "
                        "another world",
                    )
            shared.leases.add(self)
            return shared.live

    def give_back(self) -> None:
        """Release the world, which ends with its last device. Idempotent."""
        with _worlds_lock:
            shared = _worlds.get(self._name)
            if shared is None:
                return
            shared.leases.discard(self)
            if not shared.leases:
                shared.live = None
