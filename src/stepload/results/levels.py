"""Force, deformation and creep of every hold, from the events of the engine and the data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.identification.conditions import Conditions
from stepload.identification.fit import FloatArray
from stepload.record.reader import Event
from stepload.results.model import (
    Field,
    Table,
    finite,
    named,
    number,
    quantity,
    table,
)
from stepload.results.press_data import HOLDS, PressData, TouchPoint, event_number
from stepload.units import format_quantity

END_SHARE = 0.1
"""Share of a hold that is averaged at its beginning and its end for the creep."""
SHEET_ROWS = 8
"""Largest number of load levels on the first sheet; of more, some are left out there."""


@dataclass(frozen=True, slots=True)
class Level:
    """One hold of a load level.

    Attributes:
        cycle, step: numbers from 1; `loading` is True on the way up.
        level_n: the commanded force.
        start_s, end_s: on the run's clock.
        settled: whether the level was reached and the force came to rest within the allowed time.
        force_n, deformation_m: means over the hold; the deflection of the system is subtracted from
            the deformation. NaN where the record has no sample of the hold.
        force_change_n, creep_m: from the first tenth of the hold to its last.
        samples: number of samples in the means.
    """

    cycle: int
    step: int
    loading: bool
    level_n: float
    start_s: float
    end_s: float
    settled: bool
    force_n: float
    deformation_m: float
    force_change_n: float
    creep_m: float
    samples: int


def levels_of(
    data: PressData, events: Sequence[Event], conditions: Conditions
) -> tuple[Level, ...]:
    """Every hold of a run in the order of time.

    Raises:
        BadInputError: an event of a hold lacks a value.
    """
    held = np.isin(data.phase, HOLDS)
    time_s, force_n = data.time_s[held], data.force_n[held]
    deformation_m = data.travel_m[held] - conditions.bend(force_n)
    found = []
    for event in events:
        if event.kind != "held":
            continue
        end_s = event.time_s
        start_s = end_s - event_number(event, "held_s")
        first, last = np.searchsorted(time_s, [start_s, end_s], side="left")
        force, deformation = force_n[first:last], deformation_m[first:last]
        found.append(
            Level(
                cycle=int(event_number(event, "cycle")),
                step=int(event_number(event, "step")),
                loading=bool(event.data.get("loading")),
                level_n=event_number(event, "level_n"),
                start_s=start_s,
                end_s=end_s,
                settled=bool(event.data.get("settled")),
                force_n=float(force.mean()) if force.size else math.nan,
                deformation_m=float(deformation.mean()) if force.size else math.nan,
                force_change_n=_change(force),
                creep_m=_change(deformation),
                samples=int(force.size),
            )
        )
    return tuple(found)


def _change(values: FloatArray) -> float:
    """Mean of the last tenth less that of the first; NaN where a tenth has no two samples."""
    part = int(values.size * END_SHARE)
    return float(values[-part:].mean() - values[:part].mean()) if part >= 2 else math.nan


def micrometres(value_m: float) -> str:
    """A change in µm with its sign; a zero has none."""
    text = f"{value_m * 1e6:+.2f}"
    return text if text.strip("+-0.") else "0.00"


def changes_again(levels: Sequence[Level]) -> list[tuple[Level, float | None]]:
    """The levels of the first loading, each with its change of deformation in the last loading.

    The change is corrected to the force of the first loading by the slope between the levels; None
    where the level was not loaded again.
    """
    up = [each for each in levels if each.loading and each.samples]
    first = [each for each in up if each.cycle == up[0].cycle]
    force = np.array([each.force_n for each in first])
    deformation = np.array([each.deformation_m for each in first])
    if len(first) < 2 or up[-1].cycle == up[0].cycle or not np.all(np.diff(force) > 0.0):
        return [(each, None) for each in first]
    later = {each.step: each for each in up if each.cycle == up[-1].cycle}
    rows: list[tuple[Level, float | None]] = []
    for each, per_n in zip(first, np.gradient(deformation, force).tolist(), strict=True):
        again = None
        if (other := later.get(each.step)) is not None:
            back_m = per_n * (other.force_n - each.force_n)
            again = other.deformation_m - back_m - each.deformation_m
        rows.append((each, again))
    return rows


def _fields(what: str) -> tuple[Field[Level], ...]:
    """The columns of a level; `what` is "travel" where the system's deflection is not out of it."""
    return (
        named("level_n", "load level", quantity("N")),
        Field(lambda each: finite(each.force_n), label="force [N]", show=number(".1f")),
        Field(
            lambda each: finite(1e6 * each.deformation_m), label=f"{what} [µm]", show=number(".2f")
        ),
        Field(lambda each: finite(each.creep_m), label="creep in the hold [µm]", show=micrometres),
        Field(lambda each: "yes" if each.settled else "NO", label="settled"),
    )


