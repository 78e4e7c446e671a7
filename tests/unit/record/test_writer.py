"""The writer's order on the disk, its times and stamps, and what it does when the disk fails."""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, DataEnd, Statistics
from mcap.stream_reader import StreamReader

from stepload.record import container, writer_process
from stepload.record.container import Appender
from stepload.record.encode import Channel
from stepload.record.layout import STREAMS, TOPICS
from stepload.record.reader import read_recording
from stepload.record.ring import Shared, State, capacities
from stepload.record.writer_process import Start, Writer

RATES_HZ = {"force": 1000.0, "arm": 500.0, "tick": 500.0}
OFFSET_NS = 1_700_000_000_000_000_000


def never(_: Callable[[], bool]) -> bool:
    return False


class Told(Appender):
    """An appender that keeps what was asked of it, in order, and the rows counted until then."""

    def __init__(self, fd: int, shared: Shared, story: list[tuple[str, int]]) -> None:
        super().__init__(fd)
        self.shared, self.story = shared, story

    def append(self, *parts: bytes) -> None:
        super().append(*parts)
        self.story.append(("append", self.shared.recorded("force")))

    def sync(self) -> None:
        super().sync()
        self.story.append(("sync", self.shared.recorded("force")))


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[SimpleNamespace]:
    """A writer on a file, with its rings."""
    shared, fd = Shared.create(capacities(RATES_HZ))
    os.close(fd)
    story: list[tuple[str, int]] = []
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        out = Told(file.fileno(), shared, story)
        out.start()
        out.add_metadata("run", {})
        push = {name: shared.producer(name, never) for name in RATES_HZ}
        yield SimpleNamespace(
            path=path, out=out, shared=shared, story=story, push=push,
            event=shared.event_producer(never), writer=Writer(out, shared, OFFSET_NS),
        )  # fmt: skip
    push.clear()


def read_back(desk: SimpleNamespace) -> list[tuple[str, Any]]:
    with desk.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        return [(channel.topic, message) for _, channel, message in reader.iter_messages()]


def test_rows_count_as_recorded_only_when_the_disk_has_them(
    desk: SimpleNamespace, make: SimpleNamespace
) -> None:
    desk.story.clear()
    for i in range(7):
        desk.push["force"](make.force(i))
    desk.writer.drain()
    assert desk.story == [("append", 0), ("sync", 0)]
    assert desk.shared.recorded("force") == 7
    assert desk.shared.recorded("arm") == 0
    desk.writer.drain()
    assert len(desk.story) == 2


def test_counts_at_the_end_are_what_was_recorded_and_dropped(
    desk: SimpleNamespace, make: SimpleNamespace
) -> None:
    capacity = desk.shared.capacity["arm"]
    for i in range(capacity + 2):
        desk.push["arm"](make.arm(i))
    desk.event(100.0, b'{"time_s": 1.0, "kind": "note", "data": {}}')
    desk.writer.drain()
    desk.writer.finish("stopped", None)
    got = read_recording(desk.path)
    assert got.results is None
    assert got.partial
    assert got.outcome["verdict"] == "stopped"
    assert got.outcome["recorded_arm"] == str(capacity)
    assert got.outcome["dropped_arm"] == "2"
    assert got.outcome["recorded_events"] == "1"
    assert got.outcome["dropped_force"] == "0"


def test_times_never_go_back_and_chunks_do_not_overlap(
    desk: SimpleNamespace, make: SimpleNamespace
) -> None:
    for batch in ((5, 9, 6), (7, 8, 12)):
        for i in batch:
            desk.push["force"](make.force(i))
            desk.push["tick"](make.tick(i))
            desk.event(100.0 + i * 1e-3, b'{"time_s": 1.0, "kind": "note", "data": {}}')
        desk.writer.drain()
    desk.writer.finish("identified", b"{}")
    messages = read_back(desk)
    end_ns = OFFSET_NS + round(100.018 * 1e9)
    for topic in ("/force", "/force/sample", "/tick", "/events"):
        ordered = sorted((m.sequence, m.log_time) for t, m in messages if t == topic)
        if topic in ("/tick", "/events"):
            assert [sequence for sequence, _ in ordered] == list(range(6))
            times = [time_ns for _, time_ns in ordered]
        else:
            in_order = dict(ordered)
            times = [in_order[sequence] for sequence in (5, 9, 6, 7, 8, 12)]
        assert times == sorted(times)
        step = 1 if topic != "/tick" else 2
        assert times[0] == OFFSET_NS + round((100.0 + 5e-3 * step) * 1e9)
        assert times[1] == times[2] <= times[3] == times[4] == end_ns
        assert times[5] == (end_ns + 6_000_000 if topic == "/tick" else end_ns)
    with desk.path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    first, second = summary.chunk_indexes
    assert first.message_end_time == second.message_start_time == end_ns


