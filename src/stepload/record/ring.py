"""Rings between the loop and the writer process: fixed rows, one producer, one consumer each.

All rings of a run live in one anonymous memory file, which the kernel frees with its last user. The
producer publishes `head` after the row, the consumer publishes `tail` after its copy; both are
aligned 8-byte stores. A full ring drops the newest row and counts it, or waits for room.
"""

from __future__ import annotations

import mmap
import os
import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepload.record.layout import STREAMS, fields_of, row_dtype

CONTROL_BYTES = 4096
TEXT_AT = 2048
"""Byte in the control page where the writer's error text starts."""
DEPTH_S = 16.0
EVENT_BYTES = 1 << 20
EVENT_HEAD = struct.Struct("<Id")
_FIRST_COUNTER = 32
_PER_RING = 16
_TAIL, _DROPPED, _RECORDED = 8, 9, 10


WaitForRoom = Callable[[Callable[[], bool]], bool]


class State(IntEnum):
    """The writer process as the loop sees it."""

    STARTING = 0
    RUNNING = 1
    FAILED = 2
    CLOSED = 3
    UNNAMED = 4
    """It goes on writing, into a file that has lost its name."""


RINGS = (*STREAMS, "events")


def capacities(rates_hz: Mapping[str, float]) -> dict[str, int]:
    """Rows of each ring (bytes for events): a power of two, at least 16 s deep; 0: no such ring."""
    deep = dict.fromkeys(RINGS, 0)
    for name, rate_hz in rates_hz.items():
        deep[name] = 1 << max(10, int(np.ceil(np.log2(rate_hz * DEPTH_S))))
    deep["events"] = EVENT_BYTES
    return deep


