"""Elements of results, independent of how they are shown.

A `Document` is a whole result for people; `terminal` and `page` show it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

NOTHING = "–"


def finite(value: float) -> float | None:
    """The number; None for one that is not finite, where there is nothing to show."""
    return value if math.isfinite(value) else None


def number_or_nan(value: object) -> float:
    """A number of a record, whose content is not trusted; NaN where it is none."""
    return float(value) if isinstance(value, int | float) else math.nan


@dataclass(frozen=True, slots=True)
class Table:
    """A table for people; `notes` stand below.

    A terminal omits a `page_only` table.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    page_only: bool = False


SHEET_ROWS = 12


def first_rows(each: Table) -> Table:
    """The table shortened for the first sheet; a note says what was left out there."""
    if len(each.rows) <= SHEET_ROWS:
        return each
    left = f"{SHEET_ROWS} of {len(each.rows)} rows; all of them are in the details."
    return replace(each, rows=each.rows[:SHEET_ROWS], notes=(*each.notes, left))


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding: its mark ("ok", "warn" …), the finding itself, and what to do."""

    mark: str
    text: str
    remedy: str = ""


SIMULATED = "SIMULATED: no payload was pressed; every force and travel here is computed."
"""Line shown above all results from a simulated rig."""

Mood = Literal["good", "doubt", "bad"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Verdict of a result: one word, and one sentence with the decisive figure."""

    mood: Mood
    word: str
    text: str


@dataclass(frozen=True, slots=True)
class Figure:
    """One picture; `alt` describes it in words, `draw` makes the SVG on demand."""

    name: str
    title: str
    caption: str
    alt: str
    draw: Callable[[], str]


@dataclass(frozen=True, slots=True)
class Certificate:
    """The first page, on one sheet: the content for a quality file or the appendix of a paper.

    Attributes:
        heading: what kind of sheet it is.
        facts: columns of (name, value): what was pressed; with what, by whom.
        tables: results with their intervals.
        levels: load levels of the figure's curve, shown next to it; None where there are none.
        figure: the one that shows the result; None where there is nothing to show.
        remarks: remarks for this page; the document's reasons are on the next.
        signatures: who signs: (role, name as far as it is known).
        foot: which run this is; repeated at the foot of every printed page.
        seal: checksum of its record; "" where that is not finished yet, or there is none.
    """

    heading: str
    facts: Sequence[Sequence[tuple[str, str]]] = ()
    tables: Sequence[Table] = ()
    levels: Table | None = None
    figure: Figure | None = None
    remarks: Sequence[str] = ()
    signatures: Sequence[tuple[str, str]] = ()
    foot: str = ""
    seal: str = ""


@dataclass(frozen=True, slots=True)
class Document:
    """A result for people. Certificate, figures and texts (name, content) are for a page."""

    title: str
    verdict: Verdict
    subtitle: str = ""
    ended: str = ""
    """How a run ended; "" where nothing ran."""
    reasons: Sequence[str] = ()
    doubts: Sequence[str] = ()
    """Those of the reasons that a terminal shows, the weightiest first."""
    brief: Sequence[str] = ()
    """Lines below the verdict in a terminal."""
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    texts: Sequence[tuple[str, str]] = ()
    simulated: bool = False
    """Whether it comes from a simulated rig, which every display states at the top."""
    certificate: Certificate | None = None
