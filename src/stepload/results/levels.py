"""Force, deformation and creep of every hold, from the events of the engine and the data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.record.reader import Event
from stepload.results.model import Field, Table, finite, named, number, quantity, table
from stepload.results.press_data import HOLDS, PressData, TouchPoint, event_number
from stepload.units import format_quantity

END_SHARE = 0.1
"""Share of a hold that is averaged at its beginning and its end for the creep."""


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


SHEET_ROWS = 8
"""Largest number of load levels on the first sheet; of more, some are left out there."""


def micrometres(value_m: float) -> str:
    """A change in µm with its sign; a zero has none."""
    text = f"{value_m * 1e6:+.2f}"
    return text if text.strip("+-0.") else "0.00"


class LevelRow(NamedTuple):
    """A level of the first loading, and its change of deformation in the last loading.

    The change is corrected to the force of the first loading by the slope between the levels; None
    where the level was not loaded again.
    """

    level: Level
    again_m: float | None


def level_rows(levels: Sequence[Level]) -> list[LevelRow]:
    """The levels of the first loading in their order, each with its change in the last loading."""
    up = [each for each in levels if each.loading and each.samples]
    first = [each for each in up if each.cycle == up[0].cycle]
    force = np.array([each.force_n for each in first])
    deformation = np.array([each.deformation_m for each in first])
    if len(first) < 2 or up[-1].cycle == up[0].cycle or not np.all(np.diff(force) > 0.0):
        return [LevelRow(each, None) for each in first]
    later = {each.step: each for each in up if each.cycle == up[-1].cycle}
    rows = []
    for each, per_n in zip(first, np.gradient(deformation, force).tolist(), strict=True):
        again = None
        if (other := later.get(each.step)) is not None:
            back_m = per_n * (other.force_n - each.force_n)
            again = other.deformation_m - back_m - each.deformation_m
        rows.append(LevelRow(each, again))
    return rows


LEVEL: tuple[Field[Level], ...] = (
    Field(lambda each: each.level_n, label="load level", show=quantity("N")),
    Field(lambda each: finite(each.force_n), label="force [N]", show=number(".1f")),
    Field(
        lambda each: finite(each.deformation_m), label="deformation [µm]",
        show=lambda value: f"{value * 1e6:.2f}",
    ),
    Field(lambda each: finite(each.creep_m), label="creep in the hold [µm]", show=micrometres),
    Field(lambda each: "yes" if each.settled else "NO", label="settled"),
)  # fmt: skip
HOLD: tuple[Field[Level], ...] = (
    named("cycle", "cycle"),
    named("step", "step"),
    Field(lambda each: "up" if each.loading else "down", label="way"),
    *LEVEL,
    Field(lambda each: f"{each.end_s - each.start_s:.1f} s", label="held for"),
    Field(
        lambda each: finite(each.force_change_n), label="change of force [N]", show=number("+.2f")
    ),
    named("samples", "samples"),
)  # fmt: skip


def _headed(made: Table, what: str) -> Table:
    """The fields with `what` as the quantity shown for the arm's motion."""
    return replace(made, columns=[each.replace("deformation", what) for each in made.columns])


def sheet_table(
    levels: Sequence[Level],
    touches: Sequence[TouchPoint],
    resolution_m: float,
    what: str = "deformation",
) -> Table:
    """The load levels of the first loading for the first sheet, with the touches' repeatability.

    `what` is "travel" where the deflection of the system was not subtracted.
    """
    rows = level_rows(levels)
    shown = _some(rows)
    fields: list[Field[LevelRow]] = [field.of(lambda row: row.level) for field in LEVEL]
    notes = []
    if any(row.again_m is not None for row in rows):
        last = max(each.cycle for each in levels if each.loading)
        fields.append(Field(_again, label=f"cycle {last} less cycle 1 [µm]", show=micrometres))
    if len(shown) < len(rows):
        notes.append(
            f"{len(shown)} of {len(rows)} levels; all of them are in the table of every hold."
        )
    if loose := sum(not row.level.settled for row in rows):
        notes.append(f"{loose} of {len(rows)} levels did not settle in the time that they had.")
    notes.append(touch_repeatability(touches, resolution_m))
    made = table("Load levels of the first loading", fields, shown, [n for n in notes if n])
    return _headed(made, what)


def _again(row: LevelRow) -> float | None:
    return None if row.again_m is None else finite(row.again_m)


def _some(rows: list[LevelRow]) -> list[LevelRow]:
    """Rows that have room on the sheet: evenly spaced, the first and the last among them."""
    if len(rows) <= SHEET_ROWS:
        return rows
    places = np.unique(np.round(np.linspace(0, len(rows) - 1, SHEET_ROWS)).astype(int))
    return [rows[place] for place in places]


def hold_table(levels: Sequence[Level], what: str = "deformation") -> Table:
    """Every hold of the run; `what` as in `sheet_table`."""
    note = (
        f"Force and {what} are means over the hold; creep and change of force go from its first "
        "tenth to its last."
    )
    if what == "deformation":
        note += " The deflection of the system is taken out."
    return _headed(table("Every hold", HOLD, levels, [note], page_only=True), what)


def touch_repeatability(touches: Sequence[TouchPoint], resolution_m: float) -> str:
    """Repeatability of the touches before the first loading, and the shift of the last one."""
    first = [touch for touch in touches if touch.purpose in ("first", "again")]
    told = []
    if len(first) > 1:
        places = np.array([touch.position_m for touch in first])
        span_m, sd_m = float(np.ptp(places)), float(places.std(ddof=1))
        spread = (
            f"standard deviation {format_quantity(sd_m, 'm', 2)}, span"
            f" {format_quantity(span_m, 'm', 2)}"
            if span_m > 0.0
            else "all at one position"
        )
        told.append(f"{len(first)} touches before the first loading: {spread}")
    elif first:
        told.append("one touch before the first loading: its repeatability is not known")
    later = [touch for touch in touches if touch.purpose in ("cycle", "last")]
    if first and later:
        moved_m = later[-1].travel_m - first[-1].travel_m
        told.append(f"the last touch lies {micrometres(moved_m)} µm from the zero of the run")
    if not told:
        return ""
    if math.isfinite(resolution_m):
        told.append(f"resolution of the position {format_quantity(resolution_m, 'm', 2)}")
    return f"Touch repeatability: {'; '.join(told)}."
