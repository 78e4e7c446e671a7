"""The log of a command: `-v` shows it on standard error, `--log-file` keeps it for a bug report."""

from __future__ import annotations

import logging
import platform
import re
import sys
from collections.abc import Callable
from logging.handlers import QueueHandler, QueueListener
from pathlib import Path
from queue import SimpleQueue

from stepload import __version__

LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
"""Level on standard error, by the number of `-v`."""
FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
OTHERS = ("matplotlib", "PIL")
"""Libraries whose DEBUG is about fonts and images."""
SECRET = re.compile(r"(?i)((?:token|password|secret)\S*?[=: ]\s*)[^\s&]+")
"""A secret behind its name, as in `--token X` and `?token=X`."""

_log = logging.getLogger(__name__)


class Queued(QueueHandler):
    """Hands each record to another thread: a full disk or a held terminal cannot hold up the arm.
    What follows the name of a secret is left out."""

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        record = super().prepare(record)
        record.msg = record.message = SECRET.sub(r"\1***", record.msg)
        return record


def start_log(verbose: int, file: Path | None) -> Callable[[], None]:
    """Log what all modules say; the returned function writes what is left and ends it.

    Args:
        verbose: how often `-v` was given; 1 shows INFO on standard error, 2 DEBUG.
        file: takes everything from DEBUG on, after what it holds already.

    Raises:
        OSError: the file cannot be written.
    """
    shown = logging.StreamHandler(sys.stderr)
    shown.setLevel(LEVELS[min(verbose, 2)])
    handlers: list[logging.Handler] = [shown]
    if file is not None:
        handlers.append(logging.FileHandler(file, encoding="utf-8"))
    for handler in handlers:
        handler.setFormatter(logging.Formatter(FORMAT))
    queued = Queued(SimpleQueue())
    listener = QueueListener(queued.queue, *handlers, respect_handler_level=True)
    root = logging.getLogger()
    before = root.level
    root.addHandler(queued)
    root.setLevel(logging.DEBUG if file is not None else shown.level)
    for name in OTHERS:
        logging.getLogger(name).setLevel(logging.WARNING)
    listener.start()
    system = f"Python {platform.python_version()}, {platform.platform()}"
    _log.info("stepload %s, %s: %s", __version__, system, " ".join(sys.argv[1:]))

    def stop() -> None:
        root.removeHandler(queued)
        root.setLevel(before)
        listener.stop()
        for handler in handlers:
            handler.close()

    return stop
