"""Starts and ends the process that shows a run to viewers."""

from __future__ import annotations

import contextlib
import ipaddress
import select
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO

from stepload.errors import BadInputError

START_TIMEOUT_S = 20.0
END_TIMEOUT_S = 5.0


def is_loopback(host: str) -> bool:
    """Whether an address is reached from this computer only."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_certificate(flag: str, host: str, certificate: Path | None, key: Path | None) -> None:
    """Refuse an address on the network without TLS.

    Args:
        flag: the option that names the address, for the error.

    Raises:
        BadInputError: certificate or key lacks, or is no file.
    """
    if (certificate is None) != (key is None):
        raise BadInputError("--certificate and --key go together", hint="name both files (PEM)")
    if certificate is None and not is_loopback(host):
        raise BadInputError(
            f"{flag} {host}: others on the network reach it, and it has no TLS",
            hint="name --certificate FILE and --key FILE (PEM), or use 127.0.0.1",
        )
    for path in (certificate, key):
        if path is not None and not path.is_file():
            raise BadInputError(f"{path}: no such file", hint="a PEM file")


@dataclass(frozen=True, slots=True)
class Address:
    """Address at which viewers connect; with a certificate and its key (PEM) only by TLS."""

    host: str
    port: int
    certificate: Path | None = None
    key: Path | None = None

    @property
    def url(self) -> str:
        """The address as a URL for viewers."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'wss' if self.certificate else 'ws'}://{host}:{self.port}"

    @property
    def loopback(self) -> bool:
        """Whether it can be reached from this machine only."""
        return is_loopback(self.host)


def address_of(text: str, certificate: Path | None = None, key: Path | None = None) -> Address:
    """An address such as "127.0.0.1:8765".

    Raises:
        BadInputError: it is none, or others on the network reach it and there is no certificate.
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
    check_certificate("--live-address", host, certificate, key)
    return Address(host, number, certificate, key)


class LiveView:
    """A server to which viewers connect at `address`; `follow` selects the record."""

    def __init__(self, address: Address, process: subprocess.Popen[str]) -> None:
        self.address = address
        self._process = process

    def follow(self, record: Path) -> None:
        """Show the run recorded there; a server that has failed shows nothing."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(f"{record.absolute()}\n")
            self._process.stdin.flush()


@contextlib.contextmanager
def live_view(address: Address) -> Iterator[LiveView]:
    """A server for viewers, in a process of its own, until the end of the block.

    Raises:
        BadInputError: it did not start: the port is taken, or foxglove-sdk is not installed.
    """
    process = subprocess.Popen(
        [
            sys.executable,
            "-P",
            "-m",
            "stepload.live.server",
            address.host,
            str(address.port),
            *(str(each.absolute()) for each in (address.certificate, address.key) if each),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        yield LiveView(_bound(address, process.stdout), process)
    finally:  # it holds nothing to be saved
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def _bound(address: Address, answer: IO[str]) -> Address:
    """The address that the server has bound, with the actual port if any was allowed."""
    ready, _, _ = select.select([answer], [], [], START_TIMEOUT_S)
    word, _, told = (answer.readline() if ready else "").strip().partition(" ")
    if word != "ready":
        raise BadInputError(
            f"the live view did not start at {address.url}: {told or 'no answer'}",
            hint="another port: --live-address 127.0.0.1:8766; or run without --live",
        )
    return replace(address, port=int(told))
