"""Faults that an emulator can show, switched on the command line or while it runs."""

from __future__ import annotations

import math
import re
import time
from dataclasses import dataclass

from stepload.errors import BadInputError

FAULTS: dict[str, tuple[float, str]] = {
    "drop": (1.0, "samples not sent (probability)"),
    "bit_flip": (0.05, "one bit of a frame flipped on the wire (probability)"),
    "noise": (0.05, "1 to 20 noise bytes before a frame (probability)"),
    "cut": (0.05, "frame cut short on the wire (probability)"),
    "late": (0.015, "answers or samples delayed (s)"),
    "lag": (0.5, "samples or answers come ever later (s per s), as through a buffer that fills"),
    "batch": (0.016, "bytes held back and sent in bursts (s), as an FTDI adapter does"),
    "freeze": (1.0, "values stand still, frames go on"),
    "zero": (1.0, "all readings are exactly zero"),
    "drift": (10.0, "zero drift (N/min)"),
    "offset": (20.0, "zero offset (N)"),
    "gain": (0.5, "values scaled by this factor, as by a wrong divider or unit; -1: wrong sign"),
    "swap": (1.0, "forces appear along the next axis: x as y, y as z, z as x"),
    "overrange": (2.0, "beyond the rated load (multiple of it)"),
    "nan": (1.0, "not-a-number values, where the protocol can carry them"),
    "status": (2.0, "a status bit of the device (bit number)"),
    "silent": (1.0, "the device stops sending, the link stays open"),
    "restart": (1.0, "the device restarts once: settings, bias and stream as after power-up"),
    "second_reader": (0.3, "another process takes bytes off the serial port (probability)"),
    "second_client": (1.0, "another program asks for the stream of a device that serves one"),
    "unplug": (1.0, "the port or connection goes away for good"),
    "wrong_model": (1.0, "identifies itself as another model, or tells another divider"),
    "wrap": (1.0, "the device clock wraps this long after the fault starts (s)"),
    "clock_stop": (1.0, "the device clock stands still"),
    "clock_jump": (30.0, "the device clock jumps ahead once (s)"),
    "torn": (0.2, "second CAN frame of a pair left out (probability)"),
    "refuse": (1.0, "commands are answered with an error"),
    "deaf": (1.0, "commands are not answered"),
}
"""Default magnitude and meaning of each fault."""

_TEXT = re.compile(
    r"(?P<name>[a-z_]+)(:(?P<magnitude>-?[.\d]+(e-?\d+)?))?(@(?P<start>[.\d]+))?(\+(?P<duration>[.\d]+))?"
)


@dataclass(frozen=True, slots=True)
class TimedFault:
    """A fault from `start_s` after the emulator's start, for `duration_s`."""

    name: str
    magnitude: float
    start_s: float
    duration_s: float


def parse_fault(text: str) -> TimedFault:
    """`NAME[:MAGNITUDE][@START][+DURATION]`, times in seconds; without end it stays.

    Raises:
        BadInputError: unknown name or malformed number.
    """
    match = _TEXT.fullmatch(text.strip())
    try:
        if match is None:
            raise ValueError(text)
        name = match["name"]
        magnitude = float(match["magnitude"] or FAULTS[name][0])
        start_s, duration_s = float(match["start"] or 0.0), float(match["duration"] or math.inf)
    except (ValueError, KeyError) as error:
        raise BadInputError(
            f"{text!r} is no fault",
            hint=f"NAME[:MAGNITUDE][@START][+DURATION], NAME one of {', '.join(FAULTS)}",
        ) from error
    return TimedFault(name, magnitude, start_s, duration_s)


class FaultBoard:
    """Which faults are on. Reading is safe from any thread while another switches."""

    def __init__(self, faults: tuple[TimedFault, ...] = ()) -> None:
        self._started_s = time.monotonic()
        self._faults = faults

    def switch_on(self, name: str, magnitude: float | None = None) -> None:
        """Show a fault from now on."""
        value = FAULTS[name][0] if magnitude is None else magnitude
        self.add(TimedFault(name, value, 0.0, math.inf))

    def add(self, fault: TimedFault) -> None:
        """Show `fault`; its start counts from now."""
        start_s = time.monotonic() - self._started_s + fault.start_s
        self._faults += (TimedFault(fault.name, fault.magnitude, start_s, fault.duration_s),)

    def clear(self) -> None:
        """All faults off."""
        self._faults = ()

    def magnitude(self, name: str) -> float | None:
        """The magnitude of a fault that is on now, else None."""
        faults = self._faults
        if not faults:
            return None
        now_s = time.monotonic() - self._started_s
        for fault in faults:
            if fault.name == name and 0.0 <= now_s - fault.start_s < fault.duration_s:
                return fault.magnitude
        return None

    def on(self, name: str) -> bool:
        return self.magnitude(name) is not None

    def since_s(self, name: str) -> float:
        """Seconds since a fault that is on now began; 0 when it is off."""
        now_s = time.monotonic() - self._started_s
        for fault in self._faults:
            if fault.name == name and 0.0 <= now_s - fault.start_s < fault.duration_s:
                return now_s - fault.start_s
        return 0.0
