"""Requests of the operator to a run: stop, with rising urgency, and pause."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from types import FrameType
from typing import Any

from stepload.errors import LeftEarlyError


class StopLevel(IntEnum):
    """How urgently to stop. No level skips the retract."""

    NONE = 0
    AFTER_STEP = 1
    """Finish the step, unload, end."""
    NOW = 2
    """Retract now, then make everything safe."""
    ARM_ONLY = 3
    """Retract now and skip everything else."""


STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
SUSPENDING = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)
"""Signals that are ignored during a run: one that is suspended would keep the force on."""


class Operator:
    """Requests of the operator, polled by the loop; signals only set numbers here.

    `moving` says that the devices are open and the run has begun. Before it a stop ends the
    process like any other, so that a device that hangs while it opens can be left. `on_lost` is
    called before the process ends without unwinding: it gives the terminal back. `signals` counts
    the signals that asked for the end.
    """

    def __init__(self) -> None:
        self.stop_level = 0
        self.paused = False
        self.signal_number = 0
        self.signals = 0
        self.moving = False
        self.on_lost: Callable[[], None] = lambda: None

    def request_stop(self, level: StopLevel) -> None:
        """Ask for at least this level; it never goes back."""
        self.stop_level = max(self.stop_level, int(level))

    def press(self) -> None:
        """One more Ctrl+C."""
        self.stop_level = min(self.stop_level + 1, int(StopLevel.ARM_ONLY))

    def unload(self) -> None:
        """As one Ctrl+C; nothing where a stop was requested already."""
        if not self.stop_level:
            self._on_signal(signal.SIGINT, None)

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Ctrl+C, SIGTERM, SIGHUP and SIGQUIT come here instead of ending the process.

        Only in the main thread; the former handlers return at the end.

        Raises:
            LeftEarlyError: one came before `moving`.
        """
        former: dict[signal.Signals, Any] = {n: signal.signal(n, self._on_signal) for n in STOPPING}
        former |= {n: signal.signal(n, signal.SIG_IGN) for n in SUSPENDING}
        try:
            yield
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        if not self.moving:
            raise LeftEarlyError(number)
        self.signal_number = self.signal_number or number
        self.signals += 1
        if number == signal.SIGINT:
            self.press()
        else:
            self.request_stop(StopLevel.NOW)
