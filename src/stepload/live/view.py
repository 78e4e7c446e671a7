"""Starts and ends the processes that display a run: for viewers, and in the terminal."""

from __future__ import annotations

import contextlib
import ipaddress
import select
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from stepload.errors import BadInputError

START_TIMEOUT_S = 20.0
END_TIMEOUT_S = 5.0


@dataclass(frozen=True, slots=True)
class Address:
    """Address at which viewers connect."""

    host: str
    port: int

    @property
    def url(self) -> str:
        """The address as a URL for viewers."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"ws://{host}:{self.port}"

    @property
    def loopback(self) -> bool:
        """Whether it can be reached from this machine only."""
        return ipaddress.ip_address(self.host).is_loopback


def address_of(text: str) -> Address:
    """An address such as "127.0.0.1:8765".

    Raises:
        BadInputError: it is none.
    """
    host, colon, port = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    host = "127.0.0.1" if host == "localhost" else host
    try:
        ipaddress.ip_address(host)
        number = int(port)
        if not colon or not 0 <= number <= 65535:
            raise ValueError
    except ValueError:
        raise BadInputError(
            f"--live-address {text!r}", hint="the numbers of an address and a port: 127.0.0.1:8765"
        ) from None
    return Address(host, number)


class LiveView:
    """A server to which viewers connect at `address`; `follow` selects the record."""

    def __init__(self, address: Address, process: subprocess.Popen[str]) -> None:
        self.address = address
        self._process = process

    def follow(self, record: Path) -> None:
        """Show the run recorded there; a server that has failed shows nothing."""
        _tell(self._process, str(record.absolute()))


class DrawnScreen:
    """The terminal's screen; lines for it go to `say`, and to `line` while it is not drawn.

    Args:
        process: that draws it.
        line: prints a line itself.
    """

    def __init__(self, process: subprocess.Popen[str], line: Callable[[str], None]) -> None:
        self._process = process
        self._line = line
        self._drawing = False

    def follow(self, record: Path) -> None:
        """Draw the run that is recorded there."""
        self._drawing = _tell(self._process, str(record.absolute()))

    def say(self, text: str) -> None:
        """Show a line above the drawing."""
        if not (self._drawing and self._process.poll() is None and _tell(self._process, text)):
            self._line(text)


def _tell(process: subprocess.Popen[str], line: str) -> bool:
    """Send one line to a process; False if it takes none any more."""
    assert process.stdin is not None
    try:
        process.stdin.write(line + "\n")
        process.stdin.flush()
    except (OSError, ValueError):
        return False
    return True


@contextlib.contextmanager
def screen(line: Callable[[str], None]) -> Iterator[DrawnScreen]:
    """A drawing of the run on standard error, until the end of the block."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "stepload.live.screen"], stdin=subprocess.PIPE, text=True
    )
    try:
        yield DrawnScreen(process, line)
    finally:
        _end(process)


@contextlib.contextmanager
def live_view(address: Address) -> Iterator[LiveView]:
    """A server for viewers, in a process of its own, until the end of the block.

    Raises:
        BadInputError: it did not start: the port is taken, or foxglove-sdk is not installed.
    """
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "stepload.live.server", address.host, str(address.port)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    try:
        yield LiveView(_bound(address, process.stdout), process)
    finally:
        _end(process)


def _bound(address: Address, answer: IO[str]) -> Address:
    """The address that the server has bound, with the actual port if any was allowed."""
    ready, _, _ = select.select([answer], [], [], START_TIMEOUT_S)
    word, _, told = (answer.readline() if ready else "").strip().partition(" ")
    if word != "ready":
        raise BadInputError(
            f"the live view did not start at {address.url}: {told or 'no answer'}",
            hint="another port: --live-address 127.0.0.1:8766; or run without --live",
        )
    return Address(address.host, int(told))


def _end(process: subprocess.Popen[str]) -> None:
    """Let the process end by itself, or kill it after a time; it holds nothing to be saved."""
    assert process.stdin is not None
    with contextlib.suppress(OSError):
        process.stdin.close()
    try:
        process.wait(END_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.stdout is not None:
        process.stdout.close()
