"""Messages to the operator and the log, written by a separate thread so as not to block the run."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress

Say = Callable[[str], None]
"""Takes one line for the operator."""

LAST_WORDS_S = 1.0


def nothing(_text: str) -> None:
    """Say nothing."""


class Notices:
    """Passes lines on to `write` in a separate thread, in their order.

    A terminal that is held (Ctrl+S) or a pipe that nobody reads must not hold up the arm's loop.
    """

    def __init__(self, write: Say) -> None:
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._write = write
        self._thread = threading.Thread(target=self._hand_over, name="notices", daemon=True)
        self._thread.start()

    def say(self, text: str) -> None:
        """Queue a line and return at once."""
        self._lines.put(text)

    def close(self) -> None:
        """Wait up to `LAST_WORDS_S` until all lines are written; the rest is dropped."""
        self._lines.put(None)
        self._thread.join(LAST_WORDS_S)

    def _hand_over(self) -> None:
        while (text := self._lines.get()) is not None:
            with suppress(Exception):  # a terminal that is gone
                self._write(text)


class EventLog:
    """Logs the events of a run at INFO, from a separate thread; no thread if nobody listens.

    Args:
        log: where they go.
        start_s: time on the run's clock that counts as zero.
    """

    def __init__(self, log: logging.Logger, start_s: float) -> None:
        self._start_s = start_s
        self._notices = Notices(log.info) if log.isEnabledFor(logging.INFO) else None

    def add(self, time_s: float, kind: str, data: Mapping[str, object]) -> None:
        """Queue an event and return at once."""
        if self._notices is not None:
            told = ", ".join(
                f"{key} {f'{value:.6g}' if isinstance(value, float) else value}"
                for key, value in data.items()
            )
            self._notices.say(f"{time_s - self._start_s:.3f} s, {kind}: {told}")

    def close(self) -> None:
        """Wait until all events are written, at most `LAST_WORDS_S`."""
        if self._notices is not None:
            self._notices.close()
