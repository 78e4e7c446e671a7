"""What watching costs the loop: p99.9 of its lateness without a live view, with one, with a viewer,
and with the page of `stepload ui`.

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


def late(
    directory: Path, seconds: float, follow: Callable[[Path], None], whole: Recording
) -> float:
    """p99.9 of the lateness of a recording loop whose record `follow` is told of.

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
    try:
        return lateness_s(directory, seconds)
    finally:
        record.start = plain


def viewed(directory: Path, seconds: float, whole: Recording, *, connected: bool) -> float:
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


def paged(directory: Path, seconds: float, whole: Recording) -> float:
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
    found: dict[str, list[float]] = {
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
    base = statistics.median(found["without"])
    rates = ", ".join(f"{name} {rate:g} Hz" for name, rate in RATES_HZ.items())
    print(f"p99.9 of the loop's lateness, {rates}, median of {ROUNDS} rounds of {seconds:g} s")
    for name, values in found.items():
        value = statistics.median(values)
        print(
            f"{name:20} {value * 1e6:8.0f} us  {value / base:5.2f} times"
            f"  ({min(values) * 1e6:.0f} to {max(values) * 1e6:.0f})"
        )


if __name__ == "__main__":
    main()
