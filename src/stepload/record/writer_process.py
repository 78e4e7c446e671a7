"""The process that writes a record, so that neither the disk nor the GIL can hold up the loop.

Started with the file's and the ring memory's descriptors; stdin carries frames from the recorder
(kind, length, payload). Ends when stdin does, after everything in the rings is written: the death
of the runner loses nothing. Imports only what it needs, to be up quickly.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import struct
import sys
import time
from enum import IntEnum
from pathlib import Path

from stepload.record.container import Appender, sync_directory
from stepload.record.encode import Channel, Group
from stepload.record.layout import EVENTS, STREAMS
from stepload.record.ring import RINGS, Shared, State, capacities

PERIOD_S = 0.05
FRAME = struct.Struct("<BQ")
INTERRUPTED = "interrupted"
"""Verdict of a record whose runner went away without finishing it."""


class Kind(IntEnum):
    """Frames from the recorder."""

    START = 1
    ATTACHMENT = 2
    DRAIN = 4
    FINISH = 5


class Control:
    """Frames from stdin, as they come."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._buffer = bytearray()
        self._poll = select.poll()
        self._poll.register(fd, select.POLLIN | select.POLLHUP)
        self.ended = False

    def wait(self, timeout_s: float) -> tuple[Kind, bytes] | None:
        """The next frame; None after `timeout_s` or at the end."""
        give_up_at = time.monotonic() + timeout_s
        while True:
            if len(self._buffer) >= FRAME.size:
                kind, length = FRAME.unpack_from(self._buffer)
                end = FRAME.size + length
                if len(self._buffer) >= end:
                    payload = bytes(self._buffer[FRAME.size : end])
                    del self._buffer[:end]
                    return Kind(kind), payload
            left_ms = max(give_up_at - time.monotonic(), 0.0) * 1e3
            if self.ended or not self._poll.poll(left_ms):
                return None
            data = os.read(self._fd, 1 << 20)
            self.ended = not data
            self._buffer += data


class Writer:
    """Names the topics of the rings there are, then drains the rings into the file."""

    def __init__(self, out: Appender, shared: Shared, offset_ns: int) -> None:
        self._out = out
        self._shared = shared
        self._rings = [name for name in RINGS if shared.capacity[name]]
        self._channels = {name: Channel(STREAMS.get(name), offset_ns) for name in self._rings}
        streams = [STREAMS[name] for name in self._rings if name in STREAMS]
        out.add_topics([*(topic for stream in streams for topic in stream.topics), EVENTS])

    def drain(self) -> None:
        """Everything that waits becomes one chunk on the disk."""
        groups: list[Group] = []
        taken: dict[str, int] = {}
        for name in self._rings:
            channel = self._channels[name]
            if name == "events":
                events = self._shared.take_events()
                taken[name] = len(events)
                groups += channel.encode_events(events) if events else []
                continue
            rows = self._shared.take(name)
            taken[name] = len(rows)
            if len(rows):
                encode = channel.encode_ticks if name == "tick" else channel.encode_samples
                groups += encode(rows)
        if not groups:
            return
        self._out.add_chunk(groups)
        self._out.sync()
        for name, count in taken.items():
            self._shared.add_recorded(name, count)

    def finish(self, verdict: str, results: bytes | None) -> None:
        """Results, counts and the summary."""
        if results is not None:
            self._out.add_attachment("results.json", results, time.time_ns())
        counts = {f"recorded_{n}": str(self._shared.recorded(n)) for n in self._rings}
        lost = {f"dropped_{n}": str(self._shared.dropped(n)) for n in self._rings}
        self._out.add_metadata("result", {"verdict": verdict, **counts, **lost})
        self._out.finish()


def _record(control: Control, file_fd: int, memory_fd: int, shared: list[Shared]) -> None:
    def need(kind: Kind) -> bytes:
        frame = control.wait(30.0)
        if frame is None or frame[0] != kind:
            raise RuntimeError(f"the recorder went away before {kind.name}")
        return frame[1]

    start = json.loads(need(Kind.START))
    memory = Shared(memory_fd, capacities(start["rates_hz"]))
    shared.append(memory)
    out = Appender(file_fd)
    out.start()
    out.add_metadata("run", start["metadata"])
    for _ in range(start["attachments"]):
        name, _, data = need(Kind.ATTACHMENT).partition(b"\x00")
        out.add_attachment(name.decode(), data, start["wall_ns"])
    writer = Writer(out, memory, start["offset_ns"])
    out.sync()
    sync_directory(Path(start["directory"]))
    memory.set_state(State.RUNNING)
    verdict, results = INTERRUPTED, None
    due = time.monotonic() + PERIOD_S
    while not control.ended:
        frame = control.wait(max(due - time.monotonic(), 0.0))
        if frame is not None and frame[0] == Kind.FINISH:
            head, _, body = frame[1].partition(b"\x00")
            verdict, results = head.decode(), body
            break
        due = time.monotonic() + PERIOD_S
        writer.drain()
    writer.drain()
    writer.finish(verdict, results)
    memory.set_state(State.CLOSED)


def _wait_for_the_end(control: Control) -> None:
    """Keep the file (and its lock) until the recorder lets go of it."""
    while not control.ended:
        frame = control.wait(1.0)
        if frame is not None and frame[0] == Kind.FINISH:
            return


def main(file_fd: int, memory_fd: int) -> int:
    """Write until the recorder is done or gone; returns the exit code."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    control = Control(0)
    shared: list[Shared] = []
    try:
        _record(control, file_fd, memory_fd, shared)
        return 0
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
        if shared:
            shared[0].set_state(State.FAILED, text)
        else:
            print(f"record writer: {text}", file=sys.stderr)
            return 1
        with contextlib.suppress(OSError):
            _wait_for_the_end(control)
        return 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
