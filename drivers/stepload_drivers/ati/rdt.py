"""RDT, the raw data transfer of ATI's Ethernet sensors: UDP requests and records, big endian.

Sources: ATI "Network Force/Torque Sensor System" 9620-05-NET FT (section 9, system status code) and
"F/T Sensor, Ethernet Axia" 9610-05-Ethernet Axia (sections 4.8 and 12).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from stepload.rig.samples import SixFloats

PORT = 49152
HEADER = 0x1234
RECORD_BYTES = 36
MODULUS = 1 << 32

_RECORD = struct.Struct(">III6i")


class Command(IntEnum):
    """What a request asks for. Buffered sending (3) is not used: it holds records back."""

    STOP = 0x0000
    START = 0x0002
    BIAS = 0x0042


class Record(NamedTuple):
    """One measurement. `counts` are Fx, Fy, Fz, Tx, Ty, Tz; the first three numbers are unsigned.

    `rdt_sequence` counts the records of this request from 1, `ft_sequence` the measurements inside
    the device since its power-up, of which only some are sent.
    """

    rdt_sequence: int
    ft_sequence: int
    status: int
    counts: tuple[int, ...]


def request(command: Command, count: int = 0) -> bytes:
    """The 8 bytes of a request; `count` records, 0: until stopped."""
    return struct.pack(">HHI", HEADER, command, count)


def decode(data: bytes) -> Record | None:
    """The record of one datagram; None when it has another length. There is no checksum but UDP's.

    Several records in one datagram are the buffered mode, which is not used here.
    """
    if len(data) != RECORD_BYTES:
        return None
    rdt_sequence, ft_sequence, status, *counts = _RECORD.unpack(data)
    return Record(rdt_sequence, ft_sequence, status, tuple(counts))


def step(before: int, now: int) -> int:
    """Increment of a 32-bit counter, with wrap-around; negative if it went back."""
    ahead = (now - before) % MODULUS
    return ahead if ahead < MODULUS // 2 else ahead - MODULUS


MONITOR = 1 << 16
"""Status bit of a threshold, set on the device's pages, that was passed: no fault of the data."""
SUMMARY = 1 << 31
"""Set together with any other bit that matters."""

_NET_BOX = {
    31: "error summary",
    30: "CPU or RAM",
    29: "digital board",
    28: "analog board",
    27: "serial link to the transducer",
    26: "program memory",
    25: "halted by its configuration",
    24: "settings not valid",
    23: "configuration does not fit the calibration",
    22: "network",
    21: "CAN",
    20: "RDT",
    19: "EtherNet/IP",
    18: "DeviceNet",
    17: "transducer saturated or converter at its end",
    16: "threshold passed",
    14: "watchdog",
    13: "stack",
    12: "serial EEPROM",
    11: "serial flash",
    10: "analog board watchdog",
    9: "excitation current too high",
    8: "excitation current too low",
    7: "analog ground out of range",
    6: "analog supply too high",
    5: "analog supply too low",
    4: "no data from the transducer",
    3: "reference voltage",
    2: "temperature",
    1: "HTTP",
}
_AXIA = {
    31: "error summary",
    30: "beyond the sensing range",
    29: "calibration checksum",
    28: "simulated error",
    27: "gauge out of range",
    26: "gauge nearly out of range",
    16: "threshold passed",
    5: "hardware or firmware",
    3: "busy",
    2: "broken gauge",
    1: "supply voltage",
    0: "temperature",
}


@dataclass(frozen=True, slots=True)
class StatusWord:
    """Status format of one device family: texts by bit, and the bits that mean overload."""

    texts: Mapping[int, str]
    overload: int

    def text(self, status: int) -> str:
        """The meaning of the set bits."""
        return ", ".join(
            self.texts.get(bit, f"bit {bit}") for bit in range(31) if status >> bit & 1
        ) or self.texts.get(31, "error")


NET_BOX = StatusWord(_NET_BOX, 1 << 17)
AXIA = StatusWord(_AXIA, 1 << 30 | 1 << 27 | 1 << 26)


class Scale(NamedTuple):
    """Conversion of counts into N and N·m."""

    force: float
    torque: float

    def wrench(self, counts: Sequence[int]) -> SixFloats:
        """(Fx, Fy, Fz) in N and (Tx, Ty, Tz) in N·m."""
        fx, fy, fz, tx, ty, tz = counts
        force, torque = self.force, self.torque
        return (force * fx, force * fy, force * fz, torque * tx, torque * ty, torque * tz)
