"""Makes hostile records: an honest run, well-formed to the last checksum, with poison in it.

Random bytes rarely come past a checksum; here the poison stands where only the reader's own checks
can find it: in numbers, events, metadata and attachments.
"""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepload.record.container import Appender
from stepload.record.reader import read_recording
from stepload.record.ring import Shared, capacities
from stepload.record.rows import TickRow, rows_of
from stepload.record.writer_process import Writer
from stepload.rig.samples import ArmSample, ForceSample

Choose = Callable[[int], int]
"""Gives a whole number from 0 to n - 1."""

NUMBERS: list[float] = [
    float("nan"), float("inf"), float("-inf"), 0.0, -0.0, -1.0, 5e-324, 1e-30, 1e30, 1e308, -1e308,
    2.0**31, -(2.0**31), 2.0**63 - 1024, -(2.0**63), 0.5,
]  # fmt: skip
VALUES: list[Any] = [
    *NUMBERS, None, True, "", "nan", "\x1b[2J\x07", "../../../etc/passwd", "\x00", "a" * 5000,
    "\u202e\ud7ff", [], {}, [[[[]]]], {"a": {"b": []}}, 10**400, [1, 2, 3], "+fz", "1",
]  # fmt: skip
NAMES = ["../../escape", "/etc/escape", "a\x1b[31mb", "\x00", "", "." * 300, "results.json"]


@dataclass
class Record:
    """Everything of a run, to be changed."""

    force: list[ForceSample]
    second: list[ForceSample]
    arm: list[ArmSample]
    ticks: list[Any]
    events: list[dict[str, Any]]
    metadata: dict[str, str]
    attachments: dict[str, bytes]
    rate_hz: float


def load(path: Path, keep_every: int) -> Record:
    """An honest record, thinned out so that it is quickly read."""
    found = read_recording(path)
    return Record(
        force=rows_of(ForceSample, found.force)[::keep_every],
        second=rows_of(ForceSample, found.second_force)[::keep_every],
        arm=rows_of(ArmSample, found.arm)[::keep_every],
        ticks=rows_of(TickRow, found.ticks)[::keep_every],
        events=[{"time_s": e.time_s, "kind": e.kind, "data": dict(e.data)} for e in found.events],
        metadata=dict(found.metadata),
        attachments=dict(found.attachments),
        rate_hz=1000.0 / keep_every,
    )


def _paths(tree: Any) -> list[tuple[Any, Any]]:
    """(container, key) of every place in a tree of JSON."""
    found: list[tuple[Any, Any]] = []
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items:
        found.append((tree, key))
        if isinstance(value, dict | list):
            found += _paths(value)
    return found


def _spoil_tree(tree: Any, choose: Choose) -> None:
    places = _paths(tree)
    if not places:
        return
    place, key = places[choose(len(places))]
    if choose(6) == 0:
        del place[key]
    else:
        place[key] = copy.deepcopy(VALUES[choose(len(VALUES))])


def _spoil_rows(rows: list[Any], choose: Choose) -> None:
    if not rows:
        return
    what = choose(8)
    if what == 0:
        del rows[choose(len(rows)) :]
        return
    if what == 1:
        rows.reverse()
        return
    begin = choose(len(rows))
    end = min(len(rows), begin + (1, 2, 50, len(rows))[choose(4)])
    name = rows[0]._fields[choose(len(rows[0]._fields))]
    for i in range(begin, end):
        old = getattr(rows[i], name)
        rows[i] = rows[i]._replace(**{name: _number_like(old, NUMBERS[choose(len(NUMBERS))])})


def _number_like(old: Any, new: float) -> Any:
    if isinstance(old, tuple):
        return (new,) * len(old)
    if isinstance(old, int):
        return 0 if new != new else int(max(min(new, 2.0**63 - 1024), -(2.0**63)))
    return new


def spoil(record: Record, choose: Choose) -> Record:
    """A changed copy; the same choices give the same copy."""
    bad = copy.deepcopy(record)
    for _ in range(1 + choose(3)):
        what = choose(8)
        if what < 2:
            names = [n for n in bad.attachments if n.endswith(".json")]
            if not names:
                continue
            name = names[choose(len(names))]
            try:
                tree = json.loads(bad.attachments[name])
                _spoil_tree(tree, choose)
                bad.attachments[name] = json.dumps(tree).encode()
            except (ValueError, AttributeError):
                bad.attachments[name] = b"[" * choose(100_000)
        elif what == 2:
            name = NAMES[choose(len(NAMES))]
            bad.attachments[name] = b"{}" if choose(2) else b"\xff" * choose(1000)
        elif what == 3:
            keys = [*bad.metadata, *NAMES]
            bad.metadata[keys[choose(len(keys))]] = str(VALUES[choose(len(VALUES) - 5)])
        elif what == 4:
            _spoil_tree(bad.events, choose)
        else:
            _spoil_rows([bad.force, bad.arm, bad.ticks][what - 5], choose)
    return bad


def write(record: Record, path: Path) -> Path:
    """Write a record as the writer process does, with right checksums and indexes."""
    rates_hz = dict.fromkeys(("force", "second_force", "arm", "tick"), record.rate_hz)
    if not record.second:
        del rates_hz["second_force"]
    shared, memory_fd = Shared.create(capacities(dict.fromkeys(rates_hz, 8000.0)))
    os.close(memory_fd)
    with path.open("wb") as file:
        out = Appender(file.fileno())
        out.start()
        out.add_metadata("run", record.metadata)
        for name, data in record.attachments.items():
            if name != "results.json":
                out.add_attachment(name, data, 0)
        writer = Writer(out, shared, 0)
        rows = {
            "force": record.force, "second_force": record.second, "arm": record.arm,
            "tick": record.ticks,
        }  # fmt: skip
        for name in rates_hz:
            push = shared.producer(name, lambda _: False)
            for row in rows[name]:
                push(row)
        push_event = shared.event_producer(lambda _: False)
        for event in record.events:
            push_event(0.0, json.dumps(event).encode()[:60_000])
        with np.errstate(all="ignore"):
            writer.drain()
        writer.finish("completed", record.attachments.get("results.json", b"{}"))
        del push, push_event
    shared.close()
    return path