def test_a_time_far_ahead_does_not_shift_what_comes_later(
    desk: SimpleNamespace, make: SimpleNamespace
) -> None:
    for i in (0, 1, 2000, 2001):
        far_s = 1e6 * (i == 1)
        desk.push["force"](make.force(i)._replace(receive_time_s=100.0 + 1e-3 * i + far_s))
        desk.push["tick"](make.tick(i)._replace(time_s=100.0 + 1e-3 * i))
        desk.writer.drain()
    desk.writer.finish("identified", b"{}")
    got = sorted((m.sequence, m.log_time - OFFSET_NS) for t, m in read_back(desk) if t == "/force")
    assert [ns for _, ns in got] == [
        round(s * 1e9) for s in (100.0, 101.001, 102.0, 102.001)
    ]  # fmt: skip


def samples(device_s: list[float], receive_s: list[float]) -> np.ndarray:
    rows = np.zeros(len(device_s), [("sequence", "<i8"), ("device_time_s", "<f8"),
                                    ("receive_time_s", "<f8"), ("status", "<i8"),
                                    ("displacement_m", "<f8")])  # fmt: skip
    rows["device_time_s"], rows["receive_time_s"] = device_s, receive_s
    return rows


def stamps(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(log, publish) times of gauge samples, in s."""
    ((_, _, raw),) = Channel(STREAMS["displacement"], 0).encode_samples(rows)
    out = np.frombuffer(raw, TOPICS["/displacement"].dtype)
    return out["log_ns"] / 1e9, out["publish_ns"] / 1e9


def test_a_sample_is_stamped_when_it_was_taken_not_when_it_came() -> None:
    taken = np.arange(6) * 0.01 + 50.0
    late = np.array([0.004, 0.003, 0.001, 0.005, 0.002, 0.004])
    log_s, publish_s = stamps(samples(list(taken - 43.0), list(taken + late)))
    np.testing.assert_allclose(log_s, taken + late, atol=1e-8)
    np.testing.assert_allclose(publish_s, taken + 0.001, atol=1e-6)
    assert (publish_s <= log_s).all()


def test_checksums_and_bounds_of_a_whole_file(
    desk: SimpleNamespace, make: SimpleNamespace, check_indexes: Callable[[Path], None]
) -> None:
    for first in (0, 20):
        for i in range(first, first + 10):
            desk.push["force"](make.force(i))
            desk.push["arm"](make.arm(i))
        desk.writer.drain()
    desk.out.add_attachment("a.json", b"{}", 1)
    desk.writer.finish("identified", b"{}")
    check_indexes(desk.path)
    data = desk.path.read_bytes()
    with desk.path.open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
    records = list(StreamReader(io.BytesIO(data), validate_crcs=True, emit_chunks=True).records)
    chunks = [r for r in records if isinstance(r, Chunk)]
    assert len(chunks) == 2
    assert all(chunk.uncompressed_crc for chunk in chunks)
    ends = [OFFSET_NS + round((100.0 + t) * 1e9) for t in (0.0, 0.018, 0.020, 0.058)]
    bounds = [b for c in chunks for b in (c.message_start_time, c.message_end_time)]
    assert bounds == ends
    indexed = [r for r in records if isinstance(r, ChunkIndex)]
    assert [(c.message_start_time, c.message_end_time) for c in indexed] == [
        (ends[0], ends[1]), (ends[2], ends[3])
    ]  # fmt: skip
    (end,) = [r for r in records if isinstance(r, DataEnd)]
    at = data.index(b"\x0f\x04\x00\x00\x00\x00\x00\x00\x00")
    assert end.data_section_crc == zlib.crc32(data[:at])
    (statistics,) = [r for r in records if isinstance(r, Statistics)]
    assert statistics.message_start_time == ends[0]
    assert statistics.message_end_time == ends[3]
    assert statistics.message_count == 60
    assert statistics.attachment_count == 2
    assert summary is not None
    assert summary.statistics is not None
    footer_at = len(data) - 8 - 29
    (summary_start,) = struct.unpack_from("<Q", data, footer_at + 9)
    (summary_crc,) = struct.unpack_from("<I", data, footer_at + 25)
    assert summary_crc == zlib.crc32(data[summary_start:-12])
    found = [data[a.offset : a.offset + a.length] for a in summary.attachment_indexes]
    assert [b"a.json" in found[0], b"results.json" in found[1]] == [True, True]


def test_a_write_in_pieces_is_put_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = os.write
    monkeypatch.setattr(container.os, "write", lambda fd, data: write(fd, data[:7]))
    with (tmp_path / "f").open("wb") as file:
        out = Appender(file.fileno())
        out.append(b"0123456789", b"abcdefghij")
        assert out.good == 20
    assert (tmp_path / "f").read_bytes() == b"0123456789abcdefghij"


def test_a_failed_write_leaves_nothing_of_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, calls = os.write, []

    def full(fd: int, data: bytes) -> int:
        calls.append(len(data))
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return write(fd, data[:5])

    with (tmp_path / "f").open("wb") as file:
        out = Appender(file.fileno())
        out.append(b"good")
        calls.clear()
        monkeypatch.setattr(container.os, "write", full)
        with pytest.raises(OSError, match="No space"):
            out.append(b"0123456789")
        assert out.good == 4
        monkeypatch.undo()
        out.append(b" end")
    assert (tmp_path / "f").read_bytes() == b"good end"


class Messages:
    """Messages as the writer process takes them, and calls in between; ends after the last."""

    def __init__(self, *messages: Any) -> None:
        self.messages = list(messages)

    def poll(self, timeout_s: float) -> bool:
        if self.messages and callable(self.messages[0]):
            self.messages.pop(0)()
            return False
        return True

    def recv(self) -> Any:
        if not self.messages:
            raise EOFError
        return self.messages.pop(0)


def run_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: SimpleNamespace, *last: Any
) -> tuple[list[str], Shared, Path]:
    """The writer process' work in this process; what it did in order, its rings and its file."""
    story: list[str] = []
    shared, memory_fd = Shared.create(capacities(RATES_HZ))
    push = shared.producer("force", never)
    fdatasync, set_state = os.fdatasync, Shared.set_state

    def sync(fd: int) -> None:
        fdatasync(fd)
        story.append("file")

    def state(self: Shared, to: State, text: str = "") -> None:
        set_state(self, to, text)
        story.append(f"{to.name} {text}".strip())

    def late() -> None:
        """A row that comes in just before the end."""
        push(make.force(8))

    monkeypatch.setattr(os, "fdatasync", sync)
    monkeypatch.setattr(Shared, "set_state", state)
    monkeypatch.setattr(writer_process, "sync_directory", lambda path: story.append(path.name))
    start = Start(RATES_HZ, 0, 0, tmp_path / "run.mcap", {"a": "b"}, {"plan.yaml": b"text"})
    path = tmp_path / "run.mcap"
    control = Messages(start, late, *last)
    monkeypatch.setattr(writer_process, "Connection", lambda *_, **__: control)
    with path.open("wb") as file, monkeypatch.context() as patch:
        patch.setattr(writer_process.signal, "signal", lambda *_: None)
        writer_process.main(file.fileno(), memory_fd)
    os.close(memory_fd)
    return story, shared, path


def test_the_beginning_is_on_the_disk_before_the_run_may_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: SimpleNamespace
) -> None:
    story, _, path = run_process(tmp_path, monkeypatch, make, ("identified", b"{}"))
    assert story == ["file", tmp_path.name, "RUNNING", "file", "file", "CLOSED"]
    got = read_recording(path)
    assert not got.partial
    assert got.attachments["plan.yaml"] == b"text"
    assert got.metadata == {"a": "b"}
    assert got.outcome["verdict"] == "identified"


