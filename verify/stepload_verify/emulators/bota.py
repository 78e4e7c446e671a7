"""An emulated Bota serial sensor: boot text, ASCII commands, binary frames."""

from __future__ import annotations

import math
import re
import struct

from stepload_drivers.bota.codec import (
    CLOCK_MODULUS_US,
    HEADER,
    SINC_OF_RATE,
    SINC_STEP_S,
    Frame,
    FrameStatus,
    crc_x25,
)
from stepload_verify.emulators.emulator import Measured
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import WrenchSource

INPUT_BUFFER_BYTES = 64
REFUSED = 1
OVERRANGE_SHARE = 1.2
_NUMBER = r" *-?\d+(\.\d+)?"
_SETTINGS = {
    "c": re.compile(r"c,\d,\d,\d,(\d)"),
    "f": re.compile(r"f,(\d+),(\d),(\d),(\d)"),
    "b": re.compile(rf"b(,{_NUMBER}){{5}}, *-?\d+\.\d{{3}}"),
    "m": re.compile(rf"m\d(,{_NUMBER}){{5}}, *-?\d+\.\d{{6}}"),
}


def encode(frame: Frame) -> bytes:
    """The 37 bytes of `frame`."""
    body = struct.pack("<H6fIf", frame.status, *frame.wrench, frame.clock_us, frame.temperature_c)
    return bytes((HEADER,)) + body + crc_x25(body).to_bytes(2, "little")


class BotaDevice:
    """Streams after boot; settings are taken in configuration mode only."""

    def __init__(
        self,
        source: WrenchSource,
        board: FaultBoard,
        model: str = "SensONE",
        serial_number: str = "EMULATED",
        rated_n: float = 500.0,
        shortest_sinc: int = 51,
    ) -> None:
        self._board = board
        self._model = model
        self._serial_number = serial_number
        self._rated_n = rated_n
        self._shortest_sinc = shortest_sinc
        self._measured = Measured(source, board, rated_n)
        self._input = ""
        self._sinc = 51
        self._running = True
        self._epoch_us = 0.0
        self._booted_s: float | None = None
        self._stopped_us: int | None = None

    @property
    def period_s(self) -> float | None:
        sinc = max(self._sinc, self._shortest_sinc)
        return sinc * SINC_STEP_S if self._running else None

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        room = INPUT_BUFFER_BYTES - len(self._input)
        self._input += data[:room].decode("ascii", "replace")
        answers: list[list[bytes]] = []
        while self._input:
            letter = self._input[0]
            taken = 1
            if letter in _SETTINGS:
                match = _SETTINGS[letter].match(self._input)
                if match is None:
                    if len(self._input) < INPUT_BUFFER_BYTES:
                        break
                    self._input = ""
                    break
                taken = match.end()
            if not self._board.on("deaf"):
                answers += self._obey(self._input[:taken], now_s)
            self._input = self._input[taken:]
        return answers

    def _obey(self, command: str, now_s: float) -> list[list[bytes]]:
        letter = command[0]
        if letter == "#":
            return [[self._boot(now_s)]]
        code = 0
        if self._board.on("refuse"):
            code = REFUSED
        elif letter == "C":
            self._running = False
        elif letter == "R":
            self._running = True
        elif letter in "Ilw":
            pass
        elif letter in "cfbms" and not self._running:
            if letter == "f":
                code = self._filter(command)
        else:
            code = REFUSED
        return [[f"r,0,{letter},{code}\r\n".encode()]]

    def _filter(self, command: str) -> int:
        sinc, chop, _, _ = (int(word) for word in command[2:].split(","))
        if sinc not in SINC_OF_RATE.values() or chop:
            return REFUSED
        self._sinc = sinc
        return 0

    def restart(self, now_s: float) -> list[list[bytes]]:
        self._input = ""
        return [[self._boot(now_s)]]

    def _boot(self, now_s: float) -> bytes:
        wrap_s = self._board.magnitude("wrap")
        self._epoch_us = CLOCK_MODULUS_US - wrap_s * 1e6 if wrap_s is not None else 0.0
        self._booted_s = now_s
        self._running = True
        self._sinc = 51
        model = "Unknown" if self._board.on("wrong_model") else self._model
        return (
            "c,0,1,0,4,t,0,k,0,f,51,0,0,1,b,0,0,0,0,0,0\r\nApp Init\r\n"
            f"name: {model}\r\nS/N: {self._serial_number}\r\nFW version: 1.0.4\r\n"
        ).encode()

    def _clock_us(self, time_s: float) -> int:
        if self._booted_s is None:
            self._booted_s = time_s
        jump_s = self._board.magnitude("clock_jump") or 0.0
        clock_us = round((time_s - self._booted_s + jump_s) * 1e6 + self._epoch_us)
        if self._board.on("clock_stop"):
            self._stopped_us = self._stopped_us or clock_us
            return self._stopped_us % CLOCK_MODULUS_US
        self._stopped_us = None
        return clock_us % CLOCK_MODULUS_US

    def sample(self, time_s: float) -> list[bytes]:
        wrench = self._measured.wrench(time_s)
        status = 0
        if max(map(abs, wrench[:3])) > OVERRANGE_SHARE * self._rated_n:
            status |= FrameStatus.OVERRANGE
        bit = self._board.magnitude("status")
        if bit is not None:
            status |= 1 << int(bit)
        if self._board.on("nan"):
            wrench = (math.nan, *wrench[1:])
        return [encode(Frame(int(status), wrench, self._clock_us(time_s), 26.5))]
