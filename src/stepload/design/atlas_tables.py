"""A map as tables: for the terminal, as an object for programs, as columns of a file."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from stepload.design.answers import (
    REQUIRED,
    Map,
    Reach,
    can,
    extent,
    payload_answers,
    reaches,
    sentences,
)
from stepload.design.binomial import CONFIDENCE
from stepload.design.changes import relative_sigma
from stepload.design.work import Row
from stepload.design.world import DRAWN, NOT_DRAWN
from stepload.results.model import Table
from stepload.units import format_quantity, percent

UNITS = {"system stiffness": "N/m", "position resolution": "m", "gauge": "m"}
_REACH = [field.name for field in fields(Reach) if field.name != "unsure"]
LEFT_OUT = (
    "all runs of a cell are identified at once, with thresholds of the cell; laws that cannot "
    "change the headline, secants and the paper's fits are left out"
)


def payload_table(found: Map) -> Table:
    """Answers for every payload."""
    rows = []
    for each in payload_answers(found):
        body, best = each.specimen, each.best
        rows.append(
            (
                body.name,
                f"{body.top_n:.3g} N" if each.row else "not pressed",
                format_quantity(body.secant_n_per_m, "N/m"),
                each.row.within.text if each.row else "",
                each.row.identified.text if each.row else "",
                str(each.can),
                f"{best.point.change}: {best.measured.value:.0%}" if best else "",
            )
        )
    columns = (
        "payload", "force", "secant", f"within ±{1.0 / found.rig.conditions.t:.0%}", "IDENTIFIED",
        "can be measured", "best change",
    )  # fmt: skip
    return Table(f"Payloads on {found.rig.name}", columns, rows, (explained(found),))


def explained(found: Map) -> str:
    """Explanation of the columns in the table of payloads."""
    return (
        f"Share of {found.samples} simulated runs each, with its 95 % interval. Within "
        f"±{percent(1.0 / found.rig.conditions.t)} (1/t): the headline is so close to the truth. A "
        f"payload can be measured where at least {REQUIRED:.0%} of the runs are shown to be both."
    )


def reach_table(found: Map) -> Table:
    """Measured range of stiffness, row by row of the panels."""
    rows = []
    for each in reaches(found):
        limit = format_quantity(each.k_max_n_per_m, "N/m")
        rows.append((each.series, value_text(each), extent(each), limit, each.guideline))
    columns = ("varied", "value", "can be measured, without a gap", "K_max (34)", "(34) is")
    return Table(f"Secant stiffness at {found.rig.top_n:.4g} N", columns, rows)


def value_text(each: Reach) -> str:
    """The change of a row against the rig as it is."""
    if each.change:
        return each.change
    if each.series == "sigma of K_s":
        return f"{100.0 * each.value:.2g} %"
    unit = UNITS.get(each.series)
    return format_quantity(each.value, unit, 2) if unit else f"n = {each.value:g}"


def cell(row: Row) -> dict[str, Any]:
    """A cell as flat columns."""
    point, told = row.point, row.point.cell.conditions
    payload = point.cell.payload
    return {
        "series": point.series,
        "index": point.index,
        "value": point.value,
        "change": point.change,
        "payload": point.payload,
        "top_force_n": payload.at_n,
        "secant_n_per_m": payload.secant_n_per_m,
        "exponent": payload.exponent,
        "system_stiffness_n_per_m": told.sources.system_stiffness_n_per_m or math.nan,
        "system_stiffness_relative_sigma": relative_sigma(told),
        "position_resolution_m": told.position_resolution_m,
        "gauge": told.sources.system_stiffness_n_per_m is None,
        "k_max_n_per_m": row.k_max_n_per_m,
        "samples": row.measured.of,
        **row.within.columns("within"),
        **row.identified.columns("identified"),
        **row.measured.columns("measured"),
        "identified_and_false": row.identified.count - row.measured.count,
        "interval_true": row.covered.count,
        "half_width": row.half_width,
        "veto": row.veto,
        "can": str(can(row.measured)),
        "problem": row.problem,
    }


def data(found: Map) -> dict[str, Any]:
    """The JSON object of a map."""
    rig, every = found.rig, found.rows
    told = rig.conditions.sources
    return {
        "rig": rig.name,
        "top_force_n": rig.top_n,
        "system_stiffness_n_per_m": told.system_stiffness_n_per_m,
        "system_stiffness_note": rig.note,
        "accuracy": 1.0 / rig.conditions.t,
        "required": REQUIRED,
        "confidence": CONFIDENCE,
        "seed": found.seed,
        "samples": found.samples,
        "identifications": sum(row.measured.of for row in every),
        "drawn": DRAWN,
        "not_drawn": NOT_DRAWN,
        "left_out": LEFT_OUT,
        "checked": sum(row.checked for row in every),
        "agreed": sum(row.agreed for row in every),
        "largest_difference": max((row.value_off for row in every), default=0.0),
        "identified": sum(row.identified.count for row in every),
        "identified_and_false": sum(row.identified.count - row.measured.count for row in every),
        "interval_true": sum(row.covered.count for row in every),
        "answers": sentences(found),
        "payloads": [
            {
                "name": each.specimen.name,
                "top_force_n": each.specimen.top_n,
                "secant_n_per_m": each.specimen.secant_n_per_m,
                "exponent": each.specimen.exponent,
                "can": str(each.can),
                "why": each.specimen.why,
                "best_change": each.best.point.change if each.best else "",
                "best_can": str(can(each.best.measured)) if each.best else "",
                "text": each.text,
            }
            for each in payload_answers(found)
        ],
        "reach": [
            {name: getattr(each, name) for name in (*_REACH, "guideline")}
            for each in reaches(found)
        ],
        "cells": [cell(row) for row in every],
    }
