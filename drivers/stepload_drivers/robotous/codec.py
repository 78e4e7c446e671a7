"""ROBOTOUS RFT messages, the same on CAN and UART (RFT Series Manual 1.82, sections 3.3-3.7).

A command is 8 bytes, a response or a sample 16 bytes, both beginning with the command id.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from stepload_drivers.framing import FrameDecoder

UART_START, UART_END = 0x55, 0xAA
UART_FRAME_BYTES = 19
_SAMPLE = struct.Struct(">x6hB")

RATE_CODES = {200.0: 5, 10.0: 1, 20.0: 2, 50.0: 3, 100.0: 4, 333.0: 6, 500.0: 7, 1000.0: 8}
RATE_OF_CODE = {code: rate for rate, code in RATE_CODES.items()} | {0: 200.0}
CUTOFFS_HZ = (500.0, 300.0, 200.0, 150.0, 100.0, 50.0, 40.0, 30.0, 20.0, 10.0, 5.0, 3.0, 2.0, 1.0)
"""Cut-off of filter parameter 1..14. The vendor's C header has them reversed; the manual counts."""

OVERLOAD_AXES = ((0x20, "Fx"), (0x10, "Fy"), (0x08, "Fz"), (0x04, "Tx"), (0x02, "Ty"), (0x01, "Tz"))
ERRORS = {1: "unsupported", 2: "out of range", 3: "failed to set"}


@dataclass(frozen=True, slots=True)
class Model:
    """What turns counts into N and N·m: force = raw / `force_divider`, torque likewise.

    Rated loads: `rated_xy_n` of Fx and Fy, `rated_z_n` of Fz, `rated_nm` of all torques.
    """

    name: str
    force_divider: float
    torque_divider: float
    rated_xy_n: float
    rated_z_n: float
    rated_nm: float


MODELS = (
    Model("RFT80-6A03", 25.0, 500.0, 1000.0, 1000.0, 50.0),
    Model("RFT80-6A02", 50.0, 1000.0, 400.0, 400.0, 20.0),
    Model("RFT80-6A01", 50.0, 1000.0, 400.0, 400.0, 20.0),
    Model("RFT64-6A01", 50.0, 1000.0, 200.0, 200.0, 10.0),
    Model("RFT64-SB01", 50.0, 2000.0, 150.0, 200.0, 4.0),
    Model("RFT60-HA01", 50.0, 2000.0, 150.0, 200.0, 4.0),
    Model("RFT44", 50.0, 2000.0, 100.0, 150.0, 2.5),
    Model("RFT40", 50.0, 2000.0, 100.0, 150.0, 2.5),
)


def model_named(name: str) -> Model | None:
    """The model whose name the sensor's own name begins with; None for an unknown one.

    A wrong torque divider is silent, so it is never assumed.
    """
    return next((model for model in MODELS if name.upper().startswith(model.name)), None)


class Command(IntEnum):
    """Command ids."""

    MODEL = 0x01
    SERIAL = 0x02
    FIRMWARE = 0x03
    SET_BAUD = 0x06
    SET_FILTER = 0x08
    GET_FILTER = 0x09
    READ_ONCE = 0x0A
    START = 0x0B
    STOP = 0x0C
    SET_RATE = 0x0F
    GET_RATE = 0x10
    BIAS = 0x11


SAMPLE_IDS = frozenset({Command.READ_ONCE, Command.START})


def command(name: Command, *parameters: int) -> bytes:
    """The 8-byte command field; unused parameters are 0."""
    return bytes((name, *parameters)).ljust(8, b"\0")


def uart_frame(payload: bytes) -> bytes:
    """`payload` as it goes over the UART: 55 | payload | sum | AA."""
    return bytes((UART_START, *payload, sum(payload) & 0xFF, UART_END))


def wrench(payload: bytes, model: Model) -> tuple[float, float, float, float, float, float]:
    """(Fx, Fy, Fz) in N and (Tx, Ty, Tz) in N·m of a 16-byte sample."""
    fx, fy, fz, tx, ty, tz, _ = _SAMPLE.unpack_from(payload)
    force, torque = model.force_divider, model.torque_divider
    return (fx / force, fy / force, fz / force, tx / torque, ty / torque, tz / torque)


def overload(payload: bytes) -> int:
    """Overload bits of a sample: set while an axis is above 120 % of its rated load."""
    return payload[13] & 0x3F


def overloaded_axes(bits: int) -> str:
    """Names of the axes in overload bits."""
    return " ".join(name for bit, name in OVERLOAD_AXES if bits & bit)


def text(payload: bytes) -> str:
    """The ASCII text of a response (model, serial number, firmware)."""
    return payload[1:].split(b"\0")[0].decode("ascii", "replace").strip()


def uart_payload(raw: bytes) -> bytes | None:
    """The payload of exactly 19 bytes; None when start, end or sum do not fit."""
    payload = raw[1:17]
    ends = raw[0] == UART_START and raw[18] == UART_END
    return payload if ends and sum(payload) & 0xFF == raw[17] else None


class UartDecoder(FrameDecoder[bytes]):
    """Finds 16-byte payloads in a byte stream; data bytes may be 55 or AA."""

    def __init__(self) -> None:
        super().__init__(UART_START, UART_FRAME_BYTES, uart_payload)
