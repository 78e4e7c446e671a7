"""The arm of a simulated world."""

from __future__ import annotations

from random import Random

from stepload.errors import DeviceError
from stepload.rig.device import Arm, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ArmSample
from stepload_drivers.motion import (
    NO_SHIFT,
    Shift,
    require_finite_target,
    require_positive,
    require_shift,
)
from stepload_drivers.sim.channels import Channel
from stepload_drivers.sim.faults import ARM, Schedule
from stepload_drivers.sim.sensors import Host, Listener, Place, not_open
from stepload_drivers.sim.six_plant import SixPlant

_NAME = "sim arm"
_STILL_M_S = 1e-6
_ARRIVED_M = 20e-6
_ARRIVED_QUANTA = 3.0
_MAX_LEAD_M = 1e-3


class WorldArm(Listener[ArmSample], Arm):
    """An arm that lives in a world. In a world with one axis it cannot shift."""

    can_shift = True

    def __init__(self, place: Place) -> None:
        identity = Identity("sim", "simulated axis", "SIM-ARM", "1", "none")
        super().__init__(_NAME, identity, place)
        self._host: Host | None = None
        self._delay_s = self._last_target_m = 0.0
        self._shift_m = NO_SHIFT
        self._faults = Schedule(())
        self._sign = 1.0
        """Travel of the drive over that of the program."""
        self._chance = Random(0)
        self.period_s = 0.0
        self.has_force = False

    def _channel(self, host: Host) -> Channel:
        return host.world.arm

    def _begin(self, host: Host, channel: Channel) -> None:
        spec = host.world.spec
        self._host = host
        self._faults = Schedule(spec.faults, kinds=ARM)
        self._sign = -1.0 if self._faults.turned else 1.0
        self._chance = Random(spec.seed)
        self._delay_s = spec.command_delay_s
        self._last_target_m = self._target_m()
        self._shift_m = NO_SHIFT
        self.can_shift = isinstance(host.world.plant, SixPlant)
        self.period_s = 1.0 / spec.arm_rate_hz
        self.has_force = spec.arm_has_force
        self.has_wrench = self.can_shift and self.has_force

    @property
    def _here(self) -> Host:
        if self._host is None:
            raise not_open(_NAME)
        return self._host

    def held_m(self) -> float:
        return self._target_m()

    def command(self, position_m: float, shift_m: Shift = NO_SHIFT) -> None:
        host = self._here
        require_finite_target(position_m)
        if shift_m is not self._shift_m:
            require_shift(shift_m, self._shift_m, _MAX_LEAD_M)
        if shift_m is not NO_SHIFT and shift_m != NO_SHIFT and not self.can_shift:
            raise DeviceError(
                f"{_NAME}: a simulated rig with one axis cannot shift",
                code=FaultCode.REFUSED_COMMAND,
                hint="describe its six axes in rig.simulation.mount",
            )
        if position_m > self._last_target_m + _MAX_LEAD_M:
            raise DeviceError(
                f"{_NAME}: target more than {_MAX_LEAD_M * 1e3:g} mm ahead of the last one",
                code=FaultCode.OUT_OF_RANGE,
            )
        self._last_target_m, was_m, self._shift_m = position_m, self._shift_m, shift_m
        now_s = host.catch_up() - host.origin_s
        delay_s = self._delay_s
        if now_s >= self._faults.next_s:
            active = self._faults.active(now_s)
            if "command_raise" in active:
                raise RuntimeError(f"{_NAME}: simulated exception in command")
            if "command_lost" in active or "protective_stop" in active:
                return
            delay_s += active.get("command_latency", 0.0)
            if "command_jitter" in active:
                delay_s += active["command_jitter"] * self._chance.random()
        plant = host.world.plant
        plant.command(now_s + delay_s, self._sign * position_m)
        if shift_m != was_m and isinstance(plant, SixPlant):
            plant.command_shift(now_s + delay_s, *shift_m)

    def _send(self, position_m: float) -> str:
        """Send past the faults of `command` itself; returns why it cannot arrive, or ""."""
        host, faults = self._here, self._faults
        now_s = host.catch_up() - host.origin_s
        active = faults.active(now_s)
        if "command_lost" in active:
            return "the command link is lost"
        if "protective_stop" in active:
            return "the arm is in protective stop"
        delay_s = self._delay_s + active.get("command_latency", 0.0)
        host.world.plant.command(now_s + delay_s, self._sign * position_m)
        return ""

    def _hold(self) -> str:
        """Send where the drive is."""
        return self._send(self._sign * self._here.world.plant.drive_m)

    def safe(self, timeout_s: float) -> None:
        """Stop where the arm is; the force stays on.

        Sent through the controller's own stop, which an exception in `command` does not touch.
        """
        host = self._here
        plant = host.world.plant
        end_s = host.catch_up() + timeout_s
        problem = self._hold()
        begun_s = host.catch_up()
        now_s = begun_s
        while now_s < end_s:
            host.clock.sleep_until(min(end_s, now_s + self.period_s))
            now_s = host.catch_up()
            if now_s >= begun_s + self._delay_s and abs(plant.drive_speed) < _STILL_M_S:
                break
        else:
            problem = problem or f"still moving after {timeout_s:g} s"
        if problem := problem or self._blind():
            raise self._refused("stop", problem)

    def retract(self, distance_m: float, speed_m_s: float, timeout_s: float) -> None:
        """Ramp back along the approach axis; see `Arm.retract`.

        Begins at the measured position or the last target, whichever is further back: a measured
        position that lies must not become a push.
        """
        host = self._here
        require_positive("retract", distance_m=distance_m, speed_m_s=speed_m_s)
        begin_s = now_s = host.catch_up()
        end_s = begin_s + timeout_s
        start_m = min(self._measured_m(), self._target_m())
        goal_m = start_m - distance_m
        quantum_m = host.world.spec.position_quantum_m
        lost_m = host.world.spec.lost_motion_m + host.world.spec.slip_m
        near_m = max(_ARRIVED_M, _ARRIVED_QUANTA * quantum_m, lost_m)
        problem = ""
        while True:
            travelled_m = min(distance_m, speed_m_s * (now_s - begin_s + self.period_s))
            problem = self._send(start_m - travelled_m)
            there = self._measured_m() <= goal_m + near_m and not self._blind()
            if travelled_m == distance_m and there:
                break
            if now_s >= end_s:
                problem = problem or self._blind() or f"not there after {timeout_s:g} s"
                break
            host.clock.sleep_until(min(end_s, now_s + self.period_s))
            now_s = host.catch_up()
        if problem:
            self._hold()
            raise self._refused("retract", problem)

    def _blind(self) -> str:
        """Why the arm's position is not known here, or ""."""
        host, faults = self._here, self._faults
        silent = {"arm_lost", "arm_dropout"} & faults.active(host.catch_up() - host.origin_s).keys()
        return "the arm's samples do not arrive" if silent else ""

    def _target_m(self) -> float:
        return self._sign * self._here.world.plant.target_m

    def _measured_m(self) -> float:
        return self._here.world.arm.last

    def _refused(self, what: str, problem: str) -> DeviceError:
        stopped = "protective" in problem
        code = FaultCode.PROTECTIVE_STOP if stopped else FaultCode.REFUSED_COMMAND
        hint = "the arm holds its last position; free it by hand or at the controller"
        return DeviceError(f"{_NAME}: {what} not confirmed: {problem}", code=code, hint=hint)

    def close(self) -> None:
        super().close()
        self._host = None
