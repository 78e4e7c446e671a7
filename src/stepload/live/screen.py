"""The process behind `run --watch`: reads the record as it grows and draws it in the terminal.

Drawing takes longer than a tick, so it has a process of its own. Standard input brings the path of
the record in one line, then lines that are to be shown, and its end is the end of this process.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.text import Text

from stepload.envelope.envelope import envelope_of
from stepload.envelope.remaining import Remaining
from stepload.errors import SteploadError
from stepload.live.phase_text import KEYS, clock, where
from stepload.live.plots import Plots
from stepload.live.state import State
from stepload.live.tail import Tail
from stepload.record.scan import DamageError
from stepload.results.record_evaluation import plan_of

_SHOWN = (
    OSError, DamageError, SteploadError, ValueError, LookupError, TypeError, ArithmeticError,
)  # fmt: skip
"""Exceptions that an unexpected record may raise; they end the display with a message."""
LOOK_S, DRAW_S = 0.1, 0.25
NICE = 10


class Screen:
    """Follows one record and draws it."""

    def __init__(self, path: Path) -> None:
        self._tail = Tail(path)
        self._plots = Plots()
        self._state: State | None = None
        self._remaining: Remaining | None = None
        self._head = self._foot = ""
        self._due_s = 0.0

    def close(self) -> None:
        """Close the record."""
        self._tail.close()

    def look(self) -> None:
        """Take in the new part of the record."""
        self._tail.read()
        _, events = self._tail.events()
        rows = self._tail.rows()
        self._tail.newest()
        if self._state is None:
            if not self._tail.attachments or not len(rows[0].time_s):
                return
            metadata, attachments = self._tail.metadata, self._tail.attachments
            self._state = State(metadata, attachments)
            with suppress(SteploadError):
                envelope = envelope_of(plan_of(metadata, attachments))
                self._remaining = Remaining(envelope.stages, envelope.plan.procedure)
        self._state.take(*rows, events, ended=self._tail.ended)
        told, row = self._state.told(), self._state.row
        if told is None or row is None:
            return
        self._plots.take(told, self._state.trace())
        force_n = told["force_n"] or 0.0
        self._head = f"{force_n:.2f} N of {told['force_limit_n']:.4g} N   {where(row)}"
        if self._remaining is not None:
            left_s = 0.0
            for each in self._state.taken:
                if each.time_s >= self._due_s or each is row:
                    self._due_s = each.time_s + LOOK_S
                    left_s = self._remaining.at(each)
            if not self._state.taken:
                return
            share = self._remaining.share
            self._foot = f"{share:.0%}, about {clock(left_s)} left"

    def drawn(self, columns: int, lines: int) -> RenderableType:
        """The present display as text."""
        foot = Text(f"{self._foot}   {KEYS}".strip(), style="dim", no_wrap=True)
        head = Text(self._head, style="bold", no_wrap=True, overflow="ellipsis")
        return Group(head, self._plots.drawn(columns, lines), foot)


class Lines:
    """Lines from a pipe, as they come; `ended` once its writing end is closed."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._rest = b""
        self.ended = False

    def wait(self, seconds: float) -> list[str]:
        """Whole lines that came within a time."""
        if not select.select([self._fd], [], [], seconds)[0]:
            return []
        data = os.read(self._fd, 65536)
        self.ended = not data
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [line.decode(errors="replace") for line in lines]


def main() -> int:
    """Draw until standard input ends; returns the exit code."""
    for name in ("SIGINT", "SIGHUP", "SIGQUIT", "SIGTSTP"):
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    os.nice(NICE)
    console, lines = Console(stderr=True), Lines(0)
    screen: Screen | None = None
    drawn_s = 0.0
    with Live(console=console, auto_refresh=False, transient=True) as live:
        try:
            while not lines.ended:
                for line in lines.wait(LOOK_S):
                    if screen is None:
                        screen = Screen(Path(line))
                    else:
                        console.print(Text(line))
                if screen is None:
                    continue
                screen.look()
                if time.monotonic() - drawn_s >= DRAW_S:
                    live.update(screen.drawn(*console.size), refresh=True)
                    drawn_s = time.monotonic()
        except _SHOWN as error:
            console.print(Text(f"the display ends: {error}; the run goes on"))
            while not lines.ended:
                for line in lines.wait(1.0):
                    console.print(Text(line))
    if screen is not None:
        screen.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
