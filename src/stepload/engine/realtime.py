"""Keeps disturbances away from the loop: garbage collection, other programs, paging."""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

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
