"""Requests to a NETCANOEM before it is polled."""

from __future__ import annotations

import logging
import math
import struct

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ati.codec import (
    AXES,
    FORCE_UNITS_N,
    OLD_COUNTS,
    TORQUE_UNITS_NM,
    UNITS_FIRMWARE,
    Calibration,
    Op,
    frame_id,
    matrix_row,
)
from stepload_drivers.canbus import CanLink
from stepload_drivers.streamed import Deadline

REPLY_S = 0.5
"""Time in s for an answer; it is asked before and after a run. A sensor takes some ms, a busy host
more."""
_log = logging.getLogger(__name__)
MATRIX_OPS = (Op.MATRIX, Op.MATRIX_2, Op.MATRIX_3)


class Dialogue:
    """Sends one request at a time; it is repeated once when it goes unanswered."""

    def __init__(self, bus: CanLink, base: int, deadline: Deadline) -> None:
        self._bus = bus
        self._base = base
        self._deadline = deadline
        self.name = f"NETCANOEM at {bus.where}, base {base:#04x}"

    def ask(
        self, op: Op, data: bytes = b"", expect: tuple[Op, ...] = (), sizes: tuple[int, ...] = ()
    ) -> dict[Op, bytes]:
        """Data of the answering frames by operation; `expect` defaults to `op` alone."""
        expect = expect or (op,)
        for _ in range(2):
            heard: dict[Op, bytes] = {}
            wait = Deadline(min(REPLY_S, self._deadline.left_s(f"{self.name}: {op.name}")))
            self._bus.send(frame_id(self._base, op), data)
            while wait.running:
                for frame in self._bus.receive(0.05):
                    if frame.id >> 4 == self._base and frame.id & 0xF in expect:
                        heard[Op(frame.id & 0xF)] = frame.data
                if len(heard) == len(expect):
                    break
            answer = {op.name: data.hex() for op, data in heard.items()}
            _log.debug("%s <- %s %s -> %s", self.name, op.name, data.hex(), answer)
            complete = [len(heard.get(o, b"")) for o in expect]
            if len(heard) == len(expect) and (not sizes or complete == list(sizes)):
                return heard
        raise DeviceError(
            f"{self.name} does not answer {op.name} within {REPLY_S:g} s",
            code=FaultCode.NOT_CONNECTED,
            hint="check power, bit rate (DIP switch 2-1: 250 kbit/s), base id and termination",
        )

    def firmware(self) -> tuple[int, int, int]:
        """Major, minor and build number."""
        major, minor, build = struct.unpack(">BBH", self.ask(Op.FIRMWARE, sizes=(4,))[Op.FIRMWARE])
        return major, minor, build

    def serial_number(self) -> str:
        return self.ask(Op.SERIAL)[Op.SERIAL].decode("ascii", "replace").strip("\0 ")

    def select_calibration(self, index: int) -> None:
        """Use calibration slot `index` (the device forgets it at reset).

        Raises:
            DeviceError: the device echoes another slot.
        """
        echo = self.ask(Op.CALIBRATION, bytes((index,)), sizes=(1,))[Op.CALIBRATION][0]
        if echo != index:
            raise DeviceError(
                f"{self.name} took calibration {echo} instead of {index}",
                code=FaultCode.REFUSED_COMMAND,
                hint="correct `calibration` in the rig file",
            )

    def calibration(self, firmware: tuple[int, int, int], old_units: str) -> Calibration:
        """Matrix, counts and units, read from the device; firmware before 3.7 has no units.

        Raises:
            DeviceError: a matrix that is not finite, or a unit or count that is not in the manual.
        """
        rows = [
            matrix_row(self.ask(Op.MATRIX, bytes((axis,)), MATRIX_OPS, (8, 8, 8)))
            for axis in range(AXES)
        ]
        if not all(math.isfinite(value) for row in rows for value in row):
            raise DeviceError(
                f"{self.name}: the calibration matrix has values that are not finite",
                code=FaultCode.NOT_FINITE,
                hint="check the calibration slot",
            )
        counts = (OLD_COUNTS, OLD_COUNTS)
        if firmware[:2] >= UNITS_FIRMWARE:
            counts = struct.unpack(">II", self.ask(Op.COUNTS, sizes=(8,))[Op.COUNTS])
            codes = tuple(self.ask(Op.UNITS, sizes=(2,))[Op.UNITS])
        else:
            codes = self._old_codes(old_units)
        if codes[0] not in FORCE_UNITS_N or codes[1] not in TORQUE_UNITS_NM or 0 in counts:
            raise DeviceError(
                f"{self.name}: unit codes {codes} and counts per unit {counts} make no sense",
                code=FaultCode.OUT_OF_RANGE,
                hint="check the calibration slot",
            )
        return Calibration.from_device(
            rows, *counts, FORCE_UNITS_N[codes[0]][1], TORQUE_UNITS_NM[codes[1]][1]
        )

    def _old_codes(self, units: str) -> tuple[int, int]:
        for force_code, (force, _) in FORCE_UNITS_N.items():
            for torque_code, (torque, _) in TORQUE_UNITS_NM.items():
                if units == f"{force} {torque}":
                    return force_code, torque_code
        raise DeviceError(
            f"{self.name}: firmware before 3.7 does not tell its units",
            code=FaultCode.UNSUPPORTED,
            hint='write them into the rig file from the calibration sheet, e.g. units: "N N-m"',
        )
