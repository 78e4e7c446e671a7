"""Progress of a whole plan: a live bar in a terminal, one plain line a phase elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from stepload.cli.pen import Show, pen
from stepload.cli.seen import Seen, Watcher
from stepload.live.words import KEYS, clock
from stepload.record.rows import Phase

if TYPE_CHECKING:
    from stepload.engine.tick import Engine
    from stepload.envelope.envelope import Envelope

Progress = Callable[["Engine", "Envelope"], None]


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