@pytest.mark.parametrize("finished", [True, False])
def test_rows_that_come_last_are_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: SimpleNamespace, finished: bool
) -> None:
    pushes: list[Callable[[], None]] = []

    create = Shared.create

    def created(capacity: Any) -> Any:
        shared, fd = create(capacity)
        push = shared.producer("arm", never)
        pushes.append(lambda: push(make.arm(3)))
        return shared, fd

    monkeypatch.setattr(Shared, "create", created)
    last = [lambda: pushes[0](), *([("identified", b"{}")] if finished else [])]
    _, shared, path = run_process(tmp_path, monkeypatch, make, *last)
    assert shared.recorded("arm") == 1
    got = read_recording(path)
    assert got.arm.sequence.tolist() == [3]
    assert got.force.sequence.tolist() == [8]
    assert got.outcome["verdict"] == ("identified" if finished else "interrupted")
    assert got.partial is not finished


def test_a_disk_that_fails_is_told_to_the_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: SimpleNamespace
) -> None:
    def full(self: Appender, groups: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Appender, "add_chunk", full)
    story, shared, _ = run_process(tmp_path, monkeypatch, make)
    assert "RUNNING" in story
    assert story[-1] == "FAILED OSError: [Errno 28] No space left on device"
    assert shared.counters[0] == State.FAILED
    assert shared.recorded("force") == 0
