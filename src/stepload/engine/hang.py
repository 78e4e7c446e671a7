"""Watches from a separate thread whether the loop still runs, and makes the rig safe if not.

A driver that does not return from `drain` or `command` blocks the loop, and with it the supervisor
and the operator's keys. Then the rig is made safe from here, the arm first; after that a signal
interrupts the call that the main thread waits in. Where even that does not help (a call that never
returns to Python) the process ends: the record's writer lives on and closes the record.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

LOOK_S = 0.25
LOOKS = 4
"""Checks in a row without a tick that mean a hang; a host that was suspended fails only one."""
LEAVE_S = 5.0
EXIT_CODE = 4


class LoopHungError(BaseException):
    """Raised in the main thread in the middle of the call that did not return."""


def _call_back(_number: int, _frame: FrameType | None) -> None:
    raise LoopHungError


@contextmanager
def hang_watch(
    ticks: Callable[[], int], rescue: Callable[[], None], lost: Callable[[], str]
) -> Iterator[None]:
    """Watch a loop that runs in this, the main, thread.

    Args:
        ticks: a count that rises as long as the loop turns.
        rescue: makes the rig safe; called from another thread, once.
        lost: gives the error message for a main thread that cannot be interrupted.
    """
    over = threading.Event()

    def watch() -> None:
        seen, same = -1, 0
        while same < LOOKS:
            if over.wait(LOOK_S):
                return
            same = same + 1 if ticks() == seen else 0
            seen = ticks()
        rescue()
        if over.is_set():
            return
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGALRM)
        if not over.wait(LEAVE_S):
            print(f"error: {lost()}", file=sys.stderr, flush=True)
            os._exit(EXIT_CODE)

    former = signal.signal(signal.SIGALRM, _call_back)
    watcher = threading.Thread(target=watch, name="hang watch", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()
        signal.signal(signal.SIGALRM, former)
