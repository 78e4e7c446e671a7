"""The force-torque sensor in the flange of a UR e-Series arm, read over RTDE."""

from __future__ import annotations

import math
import time
from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import PathText, Setting, Verbatim
from stepload.declaration.sections import SECTION, key
from stepload.errors import DeviceError
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.stream import JUMP_S, ClockWatch, Stream
from stepload_drivers.streamed import STALE_S, Deadline, MaxAge, Streamed, require_serial_number
from stepload_drivers.ur.client import RtdeClient, Version, dashboard
from stepload_drivers.ur.state import UrState

RATE_HZ = 500.0
FROZEN_S = 0.2
WAIT_S = 0.05
E_SERIES = 5
OLDEST: Version = (5, 4, 0, 0)
POWERED = 5
"""Robot modes from here on (idle, backdrive, running) have power in the flange."""

RANGE_N = {"UR3": 30.0, "UR5": 50.0, "UR10": 100.0, "UR16": 160.0}
"""Rated force of each axis by the dashboard's name of the e-Series model; UR, data sheets."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class UrForceOptions:
    """Options of the sensor in the flange of a UR arm."""

    host: Annotated[PathText, key("address of the controller, a number rather than a name")]
    range_n: Annotated[
        Annotated[float, Setting("N", 1.0, 1000.0)] | None,
        key("rated force; a reading of that size is an overload; default: the model's"),
    ] = None
    serial_number: Annotated[Verbatim, key("refuse any other controller; empty: any")] = ""
    max_age_s: MaxAge = STALE_S


class UrForce(Streamed[ForceSample], ForceSensor):
    """`actual_TCP_force`: forces at the TCP in the arm's base frame, less the payload's weight.

    A connection of its own without ur_rtde, for which the arm needs not be driven by this program.
    """

    DRIVER = "ur_force"
    built_into_arm = True
    OPTIONS: ClassVar[type] = UrForceOptions

    rate_hz = RATE_HZ
    _period_s = 1.0 / RATE_HZ

    def __init__(self, **options: Any) -> None:
        told = UrForceOptions(**options)
        self._host, self._serial_number = told.host, told.serial_number
        self._range_n, self._max_age_s = told.range_n, told.max_age_s
        self._name = f"UR sensor at {self._host}"
        self._link: RtdeClient | None = None

    def _connect(self, deadline: Deadline) -> Identity:
        end_s = time.monotonic() + deadline.left_s(self._name)
        client = self._link = RtdeClient(self._host, end_s)
        version = client.version()
        self._check_version(version)
        serial_number, model = dashboard(
            self._host, ["get serial number", "get robot model"], end_s
        )
        require_serial_number(self._name, serial_number, self._serial_number)
        self._limit_n = self._range_n or self._range_of(model)
        client.start(RATE_HZ)
        return Identity(
            self.DRIVER,
            f"{model}e flange",
            serial_number,
            "PolyScope " + ".".join(map(str, version)),
            "the controller's",
        )

    def _check_version(self, version: Version) -> None:
        text = ".".join(map(str, version))
        if version[0] != E_SERIES or version < OLDEST:
            raise DeviceError(
                f"{self._name}: PolyScope {text} is not supported, 5.4 to 5.x is",
                code=FaultCode.UNSUPPORTED,
                hint="only e-Series arms have a sensor in the flange: what a CB3 arm tells is "
                "reckoned from motor currents",
            )

    def _range_of(self, model: str) -> float:
        if model not in RANGE_N:
            raise DeviceError(
                f"{self._name}: no rated force is known for the model {model!r}",
                code=FaultCode.UNSUPPORTED,
                hint="give `range` from the arm's data sheet (force sensing, tool flange)",
            )
        return RANGE_N[model]

    def _new_stream(self) -> Stream[ForceSample]:
        self._sequence = 0
        self._last_s = -math.inf
        self._watch = ClockWatch(self._max_age_s)
        return self._empty_stream(self._max_age_s, FROZEN_S)

    def _read(self, stream: Stream[ForceSample]) -> None:
        assert self._link is not None
        packages = self._link.arrived(WAIT_S)
        arrival_s = time.monotonic()
        fresh = [
            (self._sequence, package)
            for package in packages
            if self._is_next(package.timestamp_s, stream)
        ]
        if not fresh:
            return
        times_s = self._watch.arrivals([p.timestamp_s for _, p in fresh], arrival_s, stream)
        samples = [
            ForceSample(number, p.timestamp_s, time_s, self._status(p, stream), p.wrench, math.nan)
            for (number, p), time_s in zip(fresh, times_s, strict=True)
        ]
        stream.put(samples, arrival_s)

    def _is_next(self, stamp_s: float, stream: Stream[ForceSample]) -> bool:
        """Whether a package is a new one; the same again, as a frozen controller sends, is not."""
        step_s = stamp_s - self._last_s if self._sequence else 1.0 / RATE_HZ
        if step_s == 0.0:
            stream.count("repeated")
            return False
        if not 0.0 < step_s < JUMP_S:
            stream.latch(
                FaultCode.CLOCK,
                f"{self._name}: the controller's clock went on by {step_s:.3f} s from one package "
                "to the next",
                "was the controller restarted? Start anew, tare again",
            )
        steps = max(1, round(step_s * RATE_HZ))
        stream.lose(steps - 1)
        self._sequence += steps
        self._last_s = stamp_s
        return True

    def _status(self, package: UrState, stream: Stream[ForceSample]) -> int:
        status = 0
        if max(map(abs, package.wrench[:3])) >= self._limit_n:
            status |= Status.OVERRANGE
            told = ", ".join(f"{force:.1f}" for force in package.wrench[:3])
            stream.latch(
                FaultCode.OVERLOAD,
                f"{self._name} reads {told} N, its rated force is {self._limit_n:g} N",
                "unload, and check the zero before going on",
            )
        if package.robot_mode < POWERED:
            status |= Status.DEVICE_FAULT
            stream.latch(
                FaultCode.DEVICE_REPORTS,
                f"{self._name}: the arm is without power (robot_mode {package.robot_mode}), and "
                "so is the sensor in its flange",
                "power the arm on, release the brakes, let the sensor warm up, tare again",
            )
        return int(status)
