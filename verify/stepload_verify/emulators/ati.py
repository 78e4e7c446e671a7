"""An emulated ATI NETCANOEM: it answers requests and sends nothing else."""

from __future__ import annotations

import random
import struct
from collections.abc import Sequence

from stepload_drivers.ati.codec import (
    DEFAULT_BASE,
    FORCE_UNITS_N,
    GAUGE_HIGH,
    GAUGE_LOW,
    OLD_COUNTS,
    TORQUE_UNITS_NM,
    Op,
    frame_id,
)
from stepload_verify.emulators.canwire import CanProtocol, Frame
from stepload_verify.emulators.emulator import Measured
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import WrenchSource

MATRIX = (
    (0.0, 0.0, 2000.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0, 2000.0, 0.0),
    (1000.0,) * 6,
    (0.0, 100.0, 0.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 100.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0, 0.0, 100.0),
)
WATCHDOG_RESET, BAD_CALIBRATION, ANY_ERROR = 1 << 0, 1 << 6, 1 << 15
SLOTS = 2
RATED_SHARE = 0.6


def gauge_frames(status: int, counts: Sequence[int]) -> tuple[bytes, bytes]:
    """The two frames (8 and 6 bytes) of an answer with these gauge counts sg0..sg5."""
    sg0, sg1, sg2, sg3, sg4, sg5 = counts
    return struct.pack(">Hhhh", status, sg0, sg2, sg4), struct.pack(">hhh", sg1, sg3, sg5)


class AtiDevice:
    """Gauges that the matrix above turns into the wrench of the source.

    `rated_n` sets the counts per newton so that the rated force takes 60 % of the gauges' range.
    """

    def __init__(
        self,
        source: WrenchSource,
        board: FaultBoard,
        protocol: CanProtocol,
        base: int = DEFAULT_BASE,
        serial_number: str = "EMULATED",
        rated_n: float = 200.0,
        units: tuple[int, int] = (2, 3),
        firmware: tuple[int, int, int] = (3, 9, 1),
    ) -> None:
        self._board = board
        self._protocol = protocol
        self._base = base
        self._serial_number = serial_number
        self._firmware = firmware
        self._units = units
        self._measured = Measured(source, board, rated_n)
        self._counts = round(MATRIX[2][0] * RATED_SHARE * GAUGE_HIGH / rated_n)
        if firmware < (3, 7):
            self._counts = OLD_COUNTS
        self._slot = 0
        self._restarted = False
        self._random = random.Random(3)

    @property
    def period_s(self) -> float | None:
        return None

    def sample(self, time_s: float) -> list[bytes]:
        return []

    def restart(self, now_s: float) -> list[list[bytes]]:
        """Calibration slot 0, and the status says that the watchdog did it."""
        self._slot = 0
        self._restarted = True
        return []

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        frames, replies = self._protocol.feed(data)
        answers = [[reply] for reply in replies]
        for frame in frames:
            if frame.id >> 4 == self._base:
                units = self._answer(Op(frame.id & 0xF), frame.data, now_s)
                answers.append(self._protocol.encode(units))
        return [answer for answer in answers if answer]

    def _answer(self, op: Op, data: bytes, now_s: float) -> list[Frame]:
        if self._board.on("deaf") and op != Op.GAUGES:
            return []
        if op == Op.GAUGES:
            return self._gauges(now_s)
        if op == Op.MATRIX and len(data) == 1 and data[0] < len(MATRIX):
            row = MATRIX[data[0]]
            pairs = ((Op.MATRIX, row[:2]), (Op.MATRIX_2, row[2:4]), (Op.MATRIX_3, row[4:]))
            return [self._frame(o, struct.pack(">ff", *pair)) for o, pair in pairs]
        if op == Op.SERIAL:
            return [self._frame(op, self._serial_number.encode().ljust(8)[:8])]
        if op == Op.CALIBRATION and len(data) == 1:
            self._slot = data[0]
            return [self._frame(op, b"\xff" if self._board.on("refuse") else data)]
        if op == Op.COUNTS and self._firmware >= (3, 7):
            counts = self._counts * (10 if self._board.on("wrong_model") else 1)
            return [self._frame(op, struct.pack(">II", counts, counts))]
        if op == Op.UNITS and self._firmware >= (3, 7):
            return [self._frame(op, bytes(self._units))]
        if op == Op.FIRMWARE:
            return [self._frame(op, struct.pack(">BBH", *self._firmware))]
        return []

    def _frame(self, op: Op, data: bytes) -> Frame:
        return Frame(frame_id(self._base, op), data)

    def _gauges(self, now_s: float) -> list[Frame]:
        probability = self._board.magnitude("drop")
        if probability is not None and self._random.random() < probability:
            return []
        first, second = gauge_frames(self._status(), self._gauge_counts(now_s))
        return [self._frame(Op.GAUGES, first), self._frame(Op.GAUGES_2, second)]

    def _status(self) -> int:
        status = BAD_CALIBRATION if self._slot >= SLOTS else 0
        if self._restarted:
            status |= WATCHDOG_RESET
        bit = self._board.magnitude("status")
        if bit is not None:
            status |= 1 << int(bit)
        return status | (ANY_ERROR if status else 0)

    def _gauge_counts(self, now_s: float) -> list[int]:
        wrench = self._measured.wrench(now_s)
        force = self._counts / FORCE_UNITS_N[self._units[0]][1]
        torque = self._counts / TORQUE_UNITS_NM[self._units[1]][1]
        fx, fy, fz = (value * force for value in wrench[:3])
        tx, ty, tz = (value * torque for value in wrench[3:])
        sg = [0.0, tx / 100.0, fx / 2000.0, ty / 100.0, fy / 2000.0, tz / 100.0]
        sg[0] = fz / 1000.0 - sum(sg)
        return [round(min(GAUGE_HIGH, max(GAUGE_LOW, value))) for value in sg]
