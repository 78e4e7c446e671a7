"""What viewers and the terminal are shown of a run, from a record that grows."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap_ros2.decoder import DecoderFactory
from real_runs import in_process
from websockets.sync.client import connect

import stepload
from stepload.engine.rules import RULES
from stepload.errors import BadInputError
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.remaining import Remaining
from stepload.live.messages import POSE, TARED, pose_message, quaternion, wrench_message
from stepload.live.state import State
from stepload.live.tail import Tail
from stepload.live.view import address_of, live_view
from stepload.record.reader import read_recording
from stepload.record.rows import Phase, TickRow, rows_of


class Growing:
    """A file that grows as a record does while it is written."""

    def __init__(self, record: Path, path: Path) -> None:
        self._data = record.read_bytes()
        self._at = 0
        self.path = path
        path.touch()

    def grow(self, size: int) -> bool:
        """Some bytes more; False at the end."""
        with self.path.open("ab") as file:
            file.write(self._data[self._at : self._at + size])
        self._at += size
        return self._at < len(self._data)


@pytest.mark.parametrize("size", [1777, 100_003, 1 << 30])
def test_a_growing_record_is_read_once_and_whole(
    quick_run: Path, tmp_path: Path, size: int
) -> None:
    growing = Growing(quick_run / "run.mcap", tmp_path / "run.mcap.part")
    tail, ticks, force, events, going = Tail(growing.path), [], [], [], True
    while going:
        going = growing.grow(size)
        tail.read()
        rows = tail.rows()
        ticks.append(rows[0].time_s)
        force.append(rows[1].wrench)
        events += tail.events()[1]
    tail.close()
    whole = read_recording(quick_run / "run.mcap")
    assert tail.ended
    assert np.array_equal(np.concatenate(ticks), whole.ticks.time_s)
    assert np.array_equal(np.concatenate(force), whole.force.wrench)
    assert tuple(events) == whole.events
    assert tail.metadata == whole.metadata


PARTS = 8
"""Into so many the ticks of a chunk are cut: whole ones would miss phases by chance."""


def in_parts(ticks: Any) -> Iterator[Any]:
    """The ticks of a chunk, one part of its time after the other."""
    time_s = ticks.time_s
    cuts = [0, *(len(time_s) * part // PARTS for part in range(1, PARTS)), len(time_s)]
    for low, high in pairwise(cuts):
        yield type(ticks)(*(each[low:high] for each in ticks))


def up_to(held: list[Any], until_s: float) -> Any:
    """The samples of a stream received until then, taken out of those that are held; or None."""
    if not held:
        return None
    whole = type(held[0])(*(np.concatenate(each) for each in zip(*held, strict=True)))
    cut = int(np.searchsorted(whole.receive_time_s, until_s, side="right"))
    held[:] = [type(whole)(*(each[cut:] for each in whole))]
    return type(whole)(*(each[:cut] for each in whole))


@pytest.fixture(scope="module")
def looks(cycles_run: Path, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """What viewers are told of a run, look by look, with the tick each was told of."""
    growing = Growing(cycles_run / "run.mcap", tmp_path_factory.mktemp("live") / "run.mcap.part")
    tail, state, found, going = Tail(growing.path), None, [], True
    events: tuple[Any, ...] = ()
    waiting: list[Any] = []
    newest_s = [-np.inf] * 3
    held: list[list[Any]] = [[], [], []]

    def take(events: tuple[Any, ...], until_s: float) -> tuple[Any, ...]:
        """The ticks up to which the samples of every stream have come; the events left."""
        assert state is not None
        while waiting and not (len(waiting[0].time_s) and waiting[0].time_s[-1] > until_s):
            part = waiting.pop(0)
            end_s = part.time_s[-1] if len(part.time_s) else -np.inf
            now = tuple(event for event in events if event.time_s <= end_s)
            state.take(part, None, None, None, now, ended=False)
            events = events[len(now) :]
            if (told := state.told()) is not None:
                found.append(told | {"row": state.row, "tared": state.tared_wrench})
        return events

    while going:
        going = growing.grow(40_000)
        tail.read()
        rows, events = tail.rows(), (*events, *tail.events()[1])
        if state is None and tail.attachments.get("limits.json") and len(rows[0].time_s):
            state = State(tail.metadata, tail.attachments)
        for stream, columns in enumerate(rows[1:]):
            if columns is not None and len(columns.receive_time_s):
                newest_s[stream] = columns.receive_time_s[-1]
                held[stream].append(columns)
        if state is not None:
            waiting += in_parts(rows[0])
            until_s = (
                min((s for s in newest_s if s > -np.inf), default=-np.inf) if going else np.inf
            )
            state.take(None, *(up_to(columns, until_s) for columns in held), (), ended=False)
            events = take(events, until_s)
    assert state is not None
    state.take(None, None, None, None, events, ended=True)
    found.append(state.told() | {"row": state.row, "tared": state.tared_wrench})
    tail.close()
    return found


def test_viewers_are_told_what_the_run_decided(looks: list[dict[str, Any]]) -> None:
    assert len(looks) > 50
    for look in looks:
        row = look["row"]
        assert look["force_n"] == row.force_n
        assert look["force_limit_n"] == row.limit_n
        assert look["predicted_peak_n"] == row.predicted_peak_n
        assert look["phase"] == Phase(row.phase).name.replace("_", " ").lower()
        assert all(0.0 <= share < 1.0 for share in look["margins"].values()), look
    unstated = {"R13", "R14"}  # the plan states neither rating nor lever
    rated = {code for code, rule in RULES.items() if rule.used}
    assert {rule for look in looks for rule in look["margins"]} == rated - unstated


def test_margins_are_those_of_the_supervisor_itself(looks: list[dict[str, Any]]) -> None:
    pressed = [look for look in looks if look["phase"] == "hold"]
    assert pressed
    for look in pressed:
        share = look["predicted_peak_n"] / look["force_limit_n"]
        assert look["margins"]["R2"] == pytest.approx(
            share, rel=0.02
        )  # a sample may be of the tick before
        assert look["margins"]["R1"] > abs(look["force_n"]) / look["force_limit_n"] - 0.02


def test_our_messages_are_what_ros_reads() -> None:
    wrench, pose = (1.0, -2.0, 3.0, 0.1, 0.2, 0.3), (0.1, 0.2, 0.3, 0.0, np.pi, 0.0)
    read = []
    for topic, data in zip(
        (TARED, POSE),
        (wrench_message(5 * 10**9 + 7, wrench), pose_message(5 * 10**9 + 7, pose)),
        strict=True,
    ):
        schema: Any = type("S", (), {"encoding": "ros2msg", "name": topic.schema, "id": 1})()
        schema.data = topic.definition.encode()
        decode = DecoderFactory().decoder_for("cdr", schema)
        assert decode is not None
        read.append(decode(data))
    force, place = read
    assert (force.header.stamp.sec, force.header.stamp.nanosec) == (5, 7)
    assert (force.wrench.force.x, force.wrench.torque.z) == (1.0, 0.3)
    assert (place.header.frame_id, place.pose.position.y) == ("base", 0.2)
    assert place.pose.orientation.y == pytest.approx(1.0)
    assert quaternion((0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0, 1.0)


def test_a_viewer_that_we_did_not_write_sees_the_run(cycles_run: Path, tmp_path: Path) -> None:
    pytest.importorskip("foxglove")
    wanted = {"/live", "/force", "/force/tared", "/arm/pose", "/arm", "/tick", "/events"}
    growing = Growing(cycles_run / "run.mcap", tmp_path / "run.mcap.part")
    topics: dict[int, str] = {}
    seen: set[str] = set()

    def subscribe(viewer: Any) -> None:
        """Ask for what has not come; the SDK may not know yet of what it has just advertised."""
        ask = [{"id": each, "channelId": each} for each in topics if topics[each] not in seen]
        viewer.send(json.dumps({"op": "subscribe", "subscriptions": ask}))

    with live_view(address_of("127.0.0.1:0")) as view:
        with connect(view.address.url, subprotocols=["foxglove.sdk.v1"], max_size=None) as viewer:
            view.follow(growing.path)
            going, patience = growing.grow(400_000), 600  # a busy machine starves what is nice
            while not wanted <= seen:
                try:
                    message = viewer.recv(timeout=0.2)
                except TimeoutError:
                    patience -= not going
                    assert patience, f"{wanted - seen} never came"
                    going = growing.grow(20_000)
                    subscribe(viewer)
                    continue
                if isinstance(message, bytes):
                    seen.add(topics[struct.unpack_from("<I", message, 1)[0]])
                    continue
                told = json.loads(message)
                if told["op"] == "serverInfo":
                    assert told["capabilities"] == []  # nobody can publish, call or set
                if told["op"] == "advertise":
                    topics |= {each["id"]: each["topic"] for each in told["channels"]}
                    subscribe(viewer)
        with pytest.raises(BadInputError, match="did not start"), live_view(view.address):
            pass


def test_an_address_is_loopback_or_said_to_be_none() -> None:
    assert address_of("127.0.0.1:8765").loopback
    assert address_of("[::1]:1").url == "ws://[::1]:1"
    for wrong in (
        "8765", "host:8765", "127.0.0.1:x", "127.0.0.1:70000", "127.0.0.1", "0.0.0.0:8765",
    ):  # fmt: skip
        with pytest.raises(BadInputError, match="--live-address"):
            address_of(wrong)


def test_a_run_goes_on_when_its_viewers_process_dies(
    quick_plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("foxglove")
    started = subprocess.Popen

    class Dying(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, words: Any, **options: Any) -> None:
            if "stepload.live.server" in words:
                code = "print('ready 1', flush=True)"
                words = [sys.executable, "-c", code]
            super().__init__(words, **options)

    monkeypatch.setattr(subprocess, "Popen", Dying)
    out = tmp_path / "run"
    done = in_process("run", quick_plan, "--dry-run", "--quiet", "--live", "--out", out)
    monkeypatch.setattr(subprocess, "Popen", started)
    assert done.returncode == 0, done.stderr
    assert not read_recording(out / "run.mcap").partial


def test_the_time_that_is_left_is_told_within_a_tenth(cycles_run: Path, quick_run: Path) -> None:
    for directory in (cycles_run, quick_run):
        run = stepload.open(directory)
        preflight = preflight_of(run.plan)
        remaining = Remaining(preflight.stages, preflight.plan.procedure)
        recording = read_recording(run.path)
        rows = rows_of(TickRow, recording.ticks)[::100]
        whole_s = rows[-1].time_s - rows[0].time_s
        for row in rows:
            left_s = remaining.at(row)
            assert remaining.active_s + left_s == pytest.approx(whole_s, rel=0.1)
        assert remaining.share > 0.95
