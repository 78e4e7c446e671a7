"""Bota Systems serial frames (Rokubi, SensONE): 37 bytes, little-endian, CRC-16/X-25."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from enum import IntFlag
from typing import NamedTuple

from stepload_drivers.framing import FrameDecoder

HEADER = 0xAA
FRAME_BYTES = 37
CLOCK_MODULUS_US = 1 << 32
_FRAME = struct.Struct("<xH6fIf2x")
_MIRROR = bytes(int(f"{value:08b}"[::-1], 2) for value in range(256))

SINC_OF_RATE = {1000.0: 51, 800.0: 64, 400.0: 128, 250.0: 205, 200.0: 256, 100.0: 512}
SINC_STEP_S = 19.53125e-6
BAUD_CODES = {9600: 0, 57600: 1, 115200: 2, 230400: 3, 460800: 4}


class FrameStatus(IntFlag):
    """Status bits of a frame; 4-15 are reserved."""

    APP_TOOK_TOO_LONG = 1
    OVERRANGE = 2
    INVALID = 4
    RAW = 8


class Frame(NamedTuple):
    """One frame; forces in N, torques in N·m, `clock_us` wraps at 2^32."""

    status: int
    wrench: tuple[float, float, float, float, float, float]
    clock_us: int
    temperature_c: float


def crc_x25(data: bytes) -> int:
    """CRC-16/X-25 (polynomial 1021 reflected, start and final xor FFFF); check value 906E.

    Mirroring the bits of each byte turns it into the unreflected CRC of the standard library.
    """
    plain = crc_hqx(data.translate(_MIRROR), 0xFFFF)
    return (_MIRROR[plain & 0xFF] << 8 | _MIRROR[plain >> 8]) ^ 0xFFFF


def decode(raw: bytes) -> Frame | None:
    """The frame in exactly 37 bytes; None when header or CRC do not fit."""
    if raw[0] != HEADER or crc_x25(raw[1:35]) != raw[35] | raw[36] << 8:
        return None
    status, fx, fy, fz, mx, my, mz, clock_us, temperature_c = _FRAME.unpack(raw)
    return Frame(status, (fx, fy, fz, mx, my, mz), clock_us, temperature_c)


class Decoder(FrameDecoder[Frame]):
    """Finds frames in a byte stream; AA is common inside a frame."""

    def __init__(self) -> None:
        super().__init__(HEADER, FRAME_BYTES, decode)


class DeviceClock:
    """Extends the 32-bit microsecond counter (it wraps every 71.6 min) to seconds without wraps."""

    def __init__(self) -> None:
        self._last_us: int | None = None
        self._total_us = 0

    def advance(self, clock_us: int) -> tuple[float, float]:
        """Device time and the step since the sample before, both in s (first step 0)."""
        if self._last_us is None:
            self._total_us = clock_us
            step_us = 0
        else:
            step_us = (clock_us - self._last_us) % CLOCK_MODULUS_US
            self._total_us += step_us
        self._last_us = clock_us
        return self._total_us * 1e-6, step_us * 1e-6
