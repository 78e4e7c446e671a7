"""The recorder end to end: what goes in comes out, here and in the field's readers."""

from __future__ import annotations

import os
import resource
import signal
import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from stepload.errors import BadInputError
from stepload.record import recorder as recorder_module
from stepload.record.reader import read_recording
from stepload.record.recorder import Recorder, RecordingFailedError
from stepload.record.recovery import find_unfinished, is_being_written, recover
from stepload.record.ring import State
from stepload.rig.samples import DisplacementSample

RATES_HZ = {"force": 1000.0, "arm": 500.0, "tick": 500.0}
Start = Callable[..., Recorder]


def decode(path: Path) -> list[tuple[str, Any, Any]]:
    """(topic, message record, decoded message) of everything, through mcap-ros2-support."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(c.topic, m, d) for _, c, m, d in reader.iter_decoded_messages()]


@pytest.fixture
def start(tmp_path: Path, virtual_clock: Any) -> Any:
    started: list[Recorder] = []

    def start(rates_hz: Mapping[str, float] = RATES_HZ, lossless: bool = True) -> Recorder:
        recorder = Recorder(
            tmp_path,
            rates_hz=rates_hz,
            clock=virtual_clock,
            metadata={"run_id": "r1", "force_axis": "+fz"},
            attachments={"plan.yaml": b"payload: {}\n"},
            lossless=lossless,
            say=(said := []).append,
        )
        recorder.said = said  # type: ignore[attr-defined]
        started.append(recorder)
        return recorder

    yield start
    for recorder in started:
        recorder.abandon()


def fill(recorder: Recorder, make: SimpleNamespace, count: int) -> None:
    for i in range(count):
        recorder.force(make.force(i))
        if i % 2:
            recorder.arm(make.arm(i // 2))
            recorder.tick(make.tick(i // 2))


def test_everything_comes_back_exactly(start: Start, make: SimpleNamespace) -> None:
    recorder = start({**RATES_HZ, "second_force": 100.0, "displacement": 50.0})
    fill(recorder, make, 400)
    recorder.second_force(make.force(7))
    recorder.displacement(DisplacementSample(3, 1.0, 100.2, 0, 2e-6))
    recorder.event(100.3, "touch", {"force_n": 2.5, "limit": float("inf"), "at": np.float64(0.1)})
    path = recorder.finish({"k": 1.0, "bad": float("nan")}, "identified")

    got = read_recording(path)
    assert path.name == "run.mcap"
    assert not got.partial
    assert not got.damage
    samples = [make.force(i) for i in range(400)]
    np.testing.assert_array_equal(got.force.sequence, [s.sequence for s in samples])
    np.testing.assert_array_equal(got.force.receive_time_s, [s.receive_time_s for s in samples])
    np.testing.assert_array_equal(got.force.device_time_s, [s.device_time_s for s in samples])
    np.testing.assert_array_equal(got.force.status, [s.status for s in samples])
    np.testing.assert_array_equal(got.force.temperature_c, [s.temperature_c for s in samples])
    np.testing.assert_array_equal(got.force.wrench, [s.wrench for s in samples])
    arm = [make.arm(i) for i in range(200)]
    np.testing.assert_array_equal(got.arm.position_m, [s.position_m for s in arm])
    np.testing.assert_array_equal(got.arm.pose, [s.pose for s in arm])
    np.testing.assert_array_equal(got.arm.force_n, [s.force_n for s in arm])
    np.testing.assert_array_equal(got.arm.wrench, [s.wrench for s in arm])
    ticks = [make.tick(i) for i in range(200)]
    for name in ticks[0]._fields:
        np.testing.assert_array_equal(
            getattr(got.ticks, name), [getattr(t, name) for t in ticks], err_msg=name
        )
    assert got.second_force is not None
    np.testing.assert_array_equal(got.second_force.wrench, [make.force(7).wrench])
    assert got.displacement is not None
    assert got.displacement.displacement_m.tolist() == [2e-6]
    (event,) = got.events
    assert (event.time_s, event.kind) == (100.3, "touch")
    assert event.data == {"force_n": 2.5, "limit": "inf", "at": 0.1}
    assert got.results == {"k": 1.0, "bad": "nan"}
    assert got.metadata["run_id"] == "r1"
    assert got.outcome["verdict"] == "identified"
    assert got.outcome["recorded_force"] == "400"
    assert got.attachments["plan.yaml"] == b"payload: {}\n"


def test_the_last_name_is_on_the_disk_when_a_record_is_finished(
    start: Start, make: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = start()
    synced = []
    monkeypatch.setattr(
        recorder_module, "sync_directory", lambda path: synced.append(sorted(path.iterdir()))
    )
    assert recorder.finish({}, "identified") == recorder.path
    assert synced == [[recorder.path]]


def dead(recorder: Recorder) -> None:
    os.kill(recorder._process.pid, signal.SIGKILL)
    recorder._process.wait()


@pytest.mark.parametrize("device_s", [1e6, 1e300, -1e300, float("nan")])
def test_a_jump_of_a_device_s_clock_does_not_stamp_what_follows(
    start: Start, make: SimpleNamespace, device_s: float
) -> None:
    recorder = start()
    for i in range(600):
        sample = make.force(i)
        recorder.force(sample._replace(device_time_s=device_s) if i == 300 else sample)
        if i % 100 == 99:
            recorder.sync()
    found = [
        (m.publish_time - m.log_time) * 1e-9
        for topic, m, _ in decode(recorder.finish({}, "identified"))
        if "force" in topic
    ]
    assert len(found) >= 600
    assert max(map(abs, found)) < 1.0


def test_a_dead_writer_is_seen(start: Start) -> None:
    recorder = start()
    dead(recorder)
    until(lambda: bool(recorder.problem()))
    assert "code -9" in recorder.problem()


def test_nobody_waits_for_a_dead_writer(start: Start) -> None:
    recorder = start()
    requested = []

    def has_room() -> bool:
        if not requested:
            dead(recorder)
        requested.append(1)
        assert len(requested) < 2000
        return False

    assert recorder._wait_for_room(has_room) is False


def test_a_sync_that_cannot_come_true_fails(
    start: Start, make: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = start()
    dead(recorder)
    recorder.force(make.force(0))
    sleeps: list[float] = []

    def sleep(seconds: float, wait: Callable[[float], None] = time.sleep) -> None:
        wait(seconds)
        sleeps.append(seconds)
        assert len(sleeps) < 200

    monkeypatch.setattr(recorder_module.time, "sleep", sleep)
    with pytest.raises(RecordingFailedError, match="code -9"):
        recorder.sync()


@pytest.mark.parametrize("what", ["row", "event"])
def test_sync_waits_for_all_that_was_pushed(
    start: Start, make: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    recorder = start()
    os.kill(recorder._process.pid, signal.SIGSTOP)
    until(lambda: b") T " in Path(f"/proc/{recorder._process.pid}/stat").read_bytes())
    if what == "row":
        recorder.tick(make.tick(0))
    else:
        recorder.event(100.0, "note", {})
    sleep, sleeps = time.sleep, []

    def go_on(seconds: float) -> None:
        if not sleeps:
            os.kill(recorder._process.pid, signal.SIGCONT)
        sleeps.append(seconds)
        sleep(seconds)

    monkeypatch.setattr(recorder_module.time, "sleep", go_on)
    recorder.sync()
    assert sleeps
    got = read_recording(recorder.part_path)
    assert len(got.ticks.time_s) + len(got.events) == 1


def test_long_runs_are_read_as_means(start: Start, make: SimpleNamespace) -> None:
    recorder = start()
    fill(recorder, make, 404)
    path = recorder.finish({}, "identified")
    full, mean = read_recording(path), read_recording(path, mean_of=5)
    np.testing.assert_allclose(
        mean.force.wrench, full.force.wrench[:400].reshape(80, 5, 6).mean(axis=1)
    )
    np.testing.assert_allclose(mean.force.receive_time_s, full.force.receive_time_s[2:400:5])
    assert (mean.force.status == 3).all()
    np.testing.assert_array_equal(mean.force.sequence, full.force.sequence[4::5])
    np.testing.assert_array_equal(mean.ticks.step, full.ticks.step[4::5])
    np.testing.assert_array_equal(mean.ticks.target_m, full.ticks.target_m[4::5])
    assert len(mean.arm.receive_time_s) == 40


def test_opens_and_decodes_in_the_fields_readers(start: Start, make: SimpleNamespace) -> None:
    recorder = start()
    fill(recorder, make, 300)
    recorder.event(100.1, "note", {"text": "ü"})
    path = recorder.finish({}, "identified")
    expected = {"/force": 300, "/force/sample": 300, "/arm": 150, "/tick": 150, "/events": 1}

    seen: Counter[str] = Counter()
    wrenches = []
    with AnyReader([path]) as bag:
        for connection, _, raw in bag.messages():
            message: Any = bag.deserialize(raw, connection.msgtype)
            seen[connection.topic] += 1
            if connection.topic == "/force":
                wrenches.append(message.wrench.force.z)
    assert seen == expected
    assert wrenches == [make.force(i).wrench[2] for i in range(300)]

    seen.clear()
    stamps = []
    for topic, message, decoded in decode(path):
        seen[topic] += 1
        if topic == "/force":
            stamp = decoded.header.stamp
            stamps.append(stamp.sec * 10**9 + stamp.nanosec - message.publish_time)
            assert message.publish_time <= message.log_time
            assert decoded.header.frame_id == "force"
    assert seen == expected
    assert set(stamps) == {0}


def test_lossless_waits_for_the_writer(start: Start, make: SimpleNamespace) -> None:
    recorder = start({**RATES_HZ, "force": 60.0})
    capacity = recorder._shared.capacity["force"]
    for i in range(capacity * 5):
        recorder.force(make.force(i))
    assert not recorder.problem()
    got = read_recording(recorder.finish({}, "identified"))
    assert got.force.sequence.tolist() == list(range(capacity * 5))


def test_a_full_ring_drops_the_newest_and_says_so(start: Start, make: SimpleNamespace) -> None:
    recorder = start({**RATES_HZ, "force": 60.0}, lossless=False)
    capacity = recorder._shared.capacity["force"]
    os.kill(recorder._process.pid, signal.SIGSTOP)
    try:
        for i in range(capacity + 10):
            recorder.force(make.force(i))
        until(lambda: bool(recorder.problem()))
        problem = recorder.problem()
    finally:
        os.kill(recorder._process.pid, signal.SIGCONT)
    assert "10 of force" in problem
    got = read_recording(recorder.finish({}, "stopped"))
    assert got.force.sequence.tolist() == list(range(capacity))
    assert got.outcome["dropped_force"] == "10"


def test_signals_to_the_group_do_not_reach_the_writer(start: Start, make: SimpleNamespace) -> None:
    recorder = start()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(recorder._process.pid, number)
    fill(recorder, make, 100)
    assert len(read_recording(recorder.finish({}, "stopped")).force.sequence) == 100


def test_a_full_disk_is_a_problem_and_leaves_a_repairable_file(
    start: Start, make: SimpleNamespace
) -> None:
    recorder = start()
    fill(recorder, make, 200)
    until(lambda: recorder.recorded("tick") == 100)
    size = recorder.part_path.stat().st_size + 4096
    resource.prlimit(recorder._process.pid, resource.RLIMIT_FSIZE, (size, size))
    written = 200
    while not (problem := recorder.problem()):
        recorder.force(make.force(written))
        written += 1
    assert "File too large" in problem
    with pytest.raises(RecordingFailedError, match="File too large"):
        recorder.finish({}, "stopped")
    recorder.abandon()
    recovered = recover(recorder.part_path)
    got = read_recording(recovered.path)
    assert recovered.cut_bytes == 0
    assert got.partial
    assert 200 <= len(got.force.sequence) <= written
    np.testing.assert_array_equal(got.force.sequence, np.arange(len(got.force.sequence)))


def test_a_failed_writer_keeps_the_file_until_the_run_lets_go(
    start: Start, make: SimpleNamespace
) -> None:
    recorder = start()
    size = recorder.part_path.stat().st_size
    resource.prlimit(recorder._process.pid, resource.RLIMIT_FSIZE, (size, size))
    recorder.force(make.force(0))
    until(lambda: recorder._shared.counters[0] == State.FAILED)
    recorder._file_fd, held = os.open(os.devnull, os.O_RDONLY), recorder._file_fd
    os.close(held)  # the run's own hold on the file; the writer's is left
    for _ in range(20):
        assert recorder._process.poll() is None
        time.sleep(0.005)
    assert is_being_written(recorder.part_path)


def test_abandoned_records_are_found_and_repaired(
    start: Start, make: SimpleNamespace, tmp_path: Path
) -> None:
    recorder = start()
    fill(recorder, make, 100)
    assert is_being_written(recorder.part_path)
    assert find_unfinished(tmp_path) == []
    with pytest.raises(BadInputError, match="being written"):
        recover(recorder.part_path)
    recorder.abandon()
    assert recorder.problem() == ""
    assert find_unfinished(tmp_path) == [recorder.part_path]
    recovered = recover(recorder.part_path)
    assert recovered.counts["/force"] == 100
    assert find_unfinished(tmp_path) == []
    got = read_recording(recovered.path)
    assert got.partial
    assert got.outcome["verdict"] == "interrupted"


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value_s in (("SILENT_S", 0.05), ("STALLED_S", 0.2), ("KILL_S", 0.1)):
        monkeypatch.setattr(recorder_module, name, value_s)


def rescued(recorder: Recorder, place: Path) -> Any:
    place.mkdir()
    found = recorder.rescue([place / "not there", place])
    assert found is not None
    assert found.path == place / "run.mcap"
    return read_recording(found.path)


@pytest.mark.parametrize("readable", [True, False])
@pytest.mark.usefixtures("impatient")
def test_a_writer_that_stands_still_is_told_of_and_loses_nothing_in_memory(
    start: Start, make: SimpleNamespace, tmp_path: Path, readable: bool
) -> None:
    recorder = start(lossless=False)
    fill(recorder, make, 200)
    recorder.event(100.0, "touch", {})
    recorder.sync()
    os.kill(recorder._process.pid, signal.SIGSTOP)
    for i in range(200, 300):
        recorder.force(make.force(i))
    until(lambda: bool(recorder.said))
    time.sleep(0.5)
    assert not recorder.problem()  # however long: there is room for what comes
    for i in range(300, 500):
        recorder.force(make.force(i))
    recorder.event(100.3, "trip", {})
    until(lambda: bool(recorder.problem()))
    assert str(recorder._process.pid) in recorder.problem()
    assert sum("kill -CONT" in line for line in recorder.said) == 1
    if not readable:
        os.truncate(recorder.part_path, 0)
    begun_s = time.monotonic()
    got = rescued(recorder, tmp_path / "elsewhere")
    assert time.monotonic() - begun_s < 5.0
    assert got.force.sequence.tolist() == list(range(0 if readable else 200, 500))
    assert [event.kind for event in got.events] == ["touch", "trip"][not readable :]
    assert got.metadata["run_id"] == "r1"
    assert got.attachments["plan.yaml"] == b"payload: {}\n"
    assert len(got.ticks.time_s) == (100 if readable else 0)


def test_a_dry_run_does_not_wait_for_ever(
    start: Start, make: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = start({**RATES_HZ, "force": 60.0})
    monkeypatch.setattr(recorder_module, "SILENT_S", 0.1)
    monkeypatch.setattr(recorder_module, "KILL_S", 0.1)
    monkeypatch.setattr(recorder_module.Recorder._wait, "__defaults__", (0.5,))
    os.kill(recorder._process.pid, signal.SIGSTOP)
    for i in range(recorder._shared.capacity["force"] + 1):
        recorder.force(make.force(i))
    assert str(recorder._process.pid) in recorder.problem()
    assert sum("kill -CONT" in line for line in recorder.said) == 1


def test_a_record_that_loses_its_name_is_a_problem_at_once_and_is_rescued_whole(
    start: Start, make: SimpleNamespace, tmp_path: Path
) -> None:
    recorder = start()
    fill(recorder, make, 200)
    recorder.part_path.unlink()
    until(lambda: bool(recorder.problem()))
    assert str(recorder.part_path) in recorder.problem()
    for i in range(200, 300):
        recorder.force(make.force(i))
    got = rescued(recorder, tmp_path / "elsewhere")
    assert got.force.sequence.tolist() == list(range(300))
    assert not got.damage


def test_what_the_file_has_already_is_not_rescued_twice(
    start: Start, make: SimpleNamespace, tmp_path: Path
) -> None:
    """The writer was killed between the end of a write and the count of it."""
    recorder = start()
    fill(recorder, make, 200)
    recorder.event(100.0, "touch", {})
    recorder.sync()
    dead(recorder)
    shared = recorder._shared
    for name, count in (("force", 30), ("tick", 15), ("events", 1)):
        shared.counters[shared._counter(name, 10)] -= count
        tail = shared._counter(name, 8)
        shared.counters[tail] = 0 if name == "events" else shared.counters[tail] - count
    recorder.force(make.force(200))
    got = rescued(recorder, tmp_path / "elsewhere")
    assert got.force.sequence.tolist() == list(range(201))
    assert len(got.ticks.time_s) == 100
    assert [event.kind for event in got.events] == ["touch"]


def until(condition: Callable[[], bool]) -> None:
    give_up_at = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < give_up_at
        time.sleep(0.005)
