"""Prints what foreign readers find in a record, topic by topic, beside what ours finds.

python -m stepload_verify.trials.readers.table RECORD [--node DIRECTORY]

A cell holds the number of messages; `=` says that every number in them is bit for bit ours. For
Foxglove's libraries DIRECTORY must hold node_modules with @mcap/core, @mcap/nodejs, @mcap/support,
@foxglove/rosmsg and @foxglove/rosmsg2-serialization.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from stepload.record.layout import STREAMS
from stepload.record.reader import read_recording

Found = dict[str, tuple[int, str]]
"""Messages of each topic, and a checksum of all their numbers in their order."""


def numbers(message: Any) -> Iterator[float]:
    """Every number of a message but those of its header, in the order of its definition."""
    if isinstance(message, bool | int | float | np.number):
        yield float(message)
    elif isinstance(message, list | tuple | np.ndarray):
        for each in message:
            yield from numbers(each)
    elif not isinstance(message, str | bytes):
        for name in getattr(message, "__slots__", None) or vars(message):
            if name not in ("header", "__msgtype__", "_type", "_full_text"):
                yield from numbers(getattr(message, name))


class Sums:
    """Counts messages and sums up their numbers."""

    def __init__(self) -> None:
        self._sums: dict[str, Any] = {}
        self._counts: dict[str, int] = {}

    def add(self, topic: str, message: Any) -> None:
        """Add one message."""
        self._counts[topic] = self._counts.get(topic, 0) + 1
        told = np.fromiter(numbers(message), np.float64)
        self._sums.setdefault(topic, hashlib.sha256()).update(told.tobytes())

    @property
    def found(self) -> Found:
        """Count and checksum of each topic so far."""
        return {t: (self._counts[t], self._sums[t].hexdigest()[:16]) for t in self._counts}


def ours(record: Path) -> Found:
    """What our own reader finds."""
    recording, found = read_recording(record), {}
    streams = {
        "force": recording.force, "second_force": recording.second_force, "arm": recording.arm,
        "displacement": recording.displacement, "tick": recording.ticks,
    }  # fmt: skip
    for name, columns in streams.items():
        if columns is None:
            continue
        for topic in STREAMS[name].topics:
            parts = [np.asarray(getattr(columns, field), np.float64) for field in topic.fields]
            rows = np.column_stack(parts)
            found[topic.name] = len(rows), hashlib.sha256(rows.tobytes()).hexdigest()[:16]
    found["/events"] = len(recording.events), hashlib.sha256().hexdigest()[:16]
    return found


def by_mcap(record: Path) -> Found:
    """mcap with mcap-ros2-support."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    sums = Sums()
    with record.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            sums.add(channel.topic, message)
    return sums.found


def by_rosbags(record: Path) -> Found:
    """rosbags, which reads ROS 2 bags without ROS."""
    from rosbags.highlevel import AnyReader

    sums = Sums()
    with AnyReader([record]) as bag:
        for connection, _, raw in bag.messages():
            sums.add(connection.topic, bag.deserialize(raw, connection.msgtype))
    return sums.found


def by_foxglove(record: Path, node: Path) -> Found:
    """Foxglove's own Node libraries."""
    script = resources.files("stepload_verify.trials.readers") / "foxglove.mjs"
    program = shutil.which("node") or "node"
    done = subprocess.run(
        [program, str(script), str(record.absolute())],
        cwd=node, capture_output=True, text=True, check=True,
    )  # fmt: skip
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    return {topic: (count, total) for topic, count, total in rows}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("record", type=Path)
    parser.add_argument("--node", type=Path)
    wanted = parser.parse_args()
    readers: dict[str, Callable[[], Found]] = {
        "mcap + mcap-ros2-support": lambda: by_mcap(wanted.record),
        "rosbags": lambda: by_rosbags(wanted.record),
    }
    if wanted.node:
        readers["Foxglove's Node libraries"] = lambda: by_foxglove(wanted.record, wanted.node)
    expected, found = ours(wanted.record), {}
    for name, read in readers.items():
        try:
            found[name] = read()
        except Exception as error:
            print(f"{name}: {type(error).__name__}: {error}")
    print("| topic | ours | " + " | ".join(found) + " |")
    print("|---|---|" + "---|" * len(found))
    for topic, (count, total) in sorted(expected.items()):
        cells = []
        for told in found.values():
            number, other = told.get(topic, (0, ""))
            cells.append(f"{number} {'=' if (number, other) == (count, total) else 'DIFFERS'}")
        print(f"| `{topic}` | {count} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