def sheet_table(
    levels: Sequence[Level],
    touches: Sequence[TouchPoint],
    resolution_m: float,
    what: str = "deformation",
) -> Table:
    """The load levels of the first loading for the first sheet, with the touches' repeatability."""
    rows, notes = changes_again(levels), list[str]()
    shown = rows
    if len(rows) > SHEET_ROWS:
        places = np.unique(np.round(np.linspace(0, len(rows) - 1, SHEET_ROWS)).astype(int))
        shown = [rows[place] for place in places]
        notes.append(f"{len(shown)} of {len(rows)} levels; all are in the table of every hold.")
    columns: list[Field[tuple[Level, float | None]]] = [
        field.of(lambda row: row[0]) for field in _fields(what)
    ]
    if any(again is not None for _, again in rows):
        last = max(each.cycle for each in levels if each.loading)
        label = f"cycle {last} less cycle 1 [µm]"
        columns.append(
            Field(lambda row: None if row[1] is None else finite(row[1]), "", label, micrometres)
        )
    if loose := sum(not level.settled for level, _ in rows):
        notes.append(f"{loose} of {len(rows)} levels did not settle in the time that they had.")
    notes.append(touch_repeatability(touches, resolution_m))
    title = "Load levels of the first loading"
    return table(title, columns, shown, [*filter(None, notes)])


def hold_table(levels: Sequence[Level], what: str = "deformation") -> Table:
    """Every hold of the run; `what` as in `sheet_table`."""
    columns: list[Field[Level]] = [
        named("cycle", "cycle"),
        named("step", "step"),
        Field(lambda each: "up" if each.loading else "down", label="way"),
        *_fields(what),
        Field(lambda each: f"{each.end_s - each.start_s:.1f} s", label="held for"),
        Field(lambda each: finite(each.force_change_n), "", "change of force [N]", number("+.2f")),
    ]
    note = f"Force and {what} are means over the hold; changes go from its first tenth to its last."
    return table("Every hold", columns, levels, [note], page_only=True)


def touch_repeatability(touches: Sequence[TouchPoint], resolution_m: float) -> str:
    """Repeatability of the touches before the first loading, and the shift of the last one."""
    first = [touch for touch in touches if touch.purpose in ("first", "again")]
    later = [touch for touch in touches if touch.purpose in ("cycle", "last")]
    if not first:
        return ""
    told = ["one touch before the first loading: its repeatability is not known"]
    if len(first) > 1:
        places = np.array([touch.position_m for touch in first])
        sd, span = (format_quantity(float(x), "m", 2) for x in (places.std(ddof=1), np.ptp(places)))
        spread = (
            f"standard deviation {sd}, span {span}" if np.ptp(places) else "all at one position"
        )
        told = [f"{len(first)} touches before the first loading: {spread}"]
    if later:
        moved_m = later[-1].travel_m - first[-1].travel_m
        told.append(f"the last touch lies {micrometres(moved_m)} µm from the zero of the run")
    if math.isfinite(resolution_m):
        told.append(f"resolution of the position {format_quantity(resolution_m, 'm', 2)}")
    return f"Touch repeatability: {'; '.join(told)}."
