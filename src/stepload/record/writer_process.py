"""The process that writes a record, so that neither the disk nor the GIL can hold up the loop.

Started with the file's and the ring memory's descriptors; stdin is a `Connection` that brings how
the record begins and, if it comes to that, verdict and results. Ends when stdin does, after
everything in the rings is written: the death of the runner loses nothing. Imports only what it
needs, to be up quickly.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from stepload.record.container import Appender, sync_directory
from stepload.record.encode import MAX_NS, Channel, Group, to_ns
from stepload.record.layout import EVENTS, STREAMS
from stepload.record.ring import RINGS, Shared, State, capacities

PERIOD_S = 0.05
AHEAD_NS = 1_000_000_000
"""A time that far beyond the loop's own is wrong, and does not shift what is logged later."""
INTERRUPTED = "interrupted"
"""Verdict of a record whose runner went away without finishing it."""


class Writer:
    """Drains the rings into a file, whose topics it names unless the file has them already.

    What such a file has already of the rows that wait is not written again.
    """

    def __init__(self, out: Appender, shared: Shared, offset_ns: int) -> None:
        self._out = out
        self._shared = shared
        self._offset_ns = offset_ns
        self._rings = [name for name in RINGS if shared.capacity[name]]
        if not out.counts:
            streams = [STREAMS[name] for name in self._rings if name in STREAMS]
            out.add_topics([*(topic for stream in streams for topic in stream.topics), EVENTS])
        there = {
            name: out.counts[STREAMS[name].topics[0].channel if name in STREAMS else EVENTS.channel]
            for name in self._rings
        }
        self._skip = {name: max(there[name] - shared.recorded(name), 0) for name in self._rings}
        self._channels = {
            name: Channel(STREAMS.get(name), offset_ns, there[name]) for name in self._rings
        }

    def drain(self) -> None:
        """Everything that waits becomes one chunk on the disk."""
        groups: list[Group] = []
        # Taken against the order in which the loop pushes: no sample is left behind its tick.
        waiting: dict[str, Any] = {
            name: self._shared.take_events() if name == "events" else self._shared.take(name)
            for name in reversed(self._rings)
        }
        ticks = waiting.get("tick", ())
        latest_ns = int(to_ns(ticks["time_s"], self._offset_ns).max()) if len(ticks) else MAX_NS
        for name in self._rings:
            channel, rows = self._channels[name], waiting[name][self._skip.pop(name, 0) :]
            encode: Callable[[Any], list[Group]] = channel.encode_samples
            if name in ("events", "tick"):
                encode = channel.encode_events if name == "events" else channel.encode_ticks
            channel.within(self._out.last_ns, latest_ns + AHEAD_NS)
            if len(rows):
                groups += encode(rows)
        if groups:
            self._out.add_chunk(groups)
            self._out.sync()
        for name, rows in waiting.items():
            self._shared.add_recorded(name, len(rows))

    def finish(self, verdict: str, results: bytes | None) -> None:
        """Results, counts and the summary."""
        if results is not None:
            self._out.add_attachment("results.json", results, time.time_ns())
        counts = {f"recorded_{n}": str(self._shared.recorded(n)) for n in self._rings}
        lost = {f"dropped_{n}": str(self._shared.dropped(n)) for n in self._rings}
        self._out.add_metadata("result", {"verdict": verdict, **counts, **lost})
        self._out.finish()


class Start(NamedTuple):
    """How a record begins; `attachments` by name."""

    rates_hz: Mapping[str, float]
    offset_ns: int
    wall_ns: int
    part: Path
    metadata: Mapping[str, str]
    attachments: Mapping[str, bytes]


def begin(out: Appender, start: Start) -> None:
    """Write how the record begins, behind its header."""
    out.add_metadata("run", start.metadata)
    for name, data in start.attachments.items():
        out.add_attachment(name, data, start.wall_ns)


def _is_named(path: Path, fd: int) -> bool:
    """Whether a path is still that of an open file."""
    try:
        return os.path.samestat(path.stat(), os.fstat(fd))
    except OSError:
        return False


def _record(control: Connection, file_fd: int, memory_fd: int, shared: list[Shared]) -> None:
    start: Start = control.recv()
    memory = Shared(memory_fd, capacities(start.rates_hz))
    shared.append(memory)
    out = Appender(file_fd)
    out.start()
    begin(out, start)
    writer = Writer(out, memory, start.offset_ns)
    out.sync()
    sync_directory(start.part.parent)
    memory.set_state(State.RUNNING)
    verdict, results = INTERRUPTED, None
    due, named = time.monotonic() + PERIOD_S, True
    with contextlib.suppress(EOFError):
        while not control.poll(max(due - time.monotonic(), 0.0)):
            due = time.monotonic() + PERIOD_S
            writer.drain()
            if named and not (named := _is_named(start.part, file_fd)):
                memory.set_state(State.UNNAMED, f"{start.part} was deleted or moved")
        verdict, results = control.recv()
    writer.drain()
    writer.finish(verdict, results)
    memory.set_state(State.CLOSED)


def main(file_fd: int, memory_fd: int) -> int:
    """Write until the recorder is done or gone; returns the exit code."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    control = Connection(0, writable=False)
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
        with contextlib.suppress(OSError, EOFError):  # keep the file, and its lock, to the end
            control.recv()
        return 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
