"""Force against its limits and force over deformation, as text."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from stepload.engine.margins import MEANING, RULES
from stepload.live.braille import plot
from stepload.live.state import Point

SPAN_S = 60.0
"""Of the force that is shown."""
MOST_POINTS = 2000
LEAST_COLUMNS, LEAST_LINES = 60, 18
NEAR, CLOSE = 0.7, 0.9
"""Shares of a rule's limit from which on its margin is shown as near, and as very near."""


class Plots:
    """Keeps successive values of `State.told`, and draws them."""

    def __init__(self) -> None:
        self._force: deque[tuple[float, float]] = deque(maxlen=MOST_POINTS)
        self._curve: deque[tuple[float, float]] = deque(maxlen=MOST_POINTS)
        self._largest: dict[str, float] = {}
        self._told: Mapping[str, Any] = {}

    def take(self, told: Mapping[str, Any], trace: Iterable[Point]) -> None:
        """Keep one more state, and the points since the last one."""
        self._told = told
        for time_s, force_n, deformation_um in trace:
            self._force.append((time_s, force_n))
            if deformation_um is not None:
                self._curve.append((deformation_um, force_n))
        for rule, share in told["margins"].items():
            self._largest[rule] = max(share, self._largest.get(rule, 0.0))

    def drawn(self, columns: int, lines: int) -> RenderableType:
        """Both plots side by side and the margins below; the margins alone where it is narrow."""
        if not self._force or columns < LEAST_COLUMNS or lines < LEAST_LINES:
            return self._margins(columns)
        height = min(lines - 9, 30)
        wide = columns * 3 // 5
        plots = Table.grid(padding=(0, 1, 0, 0))
        plots.add_row(
            self._force_plot(wide - 1, height), self._curve_plot(columns - wide - 1, height)
        )
        return Group(plots, self._margins(columns))

    def _force_plot(self, columns: int, lines: int) -> Text:
        told, now_s = self._told, self._force[-1][0]
        shown = [(time_s - now_s, n) for time_s, n in self._force if now_s - time_s <= SPAN_S]
        limit_n, elastic_n = told["force_limit_n"], told["elastic_limit_n"]
        forces = [n for _, n in shown]
        top_n = max(1.1 * limit_n, *forces)
        title = f"force [N] over time [s]; F_c {elastic_n:.4g}"
        drawn = plot(
            shown, columns, lines, title,
            x_range=(-SPAN_S, 0.0), y_range=(min(0.0, *forces), top_n),
            levels=[(limit_n, f"F_lim {limit_n:.4g}"), (elastic_n, f"F_c {elastic_n:.4g}")],
        )  # fmt: skip
        return Text(drawn)

    def _curve_plot(self, columns: int, lines: int) -> Text:
        points = list(self._curve)
        top_n = max((n for _, n in points), default=1.0)
        title = "force [N] over deformation [um]"
        return Text(plot(points, columns, lines, title, y_range=(0.0, max(top_n, 1.0))))

    def _margins(self, columns: int) -> Text:
        """Share of each rule's limit that is used now, and its largest value so far."""
        text, used = Text("limits used (most so far): "), len("limits used (most so far): ")
        now = self._told.get("margins", {})
        for rule in (each for each in RULES if each in self._largest):
            most = self._largest[rule]
            style = "bold red" if most >= CLOSE else "yellow" if most >= NEAR else ""
            shown = f"{now[rule]:.0%}" if rule in now else "-"
            cell = f"{rule} {MEANING[rule]} {shown} ({most:.0%})  "
            if used + len(cell) - 2 > columns:
                text.append("\n")
                used = 0
            text.append(cell, style)
            used += len(cell)
        return text
