"""Messages to the operator, printed by a separate thread so that printing cannot block the run."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
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
