"""What is wrong with a plan: every problem with its place, its line and a caret."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches

from stepload.errors import BadInputError

MAX_PROBLEMS = 50
"""Problems shown; the rest are counted."""

_WIDTH = 72
"""Characters of a line of the file; with its number, a screen is 80 columns wide."""


def printable(text: str, limit: int = 60) -> str:
    """`text` cut to `limit` characters, with everything that could steer a terminal escaped."""
    cut = text if len(text) <= limit else text[: limit - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)


def guess(name: str, known: Iterable[str]) -> str:
    """A question whether the nearest known name is meant, for a hint; "" where none is near."""
    near = get_close_matches(name[:60], list(known), n=1)
    return f"did you mean {near[0]!r}? " if near else ""


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem at `line`, `column` (both count from 1; 0, 0: the file as a whole).

    `source_line` is the line of the file, `hint` what was expected or what to do.
    """

    file: str
    line: int
    column: int
    source_line: str
    message: str
    hint: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        lines = [f"{printable(place, 400)}: {self.message}"]
        if self.line and self.source_line.strip():
            start = max(0, self.column - _WIDTH // 2) if self.column > _WIDTH - 20 else 0
            shown = self.source_line[start : start + _WIDTH]
            shown = "".join(c if c.isprintable() else " " for c in shown).rstrip()
            number, caret = f"{self.line:5d} | ", " " * (self.column - 1 - start) + "^"
            lines += [number + shown, " " * (len(number) - 2) + "| " + caret]
        if self.hint:
            lines.append(f"  -> {self.hint}")
        return "\n".join(lines)


class PlanError(BadInputError):
    """A plan, or a file it is made of, that cannot be used; carries every problem found."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        shown = [str(problem) for problem in problems[:MAX_PROBLEMS]]
        if len(problems) > MAX_PROBLEMS:
            shown.append(f"… and {len(problems) - MAX_PROBLEMS} more")
        count = f"{len(problems)} problem{'s' if len(problems) != 1 else ''}"
        super().__init__("\n\n".join([*shown, count]))
        self.problems = problems
        self.problems = problems
