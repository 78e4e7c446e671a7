"""Stand-ins for what the UR driver talks to: ports of ur_rtde, and the socket between processes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from driver_time import Clock

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import wire
from stepload_drivers.ur.configuration import RATE_HZ
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, UrState, travel_m

APPROACH = (0.0, 0.0, -1.0)
HOME = (0.4, -0.1, 0.3, 0.0, 3.14, 0.0)
PERIOD_S = 0.002


PACKAGE_S = 0.008


class Died(BaseException):
    """The child's process would have ended here."""


class FakeUr:
    """Both ports of ur_rtde on a controller that goes where it is sent at once."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.true_m = 0.0
        self.inputs: list[tuple[str, float, float]] = []  # what, target in m, time
        self.is_connected = self.moves = self.accepts = self.uploads = True
        self.silent = False
        self.watchdog_s: float | None = None
        self.fields: dict[str, Any] = {
            "robot_mode": ROBOT_RUNNING, "safety_mode": 1, "runtime_state": PLAYING,
            "safety_bits": 1,
        }  # fmt: skip
        self.pose_of = lambda position_m: tuple(
            h + a * position_m for h, a in zip(HOME, APPROACH, strict=False)
        )
        self.clock_ahead_s = 0.0
        self._silent_stamp_s = 0.0

    def program_runs(self) -> bool:
        """What the control connection sees of the program."""
        return bool(self.fields["runtime_state"] == PLAYING)

    def _input(self, what: str, target_m: float = 0.0) -> bool:
        self.inputs.append((what, target_m, self._clock.now_s))
        return self.accepts

    def of(self, what: str) -> list[tuple[float, float]]:
        """Targets and times of the inputs called `what`."""
        return [(target_m, time_s) for name, target_m, time_s in self.inputs if name == what]

    # receive port

    def connected(self) -> bool:
        return self.is_connected

    def read_new(self, last: UrState | None) -> UrState | None:
        now_s = self._clock.now_s
        if not self.silent:
            self._silent_stamp_s = round(now_s // PERIOD_S * PERIOD_S, 6)
        stamp_s = self._silent_stamp_s + self.clock_ahead_s
        if last is not None and last.timestamp_s == stamp_s:
            return None
        if self.watchdog_s and self.inputs and now_s - self.inputs[-1][2] > self.watchdog_s:
            self.fields["runtime_state"] = 1
        pose = (*self.pose_of(self.true_m), *HOME[3:])
        return UrState(stamp_s, pose, (0.0,) * 6, **self.fields)

    # control port

    def prepare(self) -> bool:
        return self._input("prepare")

    def kick(self) -> bool:
        return self._input("kick")

    def servo(self, pose: list[float], period_s: float) -> bool:
        target_m = travel_m(tuple(pose), HOME, APPROACH)
        if self.moves:
            self.true_m = target_m
        return self._input("servo", target_m)

    def stop_servo(self, deceleration: float) -> bool:
        return self._input("stop_servo", deceleration)

    def end_program(self) -> None:
        self._input("end_program")

    def upload(self) -> bool:
        self._input("upload")
        self.fields["runtime_state"] = PLAYING
        return self.uploads


class FakeTold:
    """The connection on which the controller tells its configuration, 25 times a second."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.configuration = ArmConfiguration(
            (0.0,) * 6, (0.0, 0.0, 0.1, 0.0, 0.0, 0.0), 1.2, (0.0, 0.0, 0.05), 1.0
        )
        self.silent = False
        self.seen_s = clock.now_s

    def set(self, **fields: Any) -> None:
        """What the controller tells from now on."""
        self.configuration = replace(self.configuration, **fields)

    def poll(self) -> bool:
        if self.silent or self._clock.now_s - self.seen_s < 1.0 / RATE_HZ:
            return False
        self.seen_s = self._clock.now_s
        return True


class FakeLink:
    """The child's end of the socket to the run."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.closed = False
        self.arriving: list[tuple[float, bytes]] = []
        self.sent: list[bytes] = []

    def arrives(self, after_s: float, message: bytes) -> None:
        self.arriving.append((self._clock.now_s + after_s, message))

    def receive(self, wait_s: float) -> list[bytes]:
        self._clock.sleep(wait_s)
        due = [message for at_s, message in self.arriving if at_s <= self._clock.now_s]
        self.arriving = [entry for entry in self.arriving if entry[0] > self._clock.now_s]
        return due

    def send(self, message: bytes) -> None:
        self.sent.append(message)

    def drain(self, timeout_s: float) -> None:
        pass

    def told(self, kind: bytes) -> list[dict[str, Any]]:
        """The rare messages of one kind that went to the run."""
        return [wire.unpack_json(message) for message in self.sent if message[:1] == kind]


def rtde_of(controller: Any, clock: Clock) -> type:
    """Stands in for `RtdeClient`: a package of `controller.state()` every 8 ms, unless `silent`."""

    class Rtde:
        def __init__(self, host: str, deadline_s: float) -> None:
            self._deadline_s = deadline_s

        def close(self) -> None:
            pass

        def version(self) -> None:
            pass

        def start(self, rate_hz: float) -> None:
            pass

        def read(self) -> UrState:
            if controller.silent:
                clock.sleep(self._deadline_s - clock.now_s)
            clock.sleep(PACKAGE_S)
            if clock.now_s > self._deadline_s:
                raise DeviceError("no answer in time", code=FaultCode.NOT_CONNECTED)
            controller.tick()
            return controller.state()

    return Rtde
