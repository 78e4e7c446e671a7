"""Leaks fail the test that made them: threads, child processes, sockets and other open files."""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

pytest_plugins = ["pytester", "realtime"]

GRACE_S = 3.0

# The same examples every time, so that a test fails because of a change and not by chance;
# `make fuzz` looks at others.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=25)
settings.register_profile("explore", deadline=None, max_examples=300)
settings.load_profile("repeatable")


CLOCK = ("tests/wire/", "tests/contract/")
"""Where tests against the wall clock stand: `make realtime` looks nowhere else."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.get_closest_marker("realtime") and not item.nodeid.startswith(CLOCK):
            raise pytest.UsageError(f"{item.nodeid} is realtime, and not in {' or '.join(CLOCK)}")


def _children() -> set[int]:
    """Pids of this process's children that are not multiprocessing's own resource tracker."""
    found = set()
    for task in Path("/proc/self/task").iterdir():
        try:
            pids = (task / "children").read_text().split()
        except OSError:
            continue
        for pid in pids:
            try:
                command = Path(f"/proc/{pid}/cmdline").read_bytes()
            except OSError:
                continue
            if b"resource_tracker" not in command and b"forkserver" not in command:
                found.add(int(pid))
    return found


def _endpoints() -> set[str]:
    """Open sockets and terminals of this process."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        try:
            target = os.readlink(entry)
        except OSError:
            continue
        if target.startswith(("socket:", "/dev/pts/", "/dev/ptmx")):
            found.add(f"{entry.name} {target}")
    return found


@pytest.fixture(autouse=True, scope="module")
def _only_new_garbage() -> None:
    """Take what there is at the start of a file out of the garbage collections of its tests.

    Modules and collected tests stay and are several hundred thousand objects. A full collection
    walks all that is not frozen, and each run begins with one.
    """
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _no_leaks() -> Iterator[None]:
    threads, children, endpoints = set(threading.enumerate()), _children(), _endpoints()
    yield
    give_up_at = time.monotonic() + GRACE_S
    while True:
        left = [t.name for t in threading.enumerate() if t not in threads and t.is_alive()]
        orphans = _children() - children
        if endpoints_left := _endpoints() - endpoints:
            gc.collect()
            endpoints_left = _endpoints() - endpoints
        if not (left or orphans or endpoints_left) or time.monotonic() > give_up_at:
            break
        time.sleep(0.02)
    assert not left, f"threads left running: {left}"
    assert not orphans, f"child processes left running: {sorted(orphans)}"
    assert not endpoints_left, f"sockets or terminals left open: {sorted(endpoints_left)}"
