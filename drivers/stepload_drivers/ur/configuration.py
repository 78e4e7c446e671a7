"""Configuration and settings of the arm, read on a separate RTDE connection.

ur_rtde does not know `tcp_offset`, and asks for all of its variables or for none. Here each
variable is requested that the controller may have: a missing one is None, without an error.
`target_speed_fraction` is the speed slider; `speed_scaling`, which is not requested, is its value
after the controller's trajectory limiter. Versions: Universal Robots, RTDE guide; `tcp_offset` is
not in the guide, 3.12 and 5.5.1 have it (Universal_Robots_Client_Library, pull request 110).
"""

from __future__ import annotations

import contextlib
import time
from typing import Any

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
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
"""Requested variables: number of values of each, and the largest possible one (SI units)."""


class ConfigurationClient(RtdeClient):
    """A connection on which the controller reports its configuration `RATE_HZ` times a second.

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
        """Wait for the configuration.

        Raises:
            DeviceError: none by the deadline.
        """
        while self.configuration is None:
            self._take(self._next())
        return self.configuration

    def poll(self) -> bool:
        """Process received data without waiting; returns whether a configuration was among it.

        A connection that is lost or sends invalid data shows as a constant `seen_s`.
        """
        self._sock.setblocking(False)
        with contextlib.suppress(OSError, frames.FrameError):
            while data := self._sock.recv(65536):
                self._frames += self._reader.feed(data)
        taken = [self._take(frame) for frame in self._frames]
        self._frames.clear()
        return any(taken)

    def _subscribe(self) -> None:
        """Request all variables; if the controller lacks some, request the others."""
        self._names = list(WANTED)
        types = self._outputs(RATE_HZ, self._names)
        lacking = [name for name, kind in zip(self._names, types, strict=False)
                   if kind not in frames.FORMATS]  # fmt: skip
        if lacking:
            self._names = [name for name in self._names if name not in lacking]
            types = self._outputs(RATE_HZ, self._names)
        self._begin(types)

    def _take(self, frame: frames.Frame) -> bool:
        """Whether the frame held a configuration; one with impossible values is ignored."""
        if frame.kind != frames.DATA or len(frame.payload) != self._layout.size:
            return False
        numbers = self._layout.unpack(frame.payload)[1:]
        values: dict[str, Any] = {}
        for name in self._names:
            count, limit = WANTED[name]
            values[name], numbers = numbers[:count], numbers[count:]
            if not all(abs(number) <= limit for number in values[name]):  # nor if it is NaN
                return False
        self.configuration = _configuration(values)
        self.seen_s = time.monotonic()
        return True


def _configuration(values: dict[str, Any]) -> ArmConfiguration:
    slider, mass = values.get("target_speed_fraction"), values.get("payload")
    return ArmConfiguration(
        joints_rad=values.get("actual_q"),
        tcp_offset=values.get("tcp_offset"),
        payload_kg=None if mass is None else mass[0],
        payload_cog_m=values.get("payload_cog"),
        speed_fraction=None if slider is None else slider[0],
        held_pose=values.get("target_TCP_pose"),
    )


def read_configuration(host: str, deadline_s: float) -> ArmConfiguration:
    """The configuration of the controller at `host`, read once.

    Raises:
        DeviceError: none by the deadline.
    """
    with contextlib.closing(ConfigurationClient(host, deadline_s)) as client:
        return client.first()
