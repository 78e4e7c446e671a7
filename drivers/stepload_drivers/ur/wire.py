"""Messages between the run's process and the child that holds ur_rtde, one per datagram.

The first byte is the kind. Samples and targets are packed; the rest, which is rare, is JSON.
"""

from __future__ import annotations

import json
import struct
from dataclasses import asdict
from typing import Any

from stepload.rig.device import ArmConfiguration
from stepload_drivers.motion import NO_SHIFT, Shift
from stepload_drivers.ur.state import UrState

SAMPLE = b"s"
TARGET = b"t"
BEAT = b"b"
STAGE = b"g"
HELLO = b"h"
FAULT = b"f"
REQUEST = b"r"
REPLY = b"a"
CONFIGURATION = b"c"

MAX_BYTES = 8192

_SAMPLE = struct.Struct("=cd13d3iI")
_TARGET = struct.Struct("=c3d")


def pack_sample(receive_time_s: float, state: UrState) -> bytes:
    """One data package and the host's monotonic time at which it was seen."""
    return _SAMPLE.pack(
        SAMPLE,
        receive_time_s,
        state.timestamp_s,
        *state.pose,
        *state.wrench,
        state.robot_mode,
        state.safety_mode,
        state.runtime_state,
        state.safety_bits,
    )


def unpack_sample(message: bytes) -> tuple[float, UrState]:
    """Inverse of `pack_sample`.

    Raises:
        ValueError: not a sample message.
    """
    if len(message) != _SAMPLE.size or message[:1] != SAMPLE:
        raise ValueError(f"not a sample: {len(message)} bytes of kind {message[:1]!r}")
    v = _SAMPLE.unpack(message)
    return v[1], UrState(v[2], v[3:9], v[9:15], v[15], v[16], v[17], v[18])


def pack_target(position_m: float, shift_m: Shift = NO_SHIFT) -> bytes:
    return _TARGET.pack(TARGET, position_m, *shift_m)


def unpack_target(message: bytes) -> tuple[float, Shift]:
    """Travel along the approach, and across it."""
    _, position_m, x_m, y_m = _TARGET.unpack(message)
    return position_m, (x_m, y_m)


def pack_json(kind: bytes, **fields: Any) -> bytes:
    """A rare message.

    Raises:
        ValueError: longer than a datagram may be.
    """
    message = kind + json.dumps(fields).encode()
    if len(message) > MAX_BYTES:
        raise ValueError(f"message of {len(message)} bytes, the limit is {MAX_BYTES}")
    return message


def unpack_json(message: bytes) -> dict[str, Any]:
    fields: dict[str, Any] = json.loads(message[1:])
    return fields


def pack_configuration(configuration: ArmConfiguration) -> bytes:
    return pack_json(CONFIGURATION, **asdict(configuration))


def unpack_configuration(message: bytes) -> ArmConfiguration:
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in unpack_json(message).items()
    }
    return ArmConfiguration(**values)
