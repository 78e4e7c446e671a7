"""Force, deformation and creep of every hold, from the events of the engine and the data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np

from stepload.identification.conditions import Conditions
from stepload.identification.fit import FloatArray
from stepload.record.reader import Event
from stepload.report.model import NOTHING, Table
from stepload.report.press_data import HOLDS, PressData, TouchPoint, event_number
from stepload.report.rows import Cell, OrNan, Row, figure, form, table
from stepload.units import format_quantity

END_SHARE = 0.1
"""Share of a hold that is averaged at its beginning and its end for the creep."""
SHEET_ROWS = 8
"""Largest number of load levels on the first sheet; of more, some are left out there."""


def micrometres(value_m: float) -> str:
    """A change in µm with its sign; a zero has none."""
    text = f"{value_m * 1e6:+.2f}"
    return text if text.strip("+-0.") else "0.00"


class Level(Row):
    """One hold of a load level."""

    cycle: int = figure("From 1.", "cycle")
    step: int = figure("From 1.", "step")
    loading: Annotated[bool, lambda up: "up" if up else "down"] = figure("On the way up.", "way")
    level_n: float = figure("Force aimed at.", "load level")
    start_s: float = figure("Begin of the hold on the run's clock.")
    end_s: Annotated[float, Cell(lambda row: f"{row.end_s - row.start_s:.1f} s")] = figure(
        "End of the hold.", "held for"
    )
    settled: Annotated[bool, lambda rest: "yes" if rest else "NO"] = figure(
        "Whether the level was reached, and the force came to rest in the time it had.", "settled"
    )
    force_n: Annotated[OrNan, form(".1f")] = figure(
        "Mean contact force; null where the record has no sample of the hold.", "force [N]"
    )
    deformation_m: Annotated[OrNan, lambda m: f"{1e6 * m:.2f}"] = figure(
        "Mean deformation, the deflection of the system taken out.", "deformation [µm]"
    )
    force_change_n: Annotated[OrNan, form("+.2f")] = figure(
        "Change of the force from the first tenth of the hold to the last.", "change of force [N]"
    )
    creep_m: Annotated[OrNan, micrometres] = figure(
        "Change of the deformation from the first tenth of the hold to the last.",
        "creep in the hold [µm]",
    )
    samples: int = figure("Samples in the means.")


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


def _on_sheet(what: str) -> tuple[str, ...]:
    return ("load level", "settled", "force [N]", f"{what} [µm]", "creep in the hold [µm]")


def sheet_table(
    levels: Sequence[Level],
    touches: Sequence[TouchPoint],
    resolution_m: float,
    what: str = "deformation",
) -> Table:
    """The load levels of the first loading for the first sheet, with the touches' repeatability.

    `what` is "travel" where the system's deflection is not taken out.
    """
    rows, notes = changes_again(levels), list[str]()
    shown = rows
    if len(rows) > SHEET_ROWS:
        places = np.unique(np.round(np.linspace(0, len(rows) - 1, SHEET_ROWS)).astype(int))
        shown = [rows[place] for place in places]
        notes.append(f"{len(shown)} of {len(rows)} levels; all are in the table of every hold.")
    if loose := sum(not level.settled for level, _ in rows):
        notes.append(f"{loose} of {len(rows)} levels did not settle in the time that they had.")
    notes.append(touch_repeatability(touches, resolution_m))
    every = hold_table([level for level, _ in shown], what)
    kept = [place for place, name in enumerate(every.columns) if name in _on_sheet(what)]
    columns, *lines = ([row[place] for place in kept] for row in (every.columns, *every.rows))
    if any(again is not None for _, again in rows):
        last = max(each.cycle for each in levels if each.loading)
        columns = [*columns, f"cycle {last} less cycle 1 [µm]"]
        lines = [
            [*line, NOTHING if again is None or math.isnan(again) else micrometres(again)]
            for line, (_, again) in zip(lines, shown, strict=True)
        ]
    return Table("Load levels of the first loading", columns, lines, [*filter(None, notes)])


def hold_table(levels: Sequence[Level], what: str = "deformation") -> Table:
    """Every hold of the run; `what` as in `sheet_table`."""
    note = f"Force and {what} are means over the hold; changes go from its first tenth to its last."
    made = table("Every hold", Level, levels, [note], page_only=True)
    columns = [each.replace("deformation", what) for each in made.columns]
    return replace(made, columns=columns)


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
