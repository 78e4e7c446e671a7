"""An emulated ATI Net F/T: RDT over UDP, and its page of settings over HTTP."""

from __future__ import annotations

import struct

from stepload_drivers.ati.rdt import HEADER, MODULUS, SUMMARY, Command, Record
from stepload_verify.emulators.emulator import Measured
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import Wrench, WrenchSource

REQUEST_BYTES = 8
UNITS = {"N": 1.0, "lbf": 4.4482216152605, "kN": 1000.0}
SATURATED = 1 << 17
SATURATED_SHARE = 1.5


def requested(data: bytes) -> tuple[int, int] | None:
    """Command and count of a request; None when it is none."""
    if len(data) != REQUEST_BYTES:
        return None
    header, command, count = struct.unpack(">HHI", data)
    return (command, count) if header == HEADER else None


def encode(record: Record) -> bytes:
    """The 36 bytes of `record`."""
    return struct.pack(">III6i", *record[:3], *record.counts)


class NetBox:
    """Counts of the source's wrench at `rate_hz` out of `internal_hz`; saturates at 1.5 × rated.

    Args:
        units: of the force: N, lbf or kN; torque is in N·m.
        counts: per unit of force and of torque.
    """

    def __init__(
        self,
        source: WrenchSource,
        board: FaultBoard,
        rate_hz: float = 1000.0,
        internal_hz: float = 7000.0,
        serial_number: str = "EMULATED",
        rated_n: float = 200.0,
        units: str = "N",
        counts: int = 1_000_000,
    ) -> None:
        self._board = board
        self._measured = Measured(source, board, rated_n)
        self._rated_n = rated_n
        self._internal_hz = internal_hz
        self._every = max(1, round(internal_hz / rate_hz))
        self._serial_number = serial_number
        self._units, self._counts = units, counts
        self._streams = False
        self._sent = 0
        self._measurements = 12345
        self._bias: Wrench = (0.0,) * 6
        self._wrapped = self._jumped = False
        self.options: dict[str, object] = {}

    @property
    def period_s(self) -> float | None:
        return self._every / self._internal_hz if self._streams else None

    def page(self) -> str:
        """`netftapi2.xml`; "" while it does not answer."""
        if self._board.on("deaf"):
            return ""
        counts = self._counts * (10 if self._board.on("wrong_model") else 1)
        rated = self._rated_n / UNITS[self._units]
        entries = {
            "runstat": "0x00000000",
            "runrate": f"{self._internal_hz:.0f}",
            "cfgcalsel": 0,
            "cfgcalsn": self._serial_number,
            "scfgfu": self._units,
            "scfgtu": "Nm",
            "cfgtfx": "0;0;0;0;0;0",
            "cfgcpf": counts,
            "cfgcpt": self._counts,
            "cfgmr": ";".join([f"{rated:g}"] * 3 + ["10"] * 3),
            "setuserfilter": 0,
            "comrdte": "Disabled" if self._board.on("refuse") else "Enabled",
            "comrdtrate": f"{self._internal_hz / self._every:.0f}",
            "mfgdigver": "2.2.59",
        }
        body = "".join(f"<{key}>{value}</{key}>" for key, value in entries.items())
        return f'<?xml version="1.0"?><netft>{body}</netft>'

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        found = requested(data[:REQUEST_BYTES])
        if found is None or self._board.on("deaf"):
            return []
        command, _ = found
        if command == Command.START:
            self._streams, self._sent = True, 0
        elif command == Command.STOP:
            self._streams = False
        elif command == Command.BIAS:
            self._bias = self._measured.wrench(now_s)
        return []

    def restart(self, now_s: float) -> list[list[bytes]]:
        """After power-up it sends nothing until it is asked again."""
        self._streams, self._measurements, self._bias = False, 0, (0.0,) * 6
        return []

    def sample(self, time_s: float) -> list[bytes]:
        self._sent += 1
        self._advance()
        wrench = self._measured.wrench(time_s)
        numbers = self._sent % MODULUS, self._measurements % MODULUS
        return [encode(Record(*numbers, self._status(wrench), self._values(wrench)))]

    def _advance(self) -> None:
        """The device's own count, with the faults of its clock."""
        if (left_s := self._board.magnitude("wrap")) is not None and not self._wrapped:
            self._measurements, self._wrapped = MODULUS - round(left_s * self._internal_hz), True
        if (jump_s := self._board.magnitude("clock_jump")) is not None and not self._jumped:
            self._measurements += round(jump_s * self._internal_hz)
            self._jumped = True
        if not self._board.on("clock_stop"):
            self._measurements += self._every

    def _values(self, wrench: Wrench) -> tuple[int, ...]:
        limit_n = SATURATED_SHARE * self._rated_n
        scales = (self._counts / UNITS[self._units],) * 3 + (self._counts,) * 3
        return tuple(
            round(scale * (min(max(value, -limit_n), limit_n) - zero))
            for scale, value, zero in zip(scales, wrench, self._bias, strict=True)
        )

    def _status(self, wrench: Wrench) -> int:
        full = max(map(abs, wrench[:3])) > SATURATED_SHARE * self._rated_n
        status = SATURATED if full else 0
        if (bit := self._board.magnitude("status")) is not None:
            status |= 1 << int(bit)
        return status | (SUMMARY if status else 0)
