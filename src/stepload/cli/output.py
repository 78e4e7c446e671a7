"""The one place that writes to the terminal.

With `--json` exactly one JSON object goes to standard output and all else to standard error:
`stepload … --json | jq` always works. Without it, results go to standard output as text.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from stepload.errors import SteploadError
from stepload.plain import plain


class Output:
    """Text for people, or one JSON object for programs."""

    def __init__(self, *, as_json: bool) -> None:
        self.as_json = as_json
        self._text = sys.stderr if as_json else sys.stdout

    def line(self, text: str = "") -> None:
        """One line for people."""
        print(text, file=self._text, flush=True)

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A small table for people; numbers should come with their units."""
        from rich import box
        from rich.console import Console
        from rich.table import Table

        table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
        for column in columns:
            table.add_column(column, overflow="fold")
        for row in rows:
            table.add_row(*(cell.replace("[", r"\[") for cell in row))
        width = None if self._text.isatty() else 110
        Console(file=self._text, width=width, highlight=False).print(table)

    def result(self, data: Mapping[str, Any]) -> None:
        """The JSON object of this command; printed only with `--json`."""
        if self.as_json:
            print(json.dumps(plain(data), ensure_ascii=False, allow_nan=False), flush=True)

    def error(self, error: SteploadError) -> None:
        """A clear error on standard error; with `--json` an error object on standard output too."""
        print(f"error: {error}", file=sys.stderr, flush=True)
        self.result({"error": error.message, "hint": error.hint, "exit_code": error.exit_code})
