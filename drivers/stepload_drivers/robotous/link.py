"""How RFT payloads travel: over a UART, or as two frames over CAN."""

from __future__ import annotations

from typing import NamedTuple

from stepload_drivers.canbus import CanLink
from stepload_drivers.robotous.codec import CanPairer, UartDecoder, uart_frame
from stepload_drivers.serialport import SerialPort

PAIR_LIMIT_S = 1e-3


class Errors(NamedTuple):
    """Counters of a link since it was opened."""

    damaged: int
    skipped: int
    orphans: int


class UartLink:
    """8N1, 19-byte frames."""

    def __init__(self, port: SerialPort) -> None:
        self._port = port
        self._decoder = UartDecoder()

    def send(self, command: bytes) -> None:
        self._port.write(uart_frame(command))

    def receive(self) -> list[bytes]:
        return self._decoder.feed(self._port.read())

    def discard_input(self) -> None:
        self._port.discard_input()
        self._decoder = UartDecoder()

    def errors(self) -> Errors:
        return Errors(self._decoder.damaged, self._decoder.skipped, 0)

    def close(self) -> None:
        self._port.close()


class CanPairLink:
    """Commands to `receiver_id`; payloads as frames with `first_id` and `second_id`."""

    def __init__(self, bus: CanLink, receiver_id: int, first_id: int, second_id: int) -> None:
        self._bus = bus
        self._receiver_id = receiver_id
        self._ids = (first_id, second_id)
        self._pairer = CanPairer(first_id, second_id, PAIR_LIMIT_S)

    def send(self, command: bytes) -> None:
        self._bus.send(self._receiver_id, command)

    def receive(self) -> list[bytes]:
        payloads = (self._pairer.feed(frame) for frame in self._bus.receive())
        return [payload for payload in payloads if payload is not None]

    def discard_input(self) -> None:
        self._bus.discard_input()
        self._pairer = CanPairer(*self._ids, PAIR_LIMIT_S)

    def errors(self) -> Errors:
        return Errors(self._bus.damaged, 0, self._pairer.orphans)

    def close(self) -> None:
        self._bus.close()


Link = UartLink | CanPairLink
"""Commands out, 16-byte payloads in; `receive` waits at most 0.1 s for the first bytes."""
