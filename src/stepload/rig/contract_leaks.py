"""What a device leaves behind: threads, child processes, sockets, terminals, device files."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path


def resources() -> set[str]:
    """Threads, child processes, sockets, terminals and devices held by this process."""
    found = {
        f"thread {thread.name} ({thread.native_id})"
        for thread in threading.enumerate()
        if thread.is_alive()
    }
    for entry in Path("/proc/self/fd").glob("*"):
        try:
            target = os.readlink(entry)
        except OSError:
            continue
        if target.startswith(("socket:", "/dev/")):
            found.add(f"open file {entry.name} -> {target}")
    for task in Path("/proc/self/task").glob("*/children"):
        try:
            found |= {f"process {pid}" for pid in task.read_text().split()}
        except OSError:
            continue
    return found


def leaks(before: set[str], grace_s: float) -> list[str]:
    """What is held now and was not `before`, once it had `grace_s` to go away."""
    give_up_s = time.monotonic() + grace_s
    while (left := resources() - before) and time.monotonic() < give_up_s:
        time.sleep(0.02)
    return sorted(left)
