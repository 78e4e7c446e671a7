"""What is wrong with a plan: every problem with its place, its line and a caret."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.errors import BadInputError, printable

MAX_PROBLEMS = 50
"""Problems shown; the rest are counted."""

_WIDTH = 72
"""Characters of a line of the file; with its number, a screen is 80 columns wide."""


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
