"""Starts and ends the child process that holds ur_rtde, and talks to it without blocking."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import subprocess
import sys
import time

from stepload.rig.faults import FaultCode
from stepload_drivers.ur import wire
from stepload_drivers.ur.settings import Settings

QUIT_S = 1.0
LINK_LOST = (
    "Robot is disconnected", "End of file", "Connection reset", "Broken pipe",
    "Too many open files",
)  # fmt: skip
"""What ur_rtde prints when its connection is gone. It may end its process in trying to reconnect,
for which it is left no means, before the child's loop has seen the loss."""


class ChildProcess:
    """One child. It has a session of its own, so that Ctrl+C in a terminal does not reach it."""

    def __init__(self, settings: Settings, period_s: float, connect_s: float) -> None:
        self._sock, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._log = os.memfd_create("ur_rtde")
        arguments = [str(theirs.fileno()), settings.to_json(), repr(period_s), repr(connect_s)]
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "stepload_drivers.ur.child", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        except OSError:
            self._sock.close()
            os.close(self._log)
            raise
        finally:
            theirs.close()
        self._sock.setblocking(False)
        self.ended = False

    @property
    def pid(self) -> int:
        return self._process.pid

    def send(self, message: bytes) -> bool:
        """Whether the message was handed over."""
        try:
            self._sock.send(message)
        except OSError:
            return False
        return True

    def receive(self, wait_s: float = 0.0) -> list[bytes]:
        """All messages that are there, waiting at most `wait_s` for the first.

        A child that ends with messages unread is reported once as a reset, before its last
        messages.
        """
        if wait_s > 0.0:
            select.select([self._sock], [], [], wait_s)
        messages: list[bytes] = []
        while not self.ended:
            try:
                message = self._sock.recv(wire.MAX_BYTES)
            except BlockingIOError:
                break
            except ConnectionResetError:
                continue
            except OSError:
                message = b""
            if message:
                messages.append(message)
            else:
                self.ended = True
        return messages

    def last_words(self) -> str:
        """How the child ended, with the last line that ur_rtde printed."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(0.5)
        status = self._process.returncode
        if status is None:
            text = "the ur_rtde process has closed its connection to the run"
        elif status == -signal.SIGALRM:
            text = "ur_rtde hung and was ended"
        elif status < 0:
            text = f"ur_rtde crashed ({signal.Signals(-status).name})"
        else:
            text = f"the ur_rtde process ended with status {status}"
        size = os.fstat(self._log).st_size
        printed = os.pread(self._log, 2000, max(0, size - 2000)).decode("utf-8", "replace")
        lines = [line.strip() for line in printed.splitlines() if line.strip()]
        return f"{text}; it printed last: {lines[-1]}" if lines else text

    def kill(self) -> None:
        """End the child now; it cannot refuse."""
        self._process.kill()
        self._reap()

    def quit(self) -> None:
        """Let the child stop servo and program; end it if it takes longer than `QUIT_S`."""
        self.send(wire.pack_json(wire.REQUEST, op="quit", number=0))
        until_s = time.monotonic() + QUIT_S
        while not self.ended and time.monotonic() < until_s:
            self.receive(until_s - time.monotonic())
        if not self.ended:
            self._process.kill()
        self._reap()

    def _reap(self) -> None:
        self._process.wait()
        self._sock.close()
        os.close(self._log)


def end_of(last_words: str) -> tuple[FaultCode, str, str]:
    """Code, message and hint for a child that has ended without reporting a reason."""
    if any(sign in last_words for sign in LINK_LOST):
        message = f"the controller closed the connection ({last_words})"
        hint = "check cable and controller; the arm's watchdog stops it"
        return FaultCode.NOT_CONNECTED, message, hint
    return FaultCode.DRIVER, last_words, "the arm's watchdog stops the arm; open anew"
