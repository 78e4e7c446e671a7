"""What watching costs the loop, in CPU and p99.9 of its lateness: without a live view, with one,
with a viewer, and with the page of `stepload ui`.

python bench/live.py [--seconds S]

A loop of 1 kHz records force, arm and ticks as a run does; the view reads the record as it grows.
They take turns; every figure is of the same minutes on the same machine.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import record
from record import RATES_HZ, lateness_s

import stepload
from stepload.live.view import address_of, live_view
from stepload.record.reader import Recording, read_recording
from stepload.record.recorder import Recorder
from stepload.rig.clock import MonotonicClock

ROUNDS = 3
Cost = tuple[float, float]
"""p99.9 of the lateness, and CPU of the loop's process, in s."""
READER = """
import sys, urllib.request
for line in urllib.request.urlopen(sys.argv[1]):
    pass
"""
VIEWER = """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"], max_size=None) as viewer:
    print("connected", flush=True)
    for message in viewer:
        if isinstance(message, str) and json.loads(message)["op"] == "advertise":
            ask = [{"id": c["id"], "channelId": c["id"]} for c in json.loads(message)["channels"]]
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": ask}))
"""


def late(directory: Path, seconds: float, follow: Callable[[Path], None], whole: Recording) -> Cost:
    """p99.9 of the lateness of a recording loop whose record `follow` is told of, and its CPU.

    The record begins as `whole` does, so that the view works out margins and deformation too.
    """
    plain = record.start

    def start(where: Path, rates_hz: dict[str, float]) -> Recorder:
        made = Recorder(
            where, rates_hz=rates_hz, clock=MonotonicClock(), metadata=whole.metadata,
            attachments=whole.attachments, lossless=False,
        )  # fmt: skip
        follow(made.part_path)
        return made

    record.start = start
    began_s = time.process_time()
    try:
        found_s = lateness_s(directory, seconds)
        return found_s, time.process_time() - began_s
    finally:
        record.start = plain


def viewed(directory: Path, seconds: float, whole: Recording, *, connected: bool) -> Cost:
    """The same with a live view, and with a viewer that takes everything."""
    with ExitStack() as stack:
        view = stack.enter_context(live_view(address_of("127.0.0.1:0")))
        if connected:
            words = [sys.executable, "-c", VIEWER, view.address.url]
            viewer = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
            stack.callback(viewer.wait)
            stack.callback(viewer.kill)
            assert viewer.stdout is not None
            assert viewer.stdout.readline() == "connected\n"
        return late(directory, seconds, view.follow, whole)


def paged(directory: Path, seconds: float, whole: Recording) -> Cost:
    """The same with the page of `stepload ui` open at the run."""
    with ExitStack() as stack:

        def start(*words: str) -> subprocess.Popen[str]:
            pipe, nowhere = subprocess.PIPE, subprocess.DEVNULL
            words = (sys.executable, *words)
            process = subprocess.Popen(words, stdout=pipe, stderr=nowhere, text=True)
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        words = ["ui", str(directory.parent), "--port", "0", "--json"]
        server = start("-m", "stepload", *words)
        assert server.stdout is not None
        url = json.loads(server.stdout.readline())["url"].partition("/#")[0]

        def follow(path: Path) -> None:
            start("-c", READER, f"{url}/api/live?run={directory.name}")

        return late(directory, seconds, follow, whole)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=20.0)
    seconds = parser.parse_args().seconds
    found: dict[str, list[Cost]] = {
        "without": [],
        "a view": [],
        "a view and a viewer": [],
        "the page": [],
    }
    with tempfile.TemporaryDirectory() as name:
        plan = Path(__file__).parents[1] / "procedures" / "plastic-sphere.yaml"
        run = stepload.run(stepload.load_plan(plan), dry_run=True, out=Path(name) / "run")
        whole = read_recording(run.path)
        for turn in range(ROUNDS):
            place = Path(name) / str(turn)
            place.mkdir()
            found["without"].append(late(place / "a", seconds, lambda path: None, whole))
            found["a view"].append(viewed(place / "b", seconds, whole, connected=False))
            found["a view and a viewer"].append(viewed(place / "c", seconds, whole, connected=True))
            found["the page"].append(paged(place / "d", seconds, whole))
    rates = ", ".join(f"{name} {rate:g} Hz" for name, rate in RATES_HZ.items())
    print(f"{rates}, median of {ROUNDS} rounds of {seconds:g} s")
    base_s = [statistics.median(column) for column in zip(*found["without"], strict=True)]
    for name, values in found.items():
        late_s, cpu_s = zip(*values, strict=True)
        p999, cpu = (statistics.median(column) for column in (late_s, cpu_s))
        print(
            f"{name:20} CPU {cpu / seconds:6.2%} {cpu / base_s[1]:5.2f} times"
            f"  late {p999 * 1e6:8.0f} us  {p999 / base_s[0]:5.2f} times"
            f"  ({min(late_s) * 1e6:.0f} to {max(late_s) * 1e6:.0f})"
        )


if __name__ == "__main__":
    main()
