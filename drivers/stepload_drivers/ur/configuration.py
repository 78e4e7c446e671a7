"""The controller's settings, read on an RTDE connection of their own, and checked for changes.

ur_rtde does not know `tcp_offset`, and asks for all of its variables or for none. Here each
variable is requested that the controller may have: a missing one is None, without an error.
`target_speed_fraction` is the speed slider; `speed_scaling`, which is not requested, is its value
after the controller's trajectory limiter. Versions: Universal Robots, RTDE guide; `tcp_offset` is
not in the guide, 3.12 and 5.5.1 have it (Universal_Robots_Client_Library, pull request 110).

Only what is reported can be compared: speed slider, payload mass, its centre of gravity and TCP.
Mounting, safety limits and the rest of the installation are not reported.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload.units import percent
from stepload_drivers.ur import frames
from stepload_drivers.ur.client import RtdeClient
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import Problem

RATE_HZ = 25.0
SAME_SLIDER = 0.005
SAME_KG = 1e-3
SAME_M = 1e-5
SAME_RAD = 1e-5

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


_SLIDER_HINT = (
    "set the speed slider at the foot of the pendant's Run screen to 100 % (in local control), "
    "switch to remote control again and start anew"
)
_SETTING_HINT = (
    "find out who changed it (pendant, another program); put it right in the pendant's "
    "installation, or give tcp_offset, payload_mass and payload_cog, and start anew"
)


def slow_problem(configuration: ArmConfiguration) -> Problem | None:
    """Why the arm would lag behind every target: the speed slider is not at 100 %."""
    fraction = configuration.speed_fraction
    if fraction is None or fraction >= 1.0 - SAME_SLIDER:
        return None
    return Problem(
        FaultCode.UNSUPPORTED,
        f"the speed slider is at {percent(fraction, 2)}, 100 % is needed: the arm would lag",
        _SLIDER_HINT,
    )


def expected(settings: Settings, told: ArmConfiguration) -> ArmConfiguration:
    """Required settings: those set through the options, otherwise as reported at arming.

    Settings that are not reported stay None. The slider must be at 100 %.
    """
    required: dict[str, Any] = {"speed_fraction": 1.0}
    if settings.tcp_offset_m is not None:
        required["tcp_offset"] = (*settings.tcp_offset_m, 0.0, 0.0, 0.0)
    if settings.payload_mass_kg is not None:
        required["payload_kg"] = settings.payload_mass_kg
        required["payload_cog_m"] = settings.payload_cog_m
    reported = {name: to for name, to in required.items() if getattr(told, name) is not None}
    return replace(told, **reported)


def change(armed: ArmConfiguration, told: ArmConfiguration) -> Problem | None:
    """Every setting that has changed since arming, with both values; None: none has."""
    changed = {}
    for name, (setting, differs, text) in _COMPARED.items():
        before, now = getattr(armed, name), getattr(told, name)
        if before is not None and now is not None and differs(before, now):
            changed[name] = f"{setting} from {text(before)} to {text(now)}"
    if not changed:
        return None
    return Problem(
        FaultCode.SETTING_CHANGED,
        f"changed since the arm was opened: {'; '.join(changed.values())}",
        _SLIDER_HINT if list(changed) == ["speed_fraction"] else _SETTING_HINT,
    )


def tcp_changed(armed: ArmConfiguration | None, told: ArmConfiguration | None) -> bool:
    """Whether a pose refers to another point of the arm than at arming, as far as reported."""
    if armed is None or told is None or armed.tcp_offset is None or told.tcp_offset is None:
        return False
    return _other_tcp(armed.tcp_offset, told.tcp_offset)


def _far(before: tuple[float, ...], now: tuple[float, ...], limit: float = SAME_M) -> bool:
    return any(abs(a - b) > limit for a, b in zip(before, now, strict=True))


def _other_tcp(before: tuple[float, ...], now: tuple[float, ...]) -> bool:
    return _far(before[:3], now[:3]) or _far(before[3:], now[3:], SAME_RAD)


def _mm(vector_m: tuple[float, ...]) -> str:
    return f"({', '.join(f'{component * 1e3:g}' for component in vector_m)}) mm"


def _tcp(offset: tuple[float, ...]) -> str:
    rotation = ", ".join(f"{component:g}" for component in offset[3:])
    return f"{_mm(offset[:3])}, rotation ({rotation}) rad"


_COMPARED: dict[str, tuple[str, Callable[[Any, Any], bool], Callable[[Any], str]]] = {
    "speed_fraction": (
        "speed slider", lambda a, b: abs(b - a) > SAME_SLIDER, lambda share: percent(share, 2),
    ),
    "payload_kg": ("payload mass", lambda a, b: abs(b - a) > SAME_KG, "{:.3f} kg".format),
    "payload_cog_m": ("payload centre of gravity", _far, _mm),
    "tcp_offset": ("TCP", _other_tcp, _tcp),
}  # fmt: skip
"""Of each compared setting: its name, whether two values differ, and a value as text."""
