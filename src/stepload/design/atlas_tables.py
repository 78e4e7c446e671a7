"""A map as tables: for the terminal, as an object for programs, as columns of a file."""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from typing import Any

from stepload.design.answers import (
    Map,
    Reach,
    extent,
    half_text,
    payload_answers,
    reaches,
    sentences,
)
from stepload.design.points import LARGEST, Row
from stepload.evidence.changes import relative_sigma
from stepload.results.model import Table
from stepload.units import format_quantity, percent

UNITS = {"system stiffness": "N/m", "position resolution": "m", "gauge": "m"}
_REACH = [field.name for field in fields(Reach)]


def payload_table(found: Map) -> Table:
    """Answers for every payload."""
    rows = [
        (
            each.specimen.name,
            f"{each.specimen.top_n:.3g} N" if each.row else "not pressed",
            format_quantity(each.specimen.secant_n_per_m, "N/m"),
            half_text(each.row.half_width) if each.row else "",
            each.can,
            f"{each.best.todo}: {half_text(each.best.half_width)}" if each.best else "",
        )
        for each in payload_answers(found)
    ]
    columns = ("payload", "force", "secant", "interval", "can be measured", "narrower with")
    return Table(f"Payloads on {found.rig.name}", columns, rows, (explained(found),))


def explained(found: Map) -> str:
    """Explanation of the columns in the table of payloads."""
    accuracy = percent(1.0 / found.rig.conditions.t)
    return (
        f"A payload can be measured where the 95 % interval of its chord is ±{accuracy} (1/t) or "
        "narrower, and its secant is below K_max (34)."
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
    point, told = row.point, row.point.conditions
    lines = [line.source for line in row.lines] + [""] * (LARGEST - len(row.lines))
    return {
        "series": point.series,
        "index": point.index,
        "value": point.value,
        "change": point.change,
        "payload": point.payload,
        "top_force_n": point.top_n,
        "secant_n_per_m": point.secant_n_per_m,
        "exponent": point.exponent,
        "system_stiffness_n_per_m": told.sources.system_stiffness_n_per_m or math.nan,
        "system_stiffness_relative_sigma": relative_sigma(told),
        "position_resolution_m": told.position_resolution_m,
        "gauge": told.sources.system_stiffness_n_per_m is None,
        "k_max_n_per_m": row.k_max_n_per_m,
        "half_width": row.half_width,
        "largest_line": lines[0],
        "second_line": lines[1],
        "can": "yes" if row.measured else "no",
        "problem": row.problem,
    }


def data(found: Map) -> dict[str, Any]:
    """The JSON object of a map."""
    rig = found.rig
    return {
        "rig": rig.name,
        "top_force_n": rig.top_n,
        "system_stiffness_n_per_m": rig.conditions.sources.system_stiffness_n_per_m,
        "system_stiffness_note": rig.note,
        "accuracy": 1.0 / rig.conditions.t,
        "answers": sentences(found),
        "payloads": [
            {
                "name": each.specimen.name,
                "top_force_n": each.specimen.top_n,
                "secant_n_per_m": each.specimen.secant_n_per_m,
                "exponent": each.specimen.exponent,
                "can": each.can,
                "half_width": each.row.half_width if each.row else math.nan,
                "why": each.specimen.why,
                "best_change": each.best.todo if each.best else "",
                "narrowing": [asdict(way) for way in each.row.narrowing] if each.row else [],
                "text": each.text,
            }
            for each in payload_answers(found)
        ],
        "reach": [
            {name: getattr(each, name) for name in (*_REACH, "guideline")}
            for each in reaches(found)
        ],
        "cells": [cell(row) for row in found.rows],
    }
