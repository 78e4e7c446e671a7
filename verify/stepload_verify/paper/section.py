"""A section of the document: text, the comparisons it makes, and its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from stepload_verify.paper.rows import Row


@dataclass(frozen=True, slots=True)
class Section:
    """`lines` are Markdown with the tables in place, `rows` the printed numbers in them,
    `beside` the same from other evidence, not counted, `files` SVG and CSV text by file name."""

    title: str
    lines: tuple[str, ...]
    rows: tuple[Row, ...] = ()
    beside: tuple[Row, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """The section as Markdown."""
        return "\n".join([f"## {self.title}", "", *self.lines, ""])
