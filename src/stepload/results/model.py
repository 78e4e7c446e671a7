"""Elements of results, independent of how they are shown.

A `Field` defines one figure once: its name in JSON, its heading for people, the origin of its value
and its format. Objects for programs and tables for people follow from the same fields. A `Document`
is a whole result for people; `terminal` and `page` show it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any, Generic, Literal, TypeVar

from stepload.units import format_quantity

S = TypeVar("S")
T = TypeVar("T")
NOTHING = "–"

Show = Callable[[Any], str]
"""From a value to the text that people read."""


@dataclass(frozen=True, slots=True)
class Field(Generic[T]):
    """One figure of a `T`.

    Attributes:
        value: function from a `T` to the figure, in SI; None where there is none.
        key: its name in JSON; "" where it is for people only.
        label: its heading; "" where it is for programs only.
        show: format for people.
    """

    value: Callable[[T], Any]
    key: str = ""
    label: str = ""
    show: Show = str

    def text(self, item: T) -> str:
        """The figure of `item` as text for people."""
        value = self.value(item)
        return NOTHING if value is None else self.show(value)

    def of(self, part: Callable[[S], T | None]) -> Field[S]:
        """The same figure for an `S` that has a `T` as its part, or None where it has not."""

        def value(whole: S) -> Any:
            found = part(whole)
            return None if found is None else self.value(found)

        return Field(value, self.key, self.label, self.show)


def named(key: str, label: str = "", show: Show = str) -> Field[Any]:
    """The field of an attribute that has the same name in JSON."""
    return Field(attrgetter(key), key, label, show)


def by_name(label: str, fields: Iterable[Field[T]]) -> list[Field[tuple[str, T]]]:
    """The fields of an item with a name, which is shown first."""
    name: Field[tuple[str, T]] = Field(lambda pair: pair[0], label=label)
    return [name, *(field.of(lambda pair: pair[1]) for field in fields)]


def quantity(unit: str) -> Show:
    """Shows a number of an SI unit with a prefix that suits it."""
    return lambda value: format_quantity(value, unit)


def number(form: str) -> Show:
    """Shows a number in a Python format."""
    return lambda value: format(value, form)


def interval(unit: str) -> Show:
    """Shows two numbers of one SI unit as an interval; a common unit is named once, and both have
    the same number of decimals."""

    def show(ends: Sequence[float]) -> str:
        (low, _, of), (high, _, other) = (format_quantity(end, unit).partition(" ") for end in ends)
        if of != other:
            return f"[{low} {of}, {high} {other}]"
        places = max(len(end.partition(".")[2]) for end in (low, high))
        if places and all(end.replace(".", "").lstrip("-").isdigit() for end in (low, high)):
            low, high = (f"{float(end):.{places}f}" for end in (low, high))
        return f"[{low}, {high}] {of}"

    return show


def finite(value: float) -> float | None:
    """The number; None for one that is not finite, where there is nothing to show."""
    return value if math.isfinite(value) else None


def data(fields: Iterable[Field[T]], item: T) -> dict[str, Any]:
    """The JSON object of `item`: every field that has a key."""
    return {each.key: each.value(item) for each in fields if each.key}


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


def table(
    title: str,
    fields: Iterable[Field[T]],
    items: Iterable[T],
    notes: Sequence[str] = (),
    *,
    page_only: bool = False,
) -> Table:
    """The table of `items`: one row each, one column for every field that has a label."""
    shown = [each for each in fields if each.label]
    rows = [[each.text(item) for each in shown] for item in items]
    return Table(title, [each.label for each in shown], rows, notes, page_only)


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
