"""Conditions of the loop: no disturbance by the host, and a watch that it still runs.

A driver that does not return from `drain` or `command` blocks the loop, and with it the supervisor
and the operator's keys. Then a separate thread makes the rig safe, the arm first; after that a
signal interrupts the call that the main thread waits in. Where even that does not help (a call that
never returns to Python) the process ends: the record's writer lives on and closes the record.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

REALTIME_PRIORITY = 20


@contextmanager
def realtime_conditions(virtual: bool) -> Iterator[None]:
    """No garbage collection in the loop; in real time also priority and locked memory if allowed.

    Without the rights for them the loop runs all the same; its lateness shows the effect.
    """
    was_enabled = gc.isenabled()
    if not virtual:
        gc.collect()
    gc.disable()
    former = None
    if not virtual:
        with suppress(OSError, PermissionError):
            former = (os.sched_getscheduler(0), os.sched_getparam(0))
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REALTIME_PRIORITY))
        with suppress(OSError):
            ctypes.CDLL(None, use_errno=True).mlockall(1)
    try:
        yield
    finally:
        if former is not None:
            with suppress(OSError):
                os.sched_setscheduler(0, *former)
        if not virtual:
            with suppress(OSError):
                ctypes.CDLL(None, use_errno=True).munlockall()
        if was_enabled:
            gc.enable()


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
