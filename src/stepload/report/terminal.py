"""The one place that writes results to the terminal.

With `--json` exactly one JSON object goes to standard output and all else to standard error:
`stepload … --json | jq` always works. Without it, results go to standard output as text. Names and
texts may come from a user's file: control characters are shown, not sent. A closed terminal or pipe
changes neither what a command does nor its exit code.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, TextIO

import typer

from stepload.errors import SteploadError
from stepload.record.plain import json_text
from stepload.report.model import Document, Finding, Table

AsJson = Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")]
Processes = Annotated[
    int | None, typer.Option("--processes", min=1, help="Processes; all cores by default.")
]


COLOURS = {"good": "1;32", "doubt": "1;33", "bad": "1;31"}
"""Colour of each mood on a terminal; the word gives the same information."""
MARKS = {
    "ok": "good", "warn": "doubt", "note": "", "refuse": "bad", "refused": "bad", "fail": "bad",
}  # fmt: skip
NARROW = 80
"""Columns of a screen; a result fits there, in a pipe too."""
MOST_REASONS = 3
LONGEST_WORD = 20
"""Words longer than this are broken in a table: paths, identifiers."""
_WHOLE = re.compile(r" *\d* \| |  -> stepload ")
"""A line of a user's file with its number, or a command to copy."""
BESIDE = 2
"""Characters between two columns of a table."""


def wrapped(line: str, hang: int, columns: int = NARROW) -> str:
    """A line broken between words at the columns of a screen; further lines begin at `hang`.

    A word that is too long stays whole, to be copied.
    """
    return "\n".join(
        textwrap.wrap(
            line, columns, subsequent_indent=" " * hang, break_long_words=False,
            break_on_hyphens=False,
        )
    )  # fmt: skip


