"""Output of a run in a thread of its own, so that a blocked terminal does not block the run."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from stepload.cli.seen import Seen

Show = Callable[[Seen | str], None]


@contextmanager
def pen(show: Show) -> Iterator[Show]:
    """Provides a function that queues a line or a look and returns at once.

    Every line is shown, in order; of waiting looks only the newest is. A closed terminal or pipe
    ends the output and nothing else. The end of the block waits until all is shown.
    """
    waiting: queue.SimpleQueue[Seen | str | None] = queue.SimpleQueue()
    thread = threading.Thread(target=_work, args=(waiting, show), name="pen", daemon=True)
    thread.start()
    try:
        yield waiting.put
    finally:
        waiting.put(None)
        thread.join()


def _work(waiting: queue.SimpleQueue[Seen | str | None], show: Show) -> None:
    gone = False
    while (item := waiting.get()) is not None:
        if gone or (isinstance(item, Seen) and not waiting.empty()):
            continue
        try:
            show(item)
        except (OSError, ValueError):  # closed
            gone = True
