"""What a person may ask of a run: stop, more urgently each time, and pause."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from types import FrameType


class StopLevel(IntEnum):
    """How urgently to stop. No level skips the retract."""

    NONE = 0
    AFTER_STEP = 1
    """Finish the step, unload, end."""
    NOW = 2
    """Retract now, then make everything safe."""
    ARM_ONLY = 3
    """Retract now and skip everything else."""


class Operator:
    """Requests of the operator, polled by the loop; signals only set numbers here."""

    __slots__ = ("paused", "signal_number", "stop_level")

    def __init__(self) -> None:
        self.stop_level = 0
        self.paused = False
        self.signal_number = 0

    def request_stop(self, level: StopLevel) -> None:
        """Ask for at least this level; it never goes back."""
        self.stop_level = max(self.stop_level, int(level))

    def press(self) -> None:
        """One more Ctrl+C."""
        self.stop_level = min(self.stop_level + 1, int(StopLevel.ARM_ONLY))

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Ctrl+C, SIGTERM and SIGHUP come here instead of ending the process.

        Only in the main thread; the former handlers return at the end.
        """
        names = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        former = {number: signal.signal(number, self._on_signal) for number in names}
        try:
            yield
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self.signal_number = self.signal_number or number
        if number == signal.SIGINT:
            self.press()
        else:
            self.request_stop(StopLevel.NOW)
