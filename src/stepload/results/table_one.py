"""Results of several runs in the form of the paper's Table I: K, n, secant by fit."""

from __future__ import annotations

import re
from collections.abc import Sequence

from stepload.estimators.fit import Fit
from stepload.evidence.quantity import Quantity
from stepload.results.comparison import Comparison
from stepload.results.comparison_curve import AgainstCurve
from stepload.results.model import NOTHING, Table
from stepload.units import format_quantity as f

COLUMNS = {"rs_btls": "RS-BTLS", "rs_rtls": "RS-RTLS"}
"""The paper's two estimators; the table shows the chord as well."""


def table_one(found: Comparison) -> Table:
    """One row for every run, as test 1, 2 … of its payload; and one for the curve, corrected.

    Payloads are named where there is more than one.
    """
    columns = ["test", "run"]
    for name in COLUMNS.values():
        columns += [f"{name}: K [N/mⁿ]", "n", "secant [N/m]"]
    columns += ["chord [N/m]", "95 % interval"]
    rows, tests = [], dict[str, int]()
    names = [each.run.metadata.get("payload", "") or NOTHING for each in found.runs]
    for place, (each, payload) in enumerate(zip(found.runs, names, strict=True)):
        tests[payload] = tests.get(payload, 0) + 1
        row = [f"{tests[payload]}", each.run.name]
        for name in COLUMNS:
            row += _three(each.found.fits.get(name))
        rows.append([*row, *(_chord(found.chords[place]) if found.chords else [NOTHING] * 2)])
    rows += _curve_rows(found.curve, len(columns))
    if len(set(names)) > 1:
        columns.insert(0, "payload")
        left = [*names, *[NOTHING] * (len(rows) - len(names))]
        rows = [[payload, *row] for payload, row in zip(left, rows, strict=True)]
    at = f(found.secant_force_n, "N")
    notes = [f"Secants (28) at {at}; K and n are not to be read apart: K carries the unit of n."]
    notes += correction_notes(found.curve)
    title = "Results side by side, as Table I of the paper"
    return Table(title, columns, rows, notes, page_only=True)


def _chord(figure: Quantity) -> list[str]:
    low, high = map(power_of_ten, figure.interval_n_per_m)
    return [power_of_ten(figure.value_n_per_m), f"[{low}, {high}]"]


def _three(fit: Fit | None) -> list[str]:
    if fit is None:
        return [NOTHING] * 3
    return [power_of_ten(fit.k), f"{fit.n:.2f}", power_of_ten(fit.secant_n_per_m)]


def power_of_ten(value: float) -> str:
    """A number as the paper prints it: 4.80e6."""
    return re.sub(r"e\+?(-?)0*(\d)", r"e\1\2", f"{value:.2e}")


def _curve_rows(curve: Sequence[AgainstCurve], columns: int) -> list[list[str]]:
    """The curve's secant, once for every force at which it was compared."""
    shown = [
        f"secant {power_of_ten(each.secant_n_per_m)} at {f(each.to_n, 'N')}"
        for each in curve
        if each.secant_n_per_m is not None
    ]
    left = [NOTHING] * (columns - 4)
    return [[NOTHING, "imported curve", *left, NOTHING, each] for each in dict.fromkeys(shown)]


def correction_notes(curve: Sequence[AgainstCurve]) -> list[str]:
    """The factors by which the forces of the curve were multiplied; nothing where they were not."""
    factors = {f"{each.correction:.4f}" for each in curve if each.correction != 1.0}
    return [
        f"The curve's forces are multiplied by {factor}, the ratio of the equivalent moduli (4): "
        "its secant, its chord and the picture are those of the corrected curve."
        for factor in sorted(factors)
    ]
