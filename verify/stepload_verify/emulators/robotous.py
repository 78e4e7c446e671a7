"""An emulated ROBOTOUS RFT sensor: the core answers commands, UART and CAN carry it."""

from __future__ import annotations

import struct

from stepload_drivers.robotous.codec import (
    CUTOFFS_HZ,
    OVERLOAD_AXES,
    RATE_OF_CODE,
    UART_END,
    UART_START,
    Command,
    Model,
    model_named,
    uart_frame,
)
from stepload_verify.emulators.canwire import CanProtocol, Frame
from stepload_verify.emulators.emulator import Measured
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import WrenchSource

COMMAND_FRAME_BYTES = 11
OVERLOAD_SHARE = 1.2
UNSUPPORTED, OUT_OF_RANGE = 1, 2


class RftCore:
    """Commands in (8 bytes), payloads out (16 bytes).

    Idle after power-up. While it streams only STOP and BIAS act. Rate and filter persist, bias and
    stream do not.
    """

    def __init__(
        self,
        source: WrenchSource,
        board: FaultBoard,
        model_name: str = "RFT64-SB01",
        serial_number: str = "EMULATED",
        max_rate_hz: float = 1000.0,
    ) -> None:
        model = model_named(model_name)
        if model is None:
            raise ValueError(f"no RFT model {model_name!r}")
        self._model: Model = model
        self._serial_number = serial_number
        self._board = board
        self._max_rate_hz = max_rate_hz
        self._measured = Measured(source, board, model.rated_z_n)
        self._rate_code = 0
        self._filter = (0, 0)
        self._bias = [0] * 6
        self._streaming = False
        self._now_s = 0.0

    @property
    def period_s(self) -> float | None:
        return 1.0 / RATE_OF_CODE[self._rate_code] if self._streaming else None

    def command(self, field: bytes, now_s: float) -> list[bytes]:
        """Responses to one command field."""
        self._now_s = now_s
        name, first, second = field[0], field[1], field[2]
        if self._board.on("deaf"):
            return []
        if name == Command.STOP:
            self._streaming = False
        elif name == Command.BIAS:
            self._bias = self._raw(now_s) if first else [0] * 6
        elif not self._streaming:
            return self._idle_command(name, first, second)
        return []

    def restart(self) -> None:
        """Idle and without bias, as after power-up; rate and filter persist."""
        self._streaming = False
        self._bias = [0] * 6

    def _idle_command(self, name: int, first: int, second: int) -> list[bytes]:
        if name == Command.START:
            self._streaming = True
            return []
        if name == Command.READ_ONCE:
            return [self.payload(self._now_s, Command.READ_ONCE)]
        texts = {
            Command.MODEL: "RFT76-HA01" if self._board.on("wrong_model") else self._model.name,
            Command.SERIAL: self._serial_number,
            Command.FIRMWARE: "VER 1.00",
        }
        if name in texts:
            return [bytes((name,)) + texts[Command(name)].encode().ljust(15, b"\0")]
        values: tuple[int, ...] = (0, UNSUPPORTED)
        if self._board.on("refuse"):
            values = (0, 3)
        elif name == Command.SET_FILTER:
            valid = first == 0 or (first == 1 and 1 <= second <= len(CUTOFFS_HZ))
            self._filter = (first, second) if valid else self._filter
            values = (1, 0) if valid else (0, OUT_OF_RANGE)
        elif name == Command.GET_FILTER:
            values = self._filter
        elif name == Command.SET_RATE:
            valid = first in RATE_OF_CODE and RATE_OF_CODE[first] <= self._max_rate_hz
            self._rate_code = first if valid else self._rate_code
            values = (1, 0) if valid else (0, OUT_OF_RANGE)
        elif name == Command.GET_RATE:
            values = (self._rate_code,)
        return [bytes((name, *values)).ljust(16, b"\0")]

    def _raw(self, time_s: float) -> list[int]:
        wrench = self._measured.wrench(time_s)
        model = self._model
        dividers = [model.force_divider] * 3 + [model.torque_divider] * 3
        return [round(value * divider) for value, divider in zip(wrench, dividers, strict=True)]

    def payload(self, time_s: float, name: int = Command.START) -> bytes:
        """One sample; biased, limited to 16 bits, with overload bits."""
        raw = self._raw(time_s)
        model = self._model
        limits = [model.rated_xy_n * model.force_divider] * 2
        limits += [model.rated_z_n * model.force_divider]
        limits += [model.rated_nm * model.torque_divider] * 3
        bits = 0
        for axis, (bit, _) in enumerate(OVERLOAD_AXES):
            if abs(raw[axis]) > OVERLOAD_SHARE * limits[axis]:
                bits |= bit
        if not (self._board.on("zero") or self._board.on("freeze")):
            raw = [value - bias for value, bias in zip(raw, self._bias, strict=True)]
        raw = [min(32767, max(-32768, value)) for value in raw]
        return bytes((name,)) + struct.pack(">6hB2x", *raw, bits)


class RftUart:
    """The core behind a UART: 11-byte commands, 19-byte responses."""

    def __init__(self, core: RftCore) -> None:
        self._core = core
        self._buffer = b""

    @property
    def period_s(self) -> float | None:
        return self._core.period_s

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        self._buffer += data
        answers = []
        while len(self._buffer) >= COMMAND_FRAME_BYTES:
            frame = self._buffer[:COMMAND_FRAME_BYTES]
            good = frame[0] == UART_START and frame[10] == UART_END
            if good and sum(frame[1:9]) & 0xFF == frame[9]:
                answers += [[uart_frame(p)] for p in self._core.command(frame[1:9], now_s)]
                self._buffer = self._buffer[COMMAND_FRAME_BYTES:]
            else:
                self._buffer = self._buffer[1:]
        return answers

    def sample(self, time_s: float) -> list[bytes]:
        return [uart_frame(self._core.payload(time_s))]

    def restart(self, now_s: float) -> list[list[bytes]]:
        self._core.restart()
        return []


class RftCan:
    """The core behind CAN: commands to `receiver_id`, payloads as two frames."""

    def __init__(
        self,
        core: RftCore,
        protocol: CanProtocol,
        receiver_id: int = 0x64,
        first_id: int = 1,
        second_id: int = 2,
    ) -> None:
        self._core = core
        self._protocol = protocol
        self._receiver_id = receiver_id
        self._ids = (first_id, second_id)

    @property
    def period_s(self) -> float | None:
        return self._core.period_s

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]:
        frames, replies = self._protocol.feed(data)
        answers = [[reply] for reply in replies]
        for frame in frames:
            if frame.id == self._receiver_id and len(frame.data) == 8:
                answers += [self._units(p) for p in self._core.command(frame.data, now_s)]
        return answers

    def sample(self, time_s: float) -> list[bytes]:
        return self._units(self._core.payload(time_s))

    def restart(self, now_s: float) -> list[list[bytes]]:
        self._core.restart()
        return []

    def _units(self, payload: bytes) -> list[bytes]:
        first_id, second_id = self._ids
        return self._protocol.encode([Frame(first_id, payload[:8]), Frame(second_id, payload[8:])])
