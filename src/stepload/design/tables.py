"""A design as a table for people and as an object for programs."""

from __future__ import annotations

from typing import Any

from stepload.design.answers import REQUIRED
from stepload.design.atlas_tables import LEFT_OUT
from stepload.design.binomial import CONFIDENCE
from stepload.design.front import Tried
from stepload.design.make import Design
from stepload.design.words import sentences
from stepload.design.world import DRAWN, NOT_DRAWN
from stepload.envelope.order import CYCLES
from stepload.results.model import Table
from stepload.units import format_quantity


def curve_table(found: Design) -> Table:
    """Time against half width."""
    rows = [
        (
            f"{each.duration_s:.0f} s" + (" *" if each is found.chosen else ""),
            format_quantity(each.candidate.top_n, "N"),
            str(each.candidate.order.steps),
            f"{each.candidate.order.ramp_s:g} s",
            f"{each.candidate.order.hold_s:g} s",
            each.width,
            f"{each.row.measured.value:.0%}",
        )
        for each in found.curve
    ]
    columns = ("time", "top force", "steps", "ramp", "hold", "half width", "rightly IDENTIFIED")
    return Table("What time buys (* the plan that was chosen)", columns, rows)


def data(found: Design) -> dict[str, Any]:
    """The JSON object of a design."""
    rows, limit = found.rows, found.ceiling
    return {
        "payload": limit.payload,
        "rig": limit.rig,
        "time_s": found.within_s,
        "largest_top_force_n": limit.top_n,
        "why_no_larger": limit.why,
        "required": REQUIRED,
        "confidence": CONFIDENCE,
        "seed": found.seed,
        "samples": found.samples,
        "identifications": sum(row.measured.of for row in rows),
        "refused": found.grid.refused,
        "drawn": DRAWN,
        "not_drawn": NOT_DRAWN,
        "left_out": LEFT_OUT,
        "checked": sum(row.checked for row in rows),
        "agreed": sum(row.agreed for row in rows),
        "answers": sentences(found),
        "chosen": tried(found.chosen),
        "curve": [tried(each) for each in found.curve],
        "plans": [tried(each) for each in found.tried],
        "judged_again": [tried(each) for each in found.again],
    }


def tried(each: Tried) -> dict[str, Any]:
    """A plan and its result, as flat columns."""
    plan, row = each.candidate, each.row
    return {
        "top_force_n": plan.top_n,
        "step_n": plan.step_n,
        "steps": plan.order.steps,
        "ramp_s": plan.order.ramp_s,
        "hold_s": plan.order.hold_s,
        "cycles": CYCLES,
        "duration_s": plan.duration_s,
        "samples": row.measured.of,
        **row.identified.columns("identified"),
        **row.measured.columns("measured"),
        "interval_true": row.covered.count,
        "half_width": row.half_width,
        "veto": row.veto,
        "can": str(each.can),
        "problem": row.problem,
    }
