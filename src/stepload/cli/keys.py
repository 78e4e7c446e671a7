"""Keys pressed in the terminal of a run: `p` pauses and resumes it."""

from __future__ import annotations

import os
import select
import sys
import termios
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from stepload.engine.operator import Operator

PAUSES = "p: the run pauses after this step, unloaded; p again goes on"
GOES_ON = "p: the run goes on"


def _is_ours(fd: int) -> bool:
    """Whether this process is in the foreground of the terminal that is its standard input."""
    try:
        return os.isatty(fd) and os.tcgetpgrp(fd) == os.getpgrp()
    except OSError:
        return False


@contextmanager
def keys(operator: Operator, say: Callable[[str], None]) -> Iterator[None]:
    """Read single keys if standard input is a terminal; its modes are restored at the end.

    Ctrl+C remains a signal. The effect of a key is reported at once, by `say`.
    """
    try:
        fd = sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):
        fd = -1
    if fd < 0 or not _is_ours(fd):
        yield
        return
    former = termios.tcgetattr(fd)
    modes = termios.tcgetattr(fd)
    modes[3] &= ~(termios.ICANON | termios.ECHO)

    def restore() -> None:
        with suppress(termios.error):  # a terminal that is gone needs nothing back
            termios.tcsetattr(fd, termios.TCSADRAIN, former)

    over, wake = os.pipe()
    thread = threading.Thread(
        target=_listen, args=(fd, over, operator, say), name="keys", daemon=True
    )
    operator.on_lost = restore
    try:
        termios.tcsetattr(fd, termios.TCSADRAIN, modes)
        thread.start()
        yield
    finally:
        os.close(wake)
        thread.join()
        os.close(over)
        restore()


def _listen(fd: int, over: int, operator: Operator, say: Callable[[str], None]) -> None:
    while True:
        ready, _, _ = select.select([fd, over], [], [])
        if over in ready:
            return
        try:
            pressed = os.read(fd, 64)
        except OSError:
            return
        if not pressed:  # the terminal was closed
            return
        if pressed.count(b"p") % 2:
            operator.paused = not operator.paused
            with suppress(Exception):  # a terminal that is gone
                say(PAUSES if operator.paused else GOES_ON)
