"""What devices deliver: one immutable row per measurement, in SI units, with its own times.

Named tuples, because they are made thousands of times a second.
Times: `device_time_s` is the device's own clock (NaN where it has none), `receive_time_s` the
host's monotonic clock at the moment the sample was taken off the wire. `sequence` counts what
the device *produced*: a step of 2 means that one was lost on the way.

Each row type is declared once, as `…Fields`, for one row and for columns of many rows alike. The
record's bytes, its message definitions and its reader follow from that declaration; an `Annotated`
text is the comment that a message definition gives to the field.
"""

from __future__ import annotations

import math
from enum import IntFlag
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, cast

Whole = TypeVar("Whole")
"""int in a row, shape (N,) of int64 in columns."""
Number = TypeVar("Number")
"""float in a row, shape (N,) of float64 in columns."""
Six = TypeVar("Six")
"""Six floats in a row, shape (N, 6) of float64 in columns."""
SixFloats = tuple[float, float, float, float, float, float]
NOT_TOLD: SixFloats = (math.nan,) * 6
"""Six numbers of a device that does not report them."""


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


class ForceFields(NamedTuple, Generic[Whole, Number, Six]):
    """One wrench of a force sensor, as measured (not tared), in the sensor's frame.

    `wrench` is (Fx, Fy, Fz) in N and (Tx, Ty, Tz) in N·m; a one-axis cell puts its force into Fz
    and zero elsewhere. `temperature_c` is NaN where the device does not report it.
    """

    sequence: Whole
    device_time_s: Annotated[Number, "the device's own clock, NaN: none"]
    receive_time_s: Annotated[Number, "the host's monotonic clock"]
    status: Annotated[Whole, "bits: 1 overrange, 2 saturated, 4 invalid, 8 device fault"]
    wrench: Six
    temperature_c: Annotated[Number, "NaN: not told"]


class ForceSample(ForceFields[int, float, SixFloats]):
    """One row of `ForceFields`."""

    __slots__ = ()


class ArmFields(NamedTuple, Generic[Whole, Number, Six]):
    """One state of the arm.

    `position_m` is the measured travel along the approach axis from the arm's start pose, positive
    towards the plate. `force_n` is the arm's own (second) force channel, positive when pressing,
    NaN where the arm has none. `pose` is the TCP pose (x, y, z in m, rotation vector in rad) in
    the arm's base frame; a one-axis machine gives (0, 0, -position, 0, 0, 0).

    `wrench` is all of the arm's own force, not tared: what the tip does to the plate, in the
    pressing frame of `Arm`, so that its third component is `force_n`; torques about the TCP. NaN
    where the arm reports `force_n` alone, or no torques.
    """

    sequence: Whole
    device_time_s: Annotated[Number, "the controller's own clock"]
    receive_time_s: Annotated[Number, "the host's monotonic clock"]
    status: Annotated[Whole, "bits as in ForceSample, 16: not able to follow commands"]
    position_m: Annotated[Number, "travel towards the plate"]
    force_n: Annotated[Number, "the arm's own force channel, NaN: none"]
    pose: Annotated[Six, "x, y, z in m, rotation vector in rad"]
    wrench: Annotated[
        Six, "the arm's own, on the plate, axis 3 along the approach; NaN: not told"
    ] = cast(Any, NOT_TOLD)


class ArmSample(ArmFields[int, float, SixFloats]):
    """One row of `ArmFields`."""

    __slots__ = ()


class DisplacementFields(NamedTuple, Generic[Whole, Number]):
    """One reading of a displacement gauge across the contact; positive when the gap closes."""

    sequence: Whole
    device_time_s: Number
    receive_time_s: Number
    status: Whole
    displacement_m: Annotated[Number, "positive when the gap closes"]


class DisplacementSample(DisplacementFields[int, float]):
    """One row of `DisplacementFields`."""

    __slots__ = ()
