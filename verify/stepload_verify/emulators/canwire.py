"""CAN frames over a wire: an slcan adapter on a pty, a socketcand server on TCP."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from stepload_verify.emulators.wire import PtyWire, TcpWire


class Frame(NamedTuple):
    """A standard data frame."""

    id: int
    data: bytes


class CanProtocol(Protocol):
    """Frames in and out of the bytes of a wire."""

    def feed(self, data: bytes) -> tuple[list[Frame], list[bytes]]:
        """Frames that the host sends, and replies of the adapter itself, each to be written
        on its own."""
        ...

    def encode(self, frames: Sequence[Frame]) -> list[bytes]:
        """Bytes of frames that were on the bus together; none while the link is closed."""
        ...


class Slcan:
    """Lawicel's ASCII protocol. Frames flow only between `O` and `C`."""

    def __init__(self) -> None:
        self._buffer = b""
        self.open = False

    def feed(self, data: bytes) -> tuple[list[Frame], list[bytes]]:
        *lines, self._buffer = (self._buffer + data).split(b"\r")
        frames, replies = [], []
        for line in lines:
            frame, ok = self._line(line.decode("ascii", "replace"))
            replies.append(b"\r" if ok else b"\a")
            if frame is not None:
                frames.append(frame)
                replies[-1] = b"z\r"
        return frames, replies

    def _line(self, line: str) -> tuple[Frame | None, bool]:
        if line == "":
            return None, True
        if line[0] == "S":
            return None, not self.open
        if line == "O":
            was_open, self.open = self.open, True
            return None, not was_open
        if line == "C":
            was_open, self.open = self.open, False
            return None, was_open
        if line[0] == "t" and self.open:
            try:
                data = bytes.fromhex(line[5:])
                if len(data) == int(line[4]):
                    return Frame(int(line[1:4], 16), data), True
            except (ValueError, IndexError):
                pass
        return None, False

    def encode(self, frames: Sequence[Frame]) -> list[bytes]:
        if not self.open:
            return []
        return [
            b"t%03X%d%b\r" % (frame.id, len(frame.data), frame.data.hex().upper().encode())
            for frame in frames
        ]


class Socketcand:
    """The server side of socketcand in raw mode; answers one at a time, as python-can expects."""

    GREETING = b"< hi >"

    def __init__(self) -> None:
        self._buffer = b""
        self._raw = False

    def feed(self, data: bytes) -> tuple[list[Frame], list[bytes]]:
        *parts, self._buffer = (self._buffer + data).split(b">")
        frames, replies = [], []
        for part in parts:
            words = part.decode("ascii", "replace").replace("<", " ").split()
            if words[:1] == ["open"]:
                self._raw = False
                replies.append(b"< ok >")
            elif words == ["rawmode"]:
                self._raw = True
                replies.append(b"< ok >")
            elif words[:1] == ["send"]:
                try:
                    frame = Frame(int(words[1], 16), bytes(int(w, 16) for w in words[3:]))
                except (ValueError, IndexError):
                    replies.append(b"< error could not parse send >")
                    continue
                if len(frame.data) == int(words[2], 16):
                    frames.append(frame)
        return frames, replies

    def encode(self, frames: Sequence[Frame]) -> list[bytes]:
        if not self._raw:
            return []
        stamp = f"{time.time():.6f}".encode()
        return [
            b"< frame %03X %b %b >" % (frame.id, stamp, frame.data.hex().upper().encode())
            for frame in frames
        ]


def can_wire(transport: str, port: int = 0) -> tuple[PtyWire | TcpWire, CanProtocol]:
    """Wire and protocol for "slcan" or "socketcand"."""
    if transport == "slcan":
        return PtyWire(), Slcan()
    wire = TcpWire(Socketcand.GREETING, port)
    wire.address += "/can0"
    return wire, Socketcand()
