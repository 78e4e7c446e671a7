"""RTDE frames (TCP 30004): `uint16 size, header included | uint8 type | payload`, big endian.

Source: Universal Robots, Real-Time Data Exchange (RTDE) Guide.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

HEADER = struct.Struct(">HB")

REQUEST_PROTOCOL_VERSION = ord("V")
GET_VERSION = ord("v")
SETUP_OUTPUTS = ord("O")
SETUP_INPUTS = ord("I")
START = ord("S")
PAUSE = ord("P")
DATA = ord("U")

KNOWN_TYPES = frozenset(b"VvOISPUM")

FORMATS = {
    "DOUBLE": "d",
    "VECTOR6D": "6d",
    "VECTOR3D": "3d",
    "INT32": "i",
    "UINT32": "I",
    "UINT64": "Q",
    "VECTOR6INT32": "6i",
    "UINT8": "B",
}
"""RTDE type name to `struct` format; a package is these without padding."""


class Frame(NamedTuple):
    """One RTDE package without its header."""

    kind: int
    payload: bytes


class FrameError(ValueError):
    """The byte stream is not RTDE, or its framing is lost; the connection is unusable."""


def encode(kind: int, payload: bytes = b"") -> bytes:
    """Bytes of one package.

    Raises:
        FrameError: longer than the 65535 bytes the size field can say.
    """
    size = HEADER.size + len(payload)
    if size > 0xFFFF:
        raise FrameError(f"RTDE package of {size} bytes, the limit is 65535")
    return HEADER.pack(size, kind) + payload


class FrameReader:
    """Cuts a TCP byte stream into packages, however it was split on the way."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Frame]:
        """Packages completed by `data`, oldest first.

        Raises:
            FrameError: a size below the header's own, or an unknown type: framing is lost.
        """
        self._buffer += data
        frames = []
        while len(self._buffer) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._buffer)
            if size < HEADER.size or kind not in KNOWN_TYPES:
                raise FrameError(f"not an RTDE package: size {size} bytes, type {kind}")
            if len(self._buffer) < size:
                break
            frames.append(Frame(kind, bytes(self._buffer[HEADER.size : size])))
            del self._buffer[:size]
        return frames


def split_names(text: bytes) -> list[str]:
    """Comma-separated variable names; the empty one after a closing comma is dropped."""
    return [name for name in text.decode("ascii").split(",") if name]


def package_struct(types: list[str]) -> struct.Struct:
    """The struct of a data package of these variable types, recipe id first.

    Raises:
        FrameError: a type the guide does not know (the controller says NOT_FOUND or IN_USE here).
    """
    if unknown := [name for name in types if name not in FORMATS]:
        raise FrameError(f"no RTDE type: {', '.join(unknown)}")
    return struct.Struct(">B" + "".join(FORMATS[name] for name in types))
