"""Runs an emulator for the command line: signals end it, standard input switches faults."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable

from stepload.errors import BadInputError
from stepload_verify.emulators.faults import FaultBoard, parse_fault

HELP = "a fault (NAME[:MAGNITUDE][@START][+DURATION]), `clear`, `quit`"


def obey(board: FaultBoard, line: str) -> str:
    """Carry out one line of standard input; returns the reply."""
    text = line.strip()
    if text == "clear":
        board.clear()
        return "ok"
    try:
        board.add(parse_fault(text))
    except BadInputError as error:
        return f"error: {error.message} ({HELP})"
    return "ok"


def serve(
    board: FaultBoard, greeting: list[str], report: Callable[[str], None], *, until_eof: bool
) -> None:
    """Return after SIGINT, SIGTERM, `quit`, or (`until_eof`) the end of standard input.

    `greeting` is reported once all of these work.
    """
    done = threading.Event()

    def listen() -> None:
        for line in sys.stdin:
            if line.strip() == "quit":
                break
            if line.strip():
                report(obey(board, line))
        else:
            if not until_eof:
                return
        done.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: done.set())
    threading.Thread(target=listen, name="standard input", daemon=True).start()
    for line in greeting:
        report(line)
    while not done.wait(1.0):
        pass
