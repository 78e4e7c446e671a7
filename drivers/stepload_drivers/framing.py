"""Frames of a fixed size in a byte stream, and pairs of CAN frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

Frame = TypeVar("Frame")


class FrameDecoder(Generic[Frame]):
    """Cuts a byte stream into frames.

    The start byte may occur inside a frame too, so it alone means nothing: `decode` gives the frame
    in exactly `size` bytes, or None where checksum or end do not fit.

    Attributes:
        damaged: places where synchronisation was lost (not before the first good frame).
        skipped: bytes given up there.
    """

    def __init__(self, start: int, size: int, decode: Callable[[bytes], Frame | None]) -> None:
        self._start = start
        self._size = size
        self._decode = decode
        self._buffer = bytearray()
        self._synchronised = False
        self._started = False
        self.damaged = 0
        self.skipped = 0

    def feed(self, data: bytes) -> list[Frame]:
        """All frames complete with `data`, oldest first."""
        buffer, size = self._buffer, self._size
        buffer += data
        found = []
        at, end = 0, len(buffer)
        while True:
            start = buffer.find(self._start, at)
            if start != at:
                start = end if start < 0 else start
                self._skip(start - at)
                at = start
            if end - at < size:
                break
            frame = self._decode(bytes(buffer[at : at + size]))
            if frame is None:
                self._skip(1)
                at += 1
            else:
                found.append(frame)
                self._synchronised = self._started = True
                at += size
        del buffer[:at]
        return found

    def _skip(self, count: int) -> None:
        if self._synchronised and count:
            self.damaged += 1
            self._synchronised = False
        if self._started:
            self.skipped += count


class CanFrame(NamedTuple):
    """One received data frame.

    `time_s` is for differences only: the interface's stamp, or the latest time at which the frame
    can have come where the interface has none (slcan); it may then have come `early_s` before.
    """

    id: int
    data: bytes
    time_s: float
    early_s: float = 0.0


class CanPairer:
    """Puts a message of two CAN frames together again.

    The frames carry no counter: one without its other half, or too far from it, is an orphan.

    Args:
        ids, sizes: of the first and the second frame; sizes in bytes.
        limit_s: largest time between the two.
    """

    def __init__(
        self, ids: tuple[int, int], limit_s: float, sizes: tuple[int, int] = (8, 8)
    ) -> None:
        self._ids, self._sizes, self._limit_s = ids, sizes, limit_s
        self._first: CanFrame | None = None
        self.orphans = 0

    def forget(self) -> None:
        """Wait for a first frame."""
        self._first = None

    def feed(self, frame: CanFrame) -> bytes | None:
        """The message that this frame completes, if any."""
        if frame.id not in self._ids:
            return None
        part = self._ids.index(frame.id)
        if len(frame.data) != self._sizes[part]:
            self.orphans += 1
            self._first = None
            return None
        if part == 0:
            self.orphans += self._first is not None
            self._first = frame
            return None
        first, self._first = self._first, None
        if first is None or not self._together(first, frame):
            self.orphans += 2 if first else 1
            return None
        return first.data + frame.data

    def _together(self, first: CanFrame, second: CanFrame) -> bool:
        """Whether the second may have followed in time.

        A gap that a stall of the host or the adapter's batches may have caused does not count.
        """
        return 0.0 <= second.time_s - first.time_s <= self._limit_s + second.early_s
