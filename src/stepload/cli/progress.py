"""Progress of a whole plan: one line a phase that is over, and a live bar in a terminal."""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from stepload.record.rows import Phase

if TYPE_CHECKING:
    from stepload.engine.tick import Engine
    from stepload.feasibility.preflight import Preflight
    from stepload.record.rows import TickRow

REFRESH_S = 0.1
Progress = Callable[["Engine", "Preflight"], None]
KEYS = "p pauses; Ctrl+C unloads and ends, twice retracts"


def where(row: TickRow) -> str:
    """Cycle, phase, and the load level where there is one, in words."""
    name = Phase(row.phase).name.replace("_", " ").lower()
    level = f", step {row.step} ({row.level_n:.4g} N)" if row.level_n else ""
    cycle = f"cycle {row.cycle}" if row.cycle else "before the first cycle"
    return f"{cycle}, {name}{level}"


def clock(seconds: float) -> str:
    """A time as people say it: 48 s, 2 min 05 s."""
    whole = round(seconds)
    return f"{whole} s" if whole < 100 else f"{whole // 60} min {whole % 60:02} s"


class Seen(NamedTuple):
    """State of a run at one time; `left_s` and `share` (of its time) stop while it is paused."""

    left_s: float
    share: float
    force: str
    where: str


Show = Callable[[Seen | str], None]


def _requested(engine: Engine) -> str:
    """A request of the operator that is not carried out yet."""
    operator = engine.operator
    if operator.stop_level and not engine.safing:
        return "; ends after this step" if operator.stop_level == 1 else "; stops now"
    if not operator.paused:
        return ""
    return "; p goes on" if engine.course.phase == Phase.PAUSED else "; pauses after this step"


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

    Both return at once, even if the terminal blocks.
    """

    show: Progress | None
    say: Callable[[str], None]


def _line(item: Seen | str) -> None:
    """Print a line on standard error; looks are shown only by a bar."""
    if isinstance(item, str):
        print(item, file=sys.stderr, flush=True)


_PHASES = {
    "tare, free air": (Phase.WARM_UP, Phase.FREE_AIR, Phase.TARE, Phase.DRIFT_CHECK),
    "align": (Phase.ALIGN,),
    "touch": (Phase.FAST_APPROACH, Phase.GUARDED_APPROACH, Phase.DWELL, Phase.TOUCH_RETRACT),
    "cycle": (Phase.LOAD, Phase.HOLD, Phase.UNLOAD, Phase.UNLOAD_HOLD),
    "retract, tare": (Phase.RETRACT, Phase.POST_TARE),
    "paused": (Phase.PAUSED,),
    "safing": (Phase.SAFING,),
}
"""The phases that a person sees; ticks of one name are one phase."""
_NAMES: dict[int, str] = {phase: name for name, phases in _PHASES.items() for phase in phases}


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


def follow(show: Show) -> Progress:
    """Passes on a line for each phase that is over, and the state of the run ten times a second."""
    from stepload.feasibility.remaining import Remaining  # imported now, and not in a tick

    phases, remaining, due_s = Phases(), None, 0.0

    def look(engine: Engine, preflight: Preflight) -> None:
        nonlocal remaining, due_s
        if (row := engine.row) is None:
            return
        remaining = remaining or Remaining(preflight.stages, preflight.plan.procedure)
        left_s = remaining.at(row)
        if line := phases.over(row, remaining.active_s):
            show(line)
        if time.monotonic() >= due_s:
            due_s = time.monotonic() + REFRESH_S
            force = f"{row.force_n:7.2f} N of {row.limit_n:.4g} N"
            show(Seen(left_s, remaining.share, force, where(row) + _requested(engine)))

    return look


@contextmanager
def progress(*, quiet: bool) -> Iterator[Display]:
    """The display that suits standard error; `quiet` omits the progress only."""
    if quiet or not sys.stderr.isatty():
        with pen(_line) as line:
            yield Display(None if quiet else follow(line), line)
    else:
        with _bar() as show, pen(show) as hand_over:
            yield Display(follow(hand_over), hand_over)


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
