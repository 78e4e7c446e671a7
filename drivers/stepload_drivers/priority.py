"""Real-time scheduling for time-critical threads, where the system permits it."""

from __future__ import annotations

import contextlib
import os


def prefer_this_thread() -> None:
    """First in, first out, at the lowest real-time priority; threads started later inherit it.

    A thread that waits for its turn with the interpreter held makes the run's loop wait as well.
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
