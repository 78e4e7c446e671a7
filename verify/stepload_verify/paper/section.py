"""A section of the document: text, the comparisons it makes, and its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from stepload_verify.paper.bands import Band
from stepload_verify.paper.rows import Row


class Kind(StrEnum):
    """Kinds of evidence. They are counted apart: agreement means another thing in each."""

    THEORY = "arithmetic: equations on printed dimensions and materials"
    PAIRS = "arithmetic: (28) on printed pairs K̂, n̂"
    FITTED = "fitted: Table II by (10), hardness chosen"
    TIPS = "simulated and identified: tips, nothing chosen"
    SPHERES = "simulated and identified: spheres, with that hardness"


@dataclass(frozen=True, slots=True)
class Section:
    """`lines` are Markdown with the tables in place, `rows` and `bands` the comparisons in them
    that are counted as `kind`, `files` SVG and CSV text by file name."""

    title: str
    lines: tuple[str, ...]
    kind: Kind | None = None
    rows: tuple[Row, ...] = ()
    bands: tuple[Band, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """The section as Markdown."""
        return "\n".join([f"## {self.title}", "", *self.lines, ""])
