"""A serial port opened as sensors need it: exclusive, with low latency, and specific errors."""

from __future__ import annotations

import contextlib
import logging
import select
from pathlib import Path
from typing import Annotated

import serial

from stepload.declaration.quantities import PathText
from stepload.declaration.sections import key
from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.usb import MAX_LATENCY_MS, USB_SERIAL, latency_timer_ms

WAIT_S = 0.05
Port = Annotated[PathText, key("serial port, e.g. /dev/serial/by-id/…")]

_log = logging.getLogger(__name__)


def late_adapter(path: str, latency_ms: int | None) -> DeviceError:
    """The refusal of a USB adapter whose latency timer is too long."""
    return DeviceError(
        f"USB adapter of {path} has a latency timer of {latency_ms} ms "
        f"(limit {MAX_LATENCY_MS} ms): samples would come in bursts",
        code=FaultCode.UNSUPPORTED,
        hint=f"echo 1 | sudo tee {USB_SERIAL}/{Path(path).resolve().name}/latency_timer",
    )


class SerialPort:
    """An exclusively opened serial port; its errors are `DeviceError`.

    Args:
        refuse_latency: refuse an adapter whose latency timer is above 1 ms. Needed for a device
            without its own clock, for which only arrival times are known.

    Raises:
        DeviceError: the port is missing, taken, or its adapter too slow.
    """

    def __init__(self, path: str, baud: int, *, refuse_latency: bool) -> None:
        self.path = path
        try:
            self._port = serial.Serial(path, baud, timeout=0.0, write_timeout=0.5, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise DeviceError(
                f"serial port {path} cannot be opened: {error}",
                code=FaultCode.NOT_CONNECTED,
                hint="check the name, your rights (group dialout), and that nothing else has it",
            ) from error
        with contextlib.suppress(ValueError, OSError, NotImplementedError, AttributeError):
            self._port.set_low_latency_mode(True)
        self.latency_ms = latency_timer_ms(path)
        self.slow = self.latency_ms is not None and self.latency_ms > MAX_LATENCY_MS
        _log.debug("%s open: %d Bd, latency timer %s ms", path, baud, self.latency_ms)
        if self.slow and refuse_latency:
            self.close()
            raise late_adapter(path, self.latency_ms)

    def read(self, timeout_s: float = WAIT_S) -> bytes:
        """What has arrived; waits up to `timeout_s` for the first byte.

        Raises:
            DeviceError: unplugged, or a second program reads the same port.
        """
        try:
            if not select.select([self._port.fileno()], [], [], timeout_s)[0]:
                return b""
            return self._port.read(self._port.in_waiting or 1)
        except (serial.SerialException, OSError, TypeError) as error:
            raise self._gone(error) from error

    def write(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            DeviceError: unplugged, or the device takes nothing.
        """
        try:
            self._port.write(data)
        except (serial.SerialException, OSError, TypeError) as error:
            raise self._gone(error) from error

    def discard_input(self) -> None:
        """Discard all received bytes."""
        try:
            self._port.reset_input_buffer()
        except (serial.SerialException, OSError) as error:
            raise self._gone(error) from error

    def _gone(self, error: Exception) -> DeviceError:
        return DeviceError(
            f"serial port {self.path} is gone: {error}",
            code=FaultCode.NOT_CONNECTED,
            hint="plug it in again, see that no second program reads it, then start anew",
        )

    def close(self) -> None:
        with contextlib.suppress(serial.SerialException, OSError):
            self._port.close()
            _log.debug("%s closed", self.path)
