"""Records made on the spot: through the real writer code, chunk by chunk, without its process."""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import zstandard
from mcap.records import Chunk, MessageIndex, Statistics
from mcap.stream_reader import StreamReader

from stepload.record.container import Appender
from stepload.record.ring import Shared, capacities
from stepload.record.rows import Phase, TickRow
from stepload.record.writer_process import Writer
from stepload.rig.samples import ArmSample, ForceSample

OFFSET_NS = 1_700_000_000_000_000_000


class VirtualClock:
    virtual = True

    def __init__(self) -> None:
        self.time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_until(self, time_s: float) -> None:
        self.time_s = max(self.time_s, time_s)


def force_sample(i: int) -> ForceSample:
    time_s = 100.0 + i * 1e-3
    wrench = (0.1, -0.2, math.sin(i), 0.01, 0.02, 0.03 * i)
    return ForceSample(i, 7.0 + i * 1e-3, time_s, i % 3, wrench, 21.5)


def arm_sample(i: int) -> ArmSample:
    time_s = 100.0 + i * 2e-3
    pose, wrench = (0.0, 0.0, -i * 1e-6, 0, 0, 0), (0.5, -0.5, 0.1 * i, 0.01, -0.02, 0.03)
    return ArmSample(i, math.nan, time_s, 0, i * 1e-6, 0.1 * i, pose, wrench)


def tick_row(i: int) -> TickRow:
    time_s = 100.0 + i * 2e-3
    return TickRow(time_s, i * 1e-6, 1.0, math.nan, 2.0, 300.0, 1e-6, 50.0, 0.0, Phase.LOAD, 1, i)


@pytest.fixture
def virtual_clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def write_record(tmp_path: Path) -> Callable[..., Path]:
    """Write a record with `chunks` chunks of 50 ms each; unfinished ones have no summary."""

    def write(
        name: str = "run.mcap",
        chunks: int = 8,
        finished: bool = True,
        tick: Callable[[int], tuple[Any, ...]] = tick_row,
        arm: Callable[[int], tuple[Any, ...]] = arm_sample,
    ) -> Path:
        path = tmp_path / name
        rates_hz = {"force": 1000.0, "arm": 500.0, "tick": 500.0}
        shared, memory_fd = Shared.create(capacities(rates_hz))
        os.close(memory_fd)
        with path.open("wb") as file:
            out = Appender(file.fileno())
            out.start()
            out.add_metadata("run", {"force_axis": "+fz"})
            out.add_attachment("plan.yaml", b"payload: {}\n", OFFSET_NS)
            writer = Writer(out, shared, OFFSET_NS)
            pushes = {n: shared.producer(n, lambda _: False) for n in rates_hz}
            event = shared.event_producer(lambda _: False)
            for chunk in range(chunks):
                for i in range(chunk * 50, chunk * 50 + 50):
                    pushes["force"](force_sample(i))
                for i in range(chunk * 25, chunk * 25 + 25):
                    pushes["arm"](arm(i))
                    pushes["tick"](tick(i))
                event(100.0 + chunk * 0.05, b'{"time_s": 100.0, "kind": "note", "data": {}}')
                writer.drain()
            if finished:
                writer.finish("identified", b'{"k": 1.5}')
        del pushes, event
        shared.close()
        return path

    return write


@pytest.fixture
def make() -> SimpleNamespace:
    """Sample i of each stream, all different."""
    return SimpleNamespace(force=force_sample, arm=arm_sample, tick=tick_row)


@pytest.fixture
def check_indexes() -> Callable[[Path], None]:
    """See that each entry of a file's message indexes points to its message."""

    def check(path: Path) -> None:
        with path.open("rb") as file:
            found = list(StreamReader(file, emit_chunks=True).records)
        content, checked = b"", 0
        for record in found:
            if isinstance(record, Chunk):
                content = zstandard.decompress(record.data)
            elif isinstance(record, MessageIndex):
                for time_ns, at in record.records:
                    message = struct.unpack_from("<BQHIQ", content, at)
                    assert (message[0], message[2], message[4]) == (5, record.channel_id, time_ns)
                    checked += 1
        (statistics,) = [record for record in found if isinstance(record, Statistics)]
        assert checked == statistics.message_count > 0

    return check
