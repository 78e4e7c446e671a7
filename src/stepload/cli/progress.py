"""Progress of a whole plan: a live bar in a terminal, one plain line a phase elsewhere."""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from stepload.live.words import KEYS, clock, where
from stepload.record.rows import Phase

if TYPE_CHECKING:
    from stepload.engine.tick import Engine
    from stepload.envelope.envelope import Envelope
    from stepload.envelope.remaining import Remaining

Progress = Callable[["Engine", "Envelope"], None]


class Seen(NamedTuple):
    """State of a run at one time; `left_s` and `share` (of its time) stop while it is paused."""

    elapsed_s: float
    left_s: float
    share: float
    force: str
    where: str


class Watcher:
    """Observes a run; estimates the time that is left."""

    def __init__(self) -> None:
        from stepload.envelope.remaining import Remaining  # computed now, and not in a tick

        self._make = Remaining
        self._remaining: Remaining | None = None

    def look(self, engine: Engine, envelope: Envelope) -> Seen | None:
        """The present state; None before the first tick."""
        row = engine.row
        if row is None:
            return None
        if self._remaining is None:
            self._remaining = self._make(envelope.stages, envelope.plan.procedure)
        left_s = self._remaining.at(row)
        active_s = self._remaining.active_s
        force = f"{row.force_n:7.2f} N of {row.limit_n:.4g} N"
        return Seen(active_s, left_s, self._remaining.share, force, where(row) + _asked(engine))


def _asked(engine: Engine) -> str:
    """A request of the operator that is not carried out yet."""
    operator = engine.operator
    if operator.stop_level and not engine.safing:
        return "; ends after this step" if operator.stop_level == 1 else "; stops now"
    if not operator.paused:
        return ""
    return "; p goes on" if engine.course.phase == Phase.PAUSED else "; pauses after this step"


Show = Callable[[Seen | str], None]


@contextmanager
def pen(show: Show) -> Iterator[Show]:
    """Provides a function that queues a line or a look and returns at once.

    A thread of its own shows them, so that a blocked terminal does not block the run.
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


class Display(NamedTuple):
    """Display of a run (None: none), and of notices, which are never left out.

    Both return at once, even if the terminal blocks. `on_record` is called with the path of the
    run's record.
    """

    show: Progress | None
    say: Callable[[str], None]
    on_record: Callable[[Path], None] | None = None


REFRESH_S = 0.1


def _line(item: Seen | str) -> None:
    """Print a line on standard error; looks are shown only by a bar."""
    if isinstance(item, str):
        print(item, file=sys.stderr, flush=True)


def plain_lines(write: Callable[[str], None]) -> Progress:
    """One line whenever the phase changes."""
    last = [("", 0, 0)]
    watcher = Watcher()

    def show(engine: Engine, envelope: Envelope) -> None:
        seen, row = watcher.look(engine, envelope), engine.row
        if seen is None or row is None:
            return
        now = (Phase(row.phase).name, row.cycle, row.step)
        if now != last[0]:
            last[0] = now
            write(
                f"{seen.elapsed_s:7.1f} s, about {clock(seen.left_s)} left  {seen.force}"
                f"  {seen.where}"
            )

    return show


@contextmanager
def progress(*, quiet: bool, watch: bool = False) -> Iterator[Display]:
    """The display that suits standard error; `quiet` omits the progress only."""
    if quiet or watch or not sys.stderr.isatty():
        with pen(_line) as line:
            if quiet:
                yield Display(None, line)
            elif not sys.stderr.isatty():
                yield Display(plain_lines(line), line)
            else:
                from stepload.live.view import screen

                with screen(line) as drawn:
                    yield Display(None, drawn.say, drawn.follow)
    else:
        with _bar() as show, pen(show) as hand_over:
            yield Display(_looks(hand_over), hand_over)


def _looks(hand_over: Show) -> Progress:
    """Passes on the state of the run ten times a second."""
    watcher = Watcher()
    due = [0.0]

    def show(engine: Engine, envelope: Envelope) -> None:
        if time.monotonic() < due[0]:
            return
        due[0] = time.monotonic() + REFRESH_S
        if (seen := watcher.look(engine, envelope)) is not None:
            hand_over(seen)

    return show


@contextmanager
def _bar() -> Iterator[Show]:
    """A bar in the terminal, with lines above it."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    bar = Bar(
        TextColumn("{task.fields[force]}"),
        BarColumn(bar_width=16),
        TextColumn("{task.percentage:3.0f} %  {task.fields[eta]}  {task.description}"),
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,
    )
    with bar:
        bar.console.print(KEYS, markup=False, highlight=False)
        task = bar.add_task("", total=1.0, force="", eta="")

        def show(item: Seen | str) -> None:
            if isinstance(item, str):
                bar.console.print(item, markup=False, highlight=False)
                return
            bar.update(
                task,
                completed=item.share,
                description=item.where,
                force=item.force,
                eta=f"{clock(item.left_s)} left",
                refresh=True,
            )

        yield show
