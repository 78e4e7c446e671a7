"""Progress of a whole plan: one line a phase that is over, and a live bar in a terminal."""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from stepload.live.phase_text import KEYS, clock, where
from stepload.record.rows import Phase

if TYPE_CHECKING:
    from stepload.engine.tick import Engine
    from stepload.envelope.envelope import Envelope
    from stepload.envelope.remaining import Remaining
    from stepload.record.rows import TickRow

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


_NAMES: dict[int, str] = {
    **dict.fromkeys(
        (Phase.WARM_UP, Phase.FREE_AIR, Phase.TARE, Phase.DRIFT_CHECK),
        "tare, free air",
    ),
    Phase.ALIGN: "align",
    **dict.fromkeys(
        (
            Phase.FAST_APPROACH, Phase.GUARDED_APPROACH, Phase.DWELL,
            Phase.TOUCH_RETRACT,
        ),
        "touch",
    ),
    **dict.fromkeys(
        (Phase.LOAD, Phase.HOLD, Phase.NULLING, Phase.UNLOAD, Phase.UNLOAD_HOLD), "cycle"
    ),
    **dict.fromkeys((Phase.RETRACT, Phase.POST_TARE), "retract, tare"),
    Phase.PAUSED: "paused",
    Phase.SAFING: "safing",
}  # fmt: skip
"""Names of the phases that a person sees; ticks of one name are one phase."""


class Phases:
    """Says when a phase is over, in one line with its end, a cycle with its largest force."""

    def __init__(self) -> None:
        self._now = ("", 0)
        self._peak_n = 0.0

    def over(self, row: TickRow, elapsed_s: float) -> str:
        """The line of the phase that ended before this tick; "" where none did."""
        name = _NAMES.get(row.phase, "")
        if name == "touch" and self._now == ("retract, tare", row.cycle):
            return ""  # the last touch, after the last tare
        now = (name, row.cycle)
        line = ""
        if now != self._now and self._now[0]:
            name, cycle = self._now
            shown = f"cycle {cycle}" if name == "cycle" else name
            force = f"{self._peak_n:8.1f} N" if name == "cycle" else ""
            line = f"{shown:<16}{_minutes(elapsed_s):>7}{force}"
        if now != self._now:
            self._now, self._peak_n = now, 0.0
        self._peak_n = max(self._peak_n, row.force_n)
        return line


def _minutes(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


def plain_lines(write: Callable[[str], None]) -> Progress:
    """One line for each phase that is over."""
    watcher, phases = Watcher(), Phases()

    def show(engine: Engine, envelope: Envelope) -> None:
        seen, row = watcher.look(engine, envelope), engine.row
        if seen is not None and row is not None and (line := phases.over(row, seen.elapsed_s)):
            write(line)

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
    """Passes on the state of the run ten times a second, and a line for each phase that is over."""
    watcher, phases = Watcher(), Phases()
    due = [0.0]

    def show(engine: Engine, envelope: Envelope) -> None:
        if time.monotonic() < due[0]:
            return
        due[0] = time.monotonic() + REFRESH_S
        seen, row = watcher.look(engine, envelope), engine.row
        if seen is not None and row is not None:
            if line := phases.over(row, seen.elapsed_s):
                hand_over(line)
            hand_over(seen)

    return show


@contextmanager
def _bar() -> Iterator[Show]:
    """A bar in the terminal, with lines above it."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    bar = Bar(
        BarColumn(bar_width=16),
        TextColumn("{task.fields[eta]}  {task.fields[force]}  {task.description}"),
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
