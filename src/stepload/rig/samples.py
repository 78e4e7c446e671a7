"""What devices deliver: one immutable row per measurement, in SI units, with its own times.

Named tuples, because they are made thousands of times a second.
Times: `device_time_s` is the device's own clock (NaN where it has none), `receive_time_s` the
host's monotonic clock at the moment the sample was taken off the wire. `sequence` counts what
the device *produced*: a step of 2 means that one was lost on the way.
"""

from __future__ import annotations

from enum import IntFlag
from typing import NamedTuple


class Status(IntFlag):
    """Bits of a sample's `status`; 0 is good. In hot loops compare the plain int."""

    OK = 0
    OVERRANGE = 1
    """Beyond the rated range; the value may be wrong."""
    SATURATED = 2
    """A gauge or converter at its end stop; the value is wrong."""
    INVALID = 4
    """The device itself says that the sample is not usable."""
    DEVICE_FAULT = 8
    """The device reports a fault of its own (supply, temperature, memory)."""
    STOPPED = 16
    """Arm only: not able to follow commands (protective, emergency, safeguard stop, no program)."""


class ForceSample(NamedTuple):
    """One wrench of a force sensor, as measured (not tared), in the sensor's frame.

    `wrench` is (Fx, Fy, Fz) in N and (Tx, Ty, Tz) in N·m; a one-axis cell puts its force into Fz
    and zero elsewhere. `temperature_c` is NaN where the device does not tell.
    """

    sequence: int
    device_time_s: float
    receive_time_s: float
    status: int
    wrench: tuple[float, float, float, float, float, float]
    temperature_c: float


class ArmSample(NamedTuple):
    """One state of the arm.

    `position_m` is the measured travel along the approach axis from the arm's start pose, positive
    towards the plate. `force_n` is the arm's own (second) force channel, positive when pressing,
    NaN where the arm has none. `pose` is the TCP pose (x, y, z in m, rotation vector in rad) in
    the arm's base frame; a one-axis machine gives (0, 0, -position, 0, 0, 0).
    """

    sequence: int
    device_time_s: float
    receive_time_s: float
    status: int
    position_m: float
    force_n: float
    pose: tuple[float, float, float, float, float, float]


class DisplacementSample(NamedTuple):
    """One reading of a displacement gauge across the contact; positive when the gap closes."""

    sequence: int
    device_time_s: float
    receive_time_s: float
    status: int
    displacement_m: float