def visible(text: str) -> str:
    """`text` with control and other unprintable characters as escapes; line ends stay."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )


_lost: list[OSError] = []
"""Why standard output is not whole, though somebody takes it."""


@contextlib.contextmanager
def _perhaps_gone(stream: TextIO) -> Iterator[None]:
    """Print nowhere once nobody takes it; the command goes on."""
    try:
        yield
    except OSError as error:
        with contextlib.suppress(OSError, ValueError):
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, stream.fileno())
            os.close(nothing)
        if stream is sys.stdout and error.errno != errno.EPIPE:
            _lost.append(error)


def delivered() -> bool:
    """Whether standard output is whole, at the end of a command; on standard error why it is not.

    An output whose reader is gone counts as whole.
    """
    with _perhaps_gone(sys.stdout):
        sys.stdout.flush()
    why = next((error.strerror for error in _lost), None)
    _lost.clear()
    if why is not None:
        with _perhaps_gone(sys.stderr):
            print(f"error: the output could not be written: {why}", file=sys.stderr, flush=True)
    return why is None


def column_widths(cells: Sequence[Sequence[str]], width: int) -> list[int]:
    """Widths of the columns, each given as its cells, of a table in a terminal of `width` columns.

    A column is as wide as its longest word, so that words stay whole; what is left goes to the
    narrowest whose cells are longer. Where the longest words do not fit beside each other they are
    broken: a column that did not fit at all would be left out without a sign.
    """
    words = [max((len(word) for cell in column for word in cell.split()), default=1)
             for column in cells]  # fmt: skip
    whole = [max(1, *map(len, column)) for column in cells]
    room, most = width - 1 - BESIDE * len(cells), LONGEST_WORD
    while most > 1 and sum(min(each, most) for each in words) > room:
        most -= 1
    found = [min(each, most) for each in words]
    for _ in range(room - sum(found)):
        lacking = [at for at, each in enumerate(found) if each < whole[at]]
        if not lacking:
            break
        found[min(lacking, key=found.__getitem__)] += 1
    return found


def _fits(cells: Sequence[Sequence[str]], width: int) -> bool:
    """Whether columns, each given as its cells, have room beside each other."""
    return sum(max(map(len, each)) + BESIDE for each in cells) < width


class Output:
    """Text for people, or one JSON object for programs."""

    def __init__(self, *, as_json: bool) -> None:
        self.as_json = as_json
        self._text = sys.stderr if as_json else sys.stdout
        self._columns = shutil.get_terminal_size().columns if self._text.isatty() else None

    def line(self, text: str = "", *, hang: int = 2, word: str = "", mood: str = "") -> None:
        """A text for people; a terminal wraps it between words and indents further lines by `hang`.

        A terminal shows `word` in the colour of the mood, unless NO_COLOR is set.
        """
        shown = visible(text)
        if self._columns is not None:
            shown = "\n".join(wrapped(line, hang, self._columns) for line in shown.split("\n"))
            if mood in COLOURS and word and not os.environ.get("NO_COLOR"):
                shown = shown.replace(word, f"\x1b[{COLOURS[mood]}m{word}\x1b[0m", 1)
        with _perhaps_gone(self._text):
            print(shown, file=self._text, flush=True)

    def finding(self, found: Finding) -> None:
        """One finding, and what to do about it."""
        mark = found.mark.upper()
        self.line(f"{mark:7} {found.text}", hang=8, word=mark, mood=MARKS.get(found.mark, ""))
        if found.remedy:
            self.line(f"        -> {found.remedy}", hang=11)

    def tables(self, *tables: Table) -> None:
        """Tables for people with their notes; a table without rows is omitted."""
        for each in tables:
            if not each.rows:
                continue
            self.table(each.title, each.columns, each.rows)
            if each.notes:
                self.line("\n".join((*each.notes, "")))

    def verdict(self, document: Document, *, whole: bool = True) -> None:
        """The verdict of a result, its first line only where it is not to be shown `whole`."""
        aside, verdict = "SIMULATED, " if document.simulated else "", document.verdict
        word = verdict.word.upper()
        start = f"{aside}{word}   "
        text = verdict.text if whole else verdict.text.partition(", from ")[0]
        lines = wrapped(f"{start}{text}", len(start))
        if not whole:
            lines = lines.partition("\n")[0]
        self.line(lines, word=word, mood=verdict.mood)

    def show(self, document: Document, *, details: bool = True) -> None:
        """A result for people: with `details` all tables, then the verdict on one screen."""
        if details:
            self.tables(*(each for each in document.tables if not each.page_only))
        self.verdict(document)
        for reason in document.reasons if details else document.doubts[:MOST_REASONS]:
            self.line(wrapped(f"  {reason}", 4))
        if document.brief:
            self.line("\n" + "\n".join(document.brief) + "\n")

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A small table for people; numbers should come with their units.

        One that is too wide is turned, a figure in each line, where it then fits.
        """
        from rich import box
        from rich.console import Console
        from rich.table import Table

        table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False,
                      padding=(0, 1, 0, 0))  # fmt: skip
        width = self._columns or NARROW
        cells = [[visible(cell) for cell in row] for row in (columns, *rows)]
        turned = [list(column) for column in zip(*cells, strict=True)]
        if not _fits(turned, width) and _fits(cells, width):
            cells, turned = turned, cells
        for column, each in zip(cells[0], column_widths(turned, width), strict=True):
            table.add_column(column.replace("[", r"\["), overflow="fold", width=each)
        for row in cells[1:]:
            table.add_row(*(cell.replace("[", r"\[") for cell in row))
        console = Console(file=self._text, width=width, highlight=False)
        with _perhaps_gone(self._text):
            with console.capture() as made:
                console.print(table)
            lines = map(str.rstrip, made.get().split("\n"))
            print(*lines, sep="\n", end="", file=self._text, flush=True)

    def document(self, text: str) -> None:
        """A text for programs, as it is, to standard output."""
        with _perhaps_gone(sys.stdout):
            print(text, flush=True)

    def result(self, data: Mapping[str, Any]) -> None:
        """The JSON object of this command; printed only with `--json`."""
        if self.as_json:
            self.document(json_text(data))

    def error(self, error: SteploadError) -> None:
        """A clear error on standard error; with `--json` an error object on standard output too."""
        shown = visible(f"error: {error}")
        if sys.stderr.isatty():
            columns = shutil.get_terminal_size().columns
            shown = "\n".join(
                line if _WHOLE.match(line) else wrapped(line, 5, columns)
                for line in shown.split("\n")
            )
        with _perhaps_gone(sys.stderr):
            print(shown, file=sys.stderr, flush=True)
        self.result({"error": error.message, "hint": error.hint, "exit_code": error.exit_code})
