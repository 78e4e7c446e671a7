"""Progress of a whole plan: a live bar in a terminal, one plain line a phase elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from stepload.record.rows import Phase

if TYPE_CHECKING:
    from stepload.engine.tick import Engine
    from stepload.envelope.envelope import Envelope

Progress = Callable[["Engine", "Envelope"], None]


class Display(NamedTuple):
    """Where a run is shown (None: not at all), and where notices go: never left out."""

    show: Progress | None
    say: Callable[[str], None]


REFRESH_S = 0.1


def _where(engine: Engine) -> str:
    step = engine.course
    name = Phase(engine.row.phase if engine.row else 0).name.replace("_", " ").lower()
    level = f", step {step.step_number} ({step.level_n:.4g} N)" if step.level_n else ""
    asked = "; `p` goes on" if step.phase == Phase.PAUSED else "; pauses after this step"
    return f"cycle {step.cycle}, {name}{level}{asked if engine.operator.paused else ''}"


def _force(engine: Engine) -> str:
    row = engine.row
    return f"{row.force_n:7.2f} N of {row.limit_n:.4g} N" if row else ""


def _line(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def plain_lines(write: Callable[[str], None]) -> Progress:
    """One line whenever the phase changes."""
    last = [("", 0, 0)]
    start_s: list[float] = []

    def show(engine: Engine, envelope: Envelope) -> None:
        row = engine.row
        if row is None:
            return
        start_s[:] = start_s or [row.time_s]
        now = (Phase(row.phase).name, row.cycle, row.step)
        if now != last[0]:
            last[0] = now
            elapsed_s = row.time_s - start_s[0]
            write(
                f"{elapsed_s:7.1f} s of about {envelope.duration_s:.0f} s  "
                f"{_force(engine)}  {_where(engine)}"
            )

    return show


@contextmanager
def progress(*, quiet: bool) -> Iterator[Display]:
    """The display that fits where standard error goes; quiet leaves out the progress alone."""
    if quiet:
        yield Display(None, _line)
        return
    if not sys.stderr.isatty():
        yield Display(plain_lines(_line), _line)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    bar = Bar(
        TextColumn("{task.fields[force]}"),
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:3.0f} %  {task.fields[eta]}  {task.description}"),
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,
    )
    with bar:
        task = bar.add_task("", total=None, force="", eta="")
        start_s: list[float] = []
        due = [0.0]

        def show(engine: Engine, envelope: Envelope) -> None:
            row = engine.row
            if row is None or time.monotonic() < due[0]:
                return
            due[0] = time.monotonic() + REFRESH_S
            start_s[:] = start_s or [row.time_s]
            elapsed_s = row.time_s - start_s[0]
            left_s = max(envelope.duration_s - elapsed_s, 0.0)
            bar.update(
                task,
                total=envelope.duration_s,
                completed=min(elapsed_s, envelope.duration_s),
                description=_where(engine),
                force=_force(engine),
                eta=f"{left_s:.0f} s left",
                refresh=True,
            )

        yield Display(show, lambda text: bar.console.print(text, markup=False, highlight=False))
