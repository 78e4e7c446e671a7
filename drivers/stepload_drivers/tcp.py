"""A TCP connection as drivers need it: no delay, a read that never waits long, specific errors."""

from __future__ import annotations

import contextlib
import logging
import select
import socket

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode

WRITE_S = 0.5
_log = logging.getLogger(__name__)


class TcpLink:
    """A connection to `host` and `port`; its errors are `DeviceError`.

    Raises:
        DeviceError: nobody answers there within `timeout_s`.
    """

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self.where = f"{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.settimeout(WRITE_S)
        except OSError as error:
            raise self._lost(str(error)) from error
        _log.debug("TCP %s open", self.where)

    def read(self, timeout_s: float = 0.05) -> bytes:
        """What has arrived; waits up to `timeout_s` for the first byte.

        Raises:
            DeviceError: the device has closed the connection.
        """
        try:
            if not select.select([self._socket], [], [], timeout_s)[0]:
                return b""
            data = self._socket.recv(65536)
        except (OSError, ValueError) as error:
            raise self._lost(str(error)) from error
        if not data:
            raise self._lost("the device has closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            DeviceError: the connection is gone, or the device takes nothing.
        """
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._lost(str(error)) from error

    def _lost(self, reason: str) -> DeviceError:
        return DeviceError(
            f"TCP {self.where}: {reason}",
            code=FaultCode.NOT_CONNECTED,
            hint="check power, cable and address, and that nothing else has the connection",
        )

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._socket.close()