class Shared:
    """The memory file with its control page and rings, mapped into this process."""

    def __init__(self, fd: int, capacity: Mapping[str, int]) -> None:
        self.capacity = dict(capacity)
        self.base: dict[str, int] = {}
        self._taken_to: dict[str, int] = {}
        self._dtypes = {name: row_dtype(stream.row) for name, stream in STREAMS.items()}
        end = CONTROL_BYTES
        for name in RINGS:
            self.base[name] = end
            row_bytes = self._dtypes[name].itemsize if name in STREAMS else 1
            end += -(-self.capacity[name] * row_bytes // 64) * 64
        if os.fstat(fd).st_size < end:
            os.ftruncate(fd, end)
        flags = mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0)
        self.memory = mmap.mmap(fd, end, flags=flags)
        self.counters = memoryview(self.memory)[:TEXT_AT].cast("q")

    @classmethod
    def create(cls, capacity: Mapping[str, int]) -> tuple[Shared, int]:
        """A new memory file, with its descriptor (to be closed by the caller)."""
        fd = os.memfd_create("stepload-record", os.MFD_CLOEXEC)
        try:
            return cls(fd, capacity), fd
        except BaseException:
            os.close(fd)
            raise

    @staticmethod
    def _counter(name: str, which: int) -> int:
        return _FIRST_COUNTER + _PER_RING * RINGS.index(name) + which

    def set_state(self, state: State, text: str = "") -> None:
        """Publish the writer's state; the text is in place before the state shows."""
        raw = text.encode()[: CONTROL_BYTES - TEXT_AT - 1]
        self.memory[TEXT_AT : TEXT_AT + len(raw) + 1] = raw + b"\x00"
        self.counters[0] = state

    @property
    def text(self) -> str:
        raw = self.memory[TEXT_AT:CONTROL_BYTES]
        return raw.split(b"\x00", 1)[0].decode(errors="replace")

    def dropped(self, name: str) -> int:
        return self.counters[self._counter(name, _DROPPED)]

    def recorded(self, name: str) -> int:
        return self.counters[self._counter(name, _RECORDED)]

    def waiting(self, name: str) -> int:
        """Rows pushed and not yet on the disk (not for events, whose ring counts bytes)."""
        return self.counters[self._counter(name, 0)] - self.recorded(name)

    def add_recorded(self, name: str, count: int) -> None:
        """What was taken last is on the disk: its places are free."""
        self.counters[self._counter(name, _TAIL)] = self._taken_to[name]
        self.counters[self._counter(name, _RECORDED)] += count

    def producer(self, name: str, wait_for_room: WaitForRoom) -> Callable[[Any], None]:
        """A function that pushes one sample of this ring's type.

        Args:
            wait_for_room: called with a test when the ring is full; whether there is room now.
        """
        memory, counters = self.memory, self.counters
        packed = "".join(kind.packed for kind in fields_of(STREAMS[name].row).values())
        pack_into = struct.Struct("@" + packed).pack_into
        size, base, capacity = self._dtypes[name].itemsize, self.base[name], self.capacity[name]
        mask = capacity - 1
        i_head, i_tail = self._counter(name, 0), self._counter(name, _TAIL)
        i_dropped = self._counter(name, _DROPPED)
        head, full_at = 0, capacity

        def has_room() -> bool:
            nonlocal full_at
            full_at = counters[i_tail] + capacity
            return head != full_at

        def is_full() -> bool:
            if has_room() or wait_for_room(has_room):
                return False
            counters[i_dropped] += 1
            return True

        def push_flat(row: tuple[float, ...]) -> None:
            nonlocal head
            if head == full_at and is_full():
                return
            pack_into(memory, base + (head & mask) * size, *row)
            head += 1
            counters[i_head] = head

        # The busiest rows spelled out: unpacking into names is the fastest way to flatten.
        def push_force(row: Any) -> None:
            nonlocal head
            if head == full_at and is_full():
                return
            o, p, q, r, (a, b, c, d, e, f), s = row
            pack_into(memory, base + (head & mask) * size, o, p, q, r, a, b, c, d, e, f, s)
            head += 1
            counters[i_head] = head

        def push_arm(row: Any) -> None:
            nonlocal head
            if head == full_at and is_full():
                return
            o, p, q, r, s, t, (a, b, c, d, e, f), (u, v, w, x, y, z) = row
            pack_into(
                memory, base + (head & mask) * size,
                o, p, q, r, s, t, a, b, c, d, e, f, u, v, w, x, y, z,
            )  # fmt: skip
            head += 1
            counters[i_head] = head

        def push_tick(row: Any) -> None:
            nonlocal head
            if head == full_at and is_full():
                return
            a, b, c, d, e, f, o, p, q, r, s, t = row
            pack_into(memory, base + (head & mask) * size, a, b, c, d, e, f, o, p, q, r, s, t)
            head += 1
            counters[i_head] = head

        known = {"qddq6dd": push_force, "qddqdd6d6d": push_arm, 9 * "d" + 3 * "q": push_tick}
        return known.get(packed, push_flat)

    def event_producer(self, wait_for_room: WaitForRoom) -> Callable[[float, bytes], None]:
        """A function that pushes one text with its time."""
        memory, counters = self.memory, self.counters
        base, capacity = self.base["events"], self.capacity["events"]
        i_head, i_tail = self._counter("events", 0), self._counter("events", _TAIL)
        i_dropped = self._counter("events", _DROPPED)

        def push(time_s: float, text: bytes) -> None:
            frame = EVENT_HEAD.pack(len(text), time_s) + text
            head = counters[i_head]

            def has_room() -> bool:
                return head + len(frame) - counters[i_tail] <= capacity

            if len(frame) > capacity or not (has_room() or wait_for_room(has_room)):
                counters[i_dropped] += 1
                return
            at = head % capacity
            first = min(len(frame), capacity - at)
            memory[base + at : base + at + first] = frame[:first]
            memory[base : base + len(frame) - first] = frame[first:]
            counters[i_head] = head + len(frame)

        return push

    def take(self, name: str) -> NDArray[np.void]:
        """All waiting rows of a ring, copied; their places are kept until `add_recorded`."""
        dtype = self._dtypes[name]
        return np.frombuffer(self._taken(name, dtype.itemsize), dtype)

    def take_events(self) -> list[tuple[float, bytes]]:
        """All waiting events, oldest first; their places are kept until `add_recorded`."""
        data, events, at = self._taken("events", 1), [], 0
        while at < len(data):
            length, time_s = EVENT_HEAD.unpack_from(data, at)
            at += EVENT_HEAD.size
            events.append((time_s, data[at : at + length]))
            at += length
        return events

    def _taken(self, name: str, size: int) -> bytes:
        """The bytes of all waiting rows of a ring, each of `size`."""
        i_head, i_tail = self._counter(name, 0), self._counter(name, _TAIL)
        head, tail, capacity = self.counters[i_head], self.counters[i_tail], self.capacity[name]
        base, start = self.base[name], tail % capacity
        stop = start + head - tail
        data = self.memory[base + start * size : base + min(stop, capacity) * size]
        if stop > capacity:
            data += self.memory[base : base + (stop - capacity) * size]
        self._taken_to[name] = head
        return data

    def close(self) -> None:
        """Unmap; producers must not be called any more."""
        self.counters.release()
        self.memory.close()
