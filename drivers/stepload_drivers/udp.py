"""One UDP peer: its datagrams are received, those of others are dropped."""

from __future__ import annotations

import contextlib
import logging
import select
import socket

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode

BUFFER_BYTES = 4 << 20
"""Requested buffer; Linux gives at most net.core.rmem_max, and counts some 800 bytes a datagram."""
MOST_AT_ONCE = 1024
LONGEST = 2048
_log = logging.getLogger(__name__)


class UdpLink:
    """A socket connected to `host` and `port`, so that the kernel drops datagrams of others.

    Raises:
        DeviceError: no such address, or no way to it.
    """

    def __init__(self, host: str, port: int) -> None:
        self.where = f"{host}:{port}"
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
            self._sock.connect((host, port))
            self._sock.setblocking(False)
        except OSError as error:
            self._sock.close()
            raise self._lost(error) from error
        _log.debug("UDP %s open", self.where)

    def _lost(self, error: OSError) -> DeviceError:
        return DeviceError(
            f"UDP {self.where}: {error}",
            code=FaultCode.NOT_CONNECTED,
            hint="check power, cable, the address, and that this computer has one in its network",
        )

    def send(self, data: bytes) -> None:
        """Send one datagram; whether it arrives is not known.

        Raises:
            DeviceError: it could not leave, or the peer has refused an earlier one.
        """
        _log.debug("UDP %s <- %s", self.where, data.hex())
        try:
            self._sock.send(data)
        except OSError as error:
            raise self._lost(error) from error

    def receive(self, timeout_s: float) -> list[bytes]:
        """All datagrams that have arrived; waits `timeout_s` for the first one.

        Raises:
            DeviceError: the peer reports that its port is closed.
        """
        taken: list[bytes] = []
        take, add = self._sock.recv, taken.append
        try:
            if select.select([self._sock], [], [], timeout_s)[0]:
                with contextlib.suppress(BlockingIOError):
                    for _ in range(MOST_AT_ONCE):
                        add(take(LONGEST))
        except OSError as error:
            raise self._lost(error) from error
        return taken

    def close(self) -> None:
        """Close the socket; idempotent."""
        self._sock.close()
