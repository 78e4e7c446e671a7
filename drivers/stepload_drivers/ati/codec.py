"""ATI NETCANOEM messages ("CAN Bus and Serial Bus Network Interface for OEM", 9610-05-1030-04).

An 11-bit id is (base << 4) | operation; all data are big-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from stepload_drivers.units import UNITS_N, UNITS_NM

AXES = 6
DEFAULT_BASE = 0x20
OLD_COUNTS = 1_000_000
UNITS_FIRMWARE = (3, 7)
GAUGE_LOW, GAUGE_HIGH = -32768, 32767

FORCE_UNITS_N = {
    code: (name, UNITS_N[name])
    for code, name in enumerate(("lbf", "N", "klbf", "kN", "kgf", "gf"), start=1)
}
TORQUE_UNITS_NM = {
    code: (name, UNITS_NM[name.replace("-", "")])
    for code, name in enumerate(("lbf-in", "lbf-ft", "N-m", "N-mm", "kgf-cm", "kN-m"), start=1)
}

STATUS_TEXT = {
    0: "watchdog reset",
    1: "DAC or ADC too high",
    2: "DAC or ADC too low",
    3: "analog ground out of range",
    4: "supply too high",
    5: "supply too low",
    6: "bad calibration",
    7: "EEPROM failure",
    8: "configuration invalid, runs on defaults",
    11: "too hot",
    12: "too cold",
    14: "CAN bus error",
    15: "any error",
}
CRITICAL = sum(1 << bit for bit in range(1, 8))
"""Bits 1-7: the readings are wrong although they keep coming."""


class Op(IntEnum):
    """Operations: the low four bits of the id."""

    GAUGES = 0x0
    GAUGES_2 = 0x1
    MATRIX = 0x2
    MATRIX_2 = 0x3
    MATRIX_3 = 0x4
    SERIAL = 0x5
    CALIBRATION = 0x6
    COUNTS = 0x7
    UNITS = 0x8
    RESET = 0xC
    FIRMWARE = 0xF


def frame_id(base: int, op: Op) -> int:
    """The CAN id of an operation."""
    return base << 4 | op


def status_text(status: int) -> str:
    """The meaning of the set bits of a status word."""
    return ", ".join(STATUS_TEXT.get(bit, f"bit {bit}") for bit in range(16) if status >> bit & 1)


def gauges(first: bytes, second: bytes) -> tuple[int, tuple[int, ...]]:
    """Status word and gauge counts sg0..sg5 of an answer's two frames (8 and 6 bytes)."""
    status, sg0, sg2, sg4 = struct.unpack(">Hhhh", first)
    sg1, sg3, sg5 = struct.unpack(">hhh", second)
    return status, (sg0, sg1, sg2, sg3, sg4, sg5)


def saturated(counts: Sequence[int]) -> bool:
    """Whether a gauge is at its end stop (overload or broken cable): the sample is unusable."""
    return min(counts) <= GAUGE_LOW or max(counts) >= GAUGE_HIGH


def matrix_row(frames: Mapping[Op, bytes]) -> tuple[float, ...]:
    """One axis of the matrix from its three frames (two float32 each, SG0..SG5)."""
    return tuple(
        value
        for op in (Op.MATRIX, Op.MATRIX_2, Op.MATRIX_3)
        for value in struct.unpack(">ff", frames[op])
    )


@dataclass(frozen=True, slots=True)
class Calibration:
    """Conversion of gauge counts into N and N·m: `rows[axis][gauge]`, all factors included."""

    rows: tuple[tuple[float, ...], ...]

    @classmethod
    def from_device(
        cls,
        matrix: Sequence[Sequence[float]],
        counts_per_force: int,
        counts_per_torque: int,
        force_unit_n: float,
        torque_unit_nm: float,
    ) -> Calibration:
        """Matrix over counts per unit (operation 7), times the unit (operation 8)."""
        force, torque = force_unit_n / counts_per_force, torque_unit_nm / counts_per_torque
        scales = (force,) * 3 + (torque,) * 3
        return cls(
            tuple(
                tuple(scale * value for value in row)
                for scale, row in zip(scales, matrix, strict=True)
            )
        )

    def wrench(self, counts: Sequence[int]) -> tuple[float, float, float, float, float, float]:
        """(Fx, Fy, Fz) in N and (Tx, Ty, Tz) in N·m; not tared (the device has no bias)."""
        g0, g1, g2, g3, g4, g5 = counts
        fx, fy, fz, tx, ty, tz = (
            a * g0 + b * g1 + c * g2 + d * g3 + e * g4 + f * g5 for a, b, c, d, e, f in self.rows
        )
        return (fx, fy, fz, tx, ty, tz)
