"""Ctrl+C into work that may take it for something else."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interruptible(*, at_once: bool = True) -> Iterator[None]:
    """Ctrl+C ends the block with KeyboardInterrupt, however the block itself ends.

    A simulated run takes it for a fault and ends safely: its result is that of no run. With
    `at_once` False the block is done to its end before.
    """
    came = False
    former = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(former):
        yield
        return

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal came
        came = True
        if at_once:
            former(number, frame)

    try:
        signal.signal(signal.SIGINT, note)
        yield
    finally:
        signal.signal(signal.SIGINT, former)
        if came:
            raise KeyboardInterrupt
