"""A design as a table for people and as an object for programs."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from stepload.design.answers import half_text
from stepload.design.grid import Candidate
from stepload.design.make import Design
from stepload.design.words import sentences
from stepload.envelope.order import CYCLES
from stepload.results.model import Table
from stepload.units import format_quantity


def curve_table(found: Design) -> Table:
    """Time against half width."""
    rows = [
        (
            f"{each.duration_s:.0f} s" + (" *" if each is found.chosen else ""),
            format_quantity(each.top_n, "N"),
            str(each.order.steps),
            f"{each.order.ramp_s:g} s",
            f"{each.order.hold_s:g} s",
            half_text(each.half_width),
        )
        for each in found.curve
    ]
    columns = ("time", "top force", "steps", "ramp", "hold", "half width")
    return Table("What time buys (* the plan that was chosen)", columns, rows)


def data(found: Design) -> dict[str, Any]:
    """The JSON object of a design."""
    limit = found.ceiling
    return {
        "payload": limit.payload,
        "rig": limit.rig,
        "time_s": found.within_s,
        "largest_top_force_n": limit.top_n,
        "why_no_larger": limit.why,
        "refused": found.grid.refused,
        "answers": sentences(found),
        "chosen": tried(found.chosen),
        "narrowing": [asdict(each) for each in found.narrowing],
        "curve": [tried(each) for each in found.curve],
        "plans": [tried(each) for each in found.tried],
    }


def tried(each: Candidate) -> dict[str, Any]:
    """A plan and its result, as flat columns."""
    return {
        "top_force_n": each.top_n,
        "step_n": each.step_n,
        "steps": each.order.steps,
        "ramp_s": each.order.ramp_s,
        "hold_s": each.order.hold_s,
        "cycles": CYCLES,
        "duration_s": each.duration_s,
        "half_width": each.half_width,
        "can": "yes" if each.can else "no",
    }
