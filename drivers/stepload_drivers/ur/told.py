"""How the arm stands and what it is set to, on an RTDE connection of its own beside the data.

ur_rtde does not know `tcp_offset`, and asks for all of its variables or for none. Here the
controller is asked for each variable that it may have: one that it lacks is None, nothing fails.
`target_speed_fraction` is the speed slider; `speed_scaling`, which is not asked for, is what the
controller's trajectory limiter makes of it. Versions: Universal Robots, RTDE guide; `tcp_offset` is
not in the guide, 3.12 and 5.5.1 have it (Universal_Robots_Client_Library, pull request 110).
"""

from __future__ import annotations

import contextlib
import time

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.samples import SixFloats
from stepload_drivers.ur import frames
from stepload_drivers.ur.client import RtdeClient

RATE_HZ = 25.0

WANTED = {
    "actual_q": (6, 7.0),
    "target_speed_fraction": (1, 1.5),
    "payload": (1, 100.0),
    "payload_cog": (3, 5.0),
    "tcp_offset": (6, 10.0),
    "target_TCP_pose": (6, 10.0),
}
"""Variables asked for: how many numbers each has, and the largest that can be true (SI units)."""


class ToldClient(RtdeClient):
    """One connection over which the controller tells its configuration `RATE_HZ` times a second.

    Args:
        host: address of the controller.
        deadline_s: monotonic time by which connecting and asking must be done.

    Raises:
        DeviceError: no connection, no answer by the deadline, or none of RTDE's.
    """

    def __init__(self, host: str, deadline_s: float) -> None:
        super().__init__(host, deadline_s)
        self.configuration: ArmConfiguration | None = None
        self.seen_s = time.monotonic()
        self._names: list[str] = []
        try:
            self.version()
            self._subscribe()
        except DeviceError:
            self.close()
            raise

    def first(self) -> ArmConfiguration:
        """The configuration, waited for.

        Raises:
            DeviceError: none by the deadline.
        """
        while self.configuration is None:
            self._take(self._next())
        return self.configuration

    def poll(self) -> bool:
        """Take in what has arrived, never waiting; whether a configuration was among it.

        A connection that is lost or no longer tells sense shows as a `seen_s` that stands still.
        """
        self._sock.setblocking(False)
        with contextlib.suppress(OSError, frames.FrameError):
            while data := self._sock.recv(65536):
                self._frames += self._reader.feed(data)
        taken = [self._take(frame) for frame in self._frames]
        self._frames.clear()
        return any(taken)

    def _subscribe(self) -> None:
        """Ask for all; a controller that lacks some names them, and is asked for the others."""
        self._names = list(WANTED)
        types = self._outputs(RATE_HZ, self._names)
        lacking = [name for name, kind in zip(self._names, types, strict=False)
                   if kind not in frames.FORMATS]  # fmt: skip
        if lacking:
            self._names = [name for name in self._names if name not in lacking]
            types = self._outputs(RATE_HZ, self._names)
        self._begin(types)

    def _take(self, frame: frames.Frame) -> bool:
        """Whether the frame told a configuration; one that cannot be true is passed over."""
        if frame.kind != frames.DATA or len(frame.payload) != self._layout.size:
            return False
        numbers = self._layout.unpack(frame.payload)[1:]
        values: dict[str, tuple[float, ...]] = {}
        for name in self._names:
            count, limit = WANTED[name]
            values[name], numbers = numbers[:count], numbers[count:]
            if not all(abs(number) <= limit for number in values[name]):  # nor if it is NaN
                return False
        self.configuration = _configuration(values)
        self.seen_s = time.monotonic()
        return True


def _configuration(values: dict[str, tuple[float, ...]]) -> ArmConfiguration:
    slider, mass = values.get("target_speed_fraction"), values.get("payload")
    cog = values.get("payload_cog")
    return ArmConfiguration(
        joints_rad=values.get("actual_q"),
        tcp_offset=_six(values.get("tcp_offset")),
        payload_kg=None if mass is None else mass[0],
        payload_cog_m=None if cog is None else (cog[0], cog[1], cog[2]),
        speed_fraction=None if slider is None else slider[0],
        held_pose=_six(values.get("target_TCP_pose")),
    )


def _six(values: tuple[float, ...] | None) -> SixFloats | None:
    if values is None:
        return None
    one, two, three, four, five, six = values
    return one, two, three, four, five, six


def told(host: str, deadline_s: float) -> ArmConfiguration:
    """The configuration of the controller at `host`, asked once.

    Raises:
        DeviceError: none by the deadline.
    """
    with contextlib.closing(ToldClient(host, deadline_s)) as client:
        return client.first()
