"""Runs and curves side by side: Tables I and II of the paper, bounds, picture (Figs. 8–13)."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from stepload.errors import DomainError
from stepload.identification.difference import SAME_FORCE
from stepload.identification.fit import Fit, FloatArray
from stepload.identification.ls import rs_btls
from stepload.identification.samples import uniform_in_force
from stepload.identification.smooth import NORMAL_95
from stepload.report import figures
from stepload.report.comparison import Comparison
from stepload.report.comparison_curve import Loading, correction_for
from stepload.report.model import NOTHING, Table
from stepload.report.rows import Row, data, figure, form, part, table
from stepload.report.run_figures import law_band
from stepload.units import change
from stepload.units import format_quantity as f

COLUMNS = {"rs_btls": "RS-BTLS", "rs_rtls": "RS-RTLS"}
"""The paper's two estimators; the table shows the chord as well."""


def power_of_ten(value: float) -> str:
    """A number as the paper prints it: 4.80e6."""
    return re.sub(r"e\+?(-?)0*(\d)", r"e\1\2", f"{value:.2e}")


Change = Annotated[float | None, change]


class ResultRow(Row):
    """One run or curve by RS-BTLS, as a row of the paper's Table II."""

    name: str = figure("Name of the run or the curve.", "run or curve")
    payload: str | None = figure("Name of the payload that was pressed or predicted.", "payload")
    k: Annotated[float | None, part("k"), power_of_ten] = figure(
        "K̂ in N/m^n.", "K̂ [N/mⁿ]", at="fit"
    )
    n: Annotated[float | None, part("n"), form(".2f")] = figure("n̂.", "n̂", at="fit")
    secant_n_per_m: Annotated[float | None, power_of_ten] = figure(
        "Secant (28) of this fit.", "secant [N/m]"
    )
    secant_change: Change = figure("Its change relative to the first row.", "to the first")


class BoundsRow(Row):
    """Bounds of the secant of one run or curve."""

    name: str = figure("Name of the run or the curve.", "run or curve")
    bound_m: float | None = figure("δ_Δ + √MSDE; null: the curve is exact.")
    bounds_n_per_m: tuple[float, float] | None = figure(
        "The secant by RS-BTLS with the deformation less and more by that.",
        "δ ± (δ_Δ + √MSDE)",
    )
    touch_secant_n_per_m: float | None = figure(
        "Secant from the fitted touch, or from the zero of the curve.", "zero fitted"
    )
    interval_n_per_m: tuple[float, float] | None = figure("Its 95 % interval.", "95 %")
    touch_secant_change: Change = figure(
        "Change of the touch secant relative to the first row.", "to the first"
    )


@dataclass(frozen=True, slots=True)
class Side:
    """One run or curve: its RS-BTLS fit, None where the data refuse one, and its bounds.

    `deformation_m`, `force_n` (N,) are points from the fitted zero, `law` the line through
    them, `ends` the lines between which 95 % lie; empty where no errors are known.
    """

    name: str
    payload: str | None
    fit: Fit | None
    bound_m: float | None
    touch_secant_n_per_m: float | None
    interval_n_per_m: tuple[float, float] | None
    deformation_m: FloatArray
    force_n: FloatArray
    law: Loading
    ends: tuple[Loading, ...]
    secant_change: float | None = None
    touch_secant_change: float | None = None

    @property
    def secant_n_per_m(self) -> float | None:
        """The secant (28) of the fit."""
        return None if self.fit is None else self.fit.secant_n_per_m

    @property
    def bounds_n_per_m(self) -> tuple[float, float] | None:
        """The secant with the deformation less and more by the bound."""
        if self.fit is None or self.bound_m is None:
            return None
        return _secants(self.fit.secant_force_n, self.fit.secant_n_per_m, self.bound_m)


def _secants(force_n: float, secant_n_per_m: float, half_m: float) -> tuple[float, float]:
    """A secant with its deformation more and less by `half_m`."""
    own_m = force_n / secant_n_per_m
    return force_n / (own_m + half_m), force_n / (own_m - half_m) if own_m > half_m else math.inf


def sides(found: Comparison) -> list[Side]:
    """Every run and curve of a comparison, in this order; curves corrected to the first run."""
    listed = [*_of_runs(found), *_of_curves(found)]
    first = listed[0]
    return [first, *(replace(
        each,
        secant_change=_change(each.secant_n_per_m, first.secant_n_per_m),
        touch_secant_change=_change(each.touch_secant_n_per_m, first.touch_secant_n_per_m),
    ) for each in listed[1:])]  # fmt: skip


def _change(value: float | None, first: float | None) -> float | None:
    return value / first - 1.0 if value and first else None


def _of_runs(found: Comparison) -> Iterator[Side]:
    for each in found.runs:
        result, conditions = each.found, each.found.conditions
        fit, own = result.fit, result.quantities.get("secant_from_touch")
        bound_m = conditions.position_resolution_m + conditions.sources.smooth_error_m
        law_n = np.linspace(0.0, result.peak_force_n, 121)[1:]
        law = Loading((law_n / fit.k) ** (1.0 / fit.n), law_n)
        at_m, *ends_n = law_band(result) or (law_n,)
        yield Side(
            each.run.name, each.run.metadata.get("payload") or None, result.fits.get("rs_btls"),
            bound_m if math.isfinite(bound_m) else None,
            None if own is None else own.value_n_per_m,
            None if own is None else own.interval_n_per_m,
            result.deformation_m - fit.zero_m, result.force_n, law,
            tuple(Loading(at_m - fit.zero_m, end_n) for end_n in ends_n),
        )  # fmt: skip


def _of_curves(found: Comparison) -> Iterator[Side]:
    at_n = found.secant_force_n
    for each in found.given:
        all_m, all_n = each.loading(correction_for(found.runs[0], each) if found.runs else 1.0)
        keep = np.flatnonzero(all_n <= (1.0 + SAME_FORCE) * at_n)
        keep = keep[uniform_in_force(all_n[keep])]
        used, half_m = Loading(all_m[keep], all_n[keep]), NORMAL_95 * each.sigma_m
        try:
            fit = rs_btls(*used, secant_force_n=at_n)
        except DomainError:
            fit = None
        secant = at_n / used.deformation_at(at_n) if used.has(at_n) else None
        order = np.argsort(used.force_n, kind="stable")
        law = Loading(used.deformation_m[order], used.force_n[order])
        ends_m = (law.deformation_m - half_m, law.deformation_m + half_m) if half_m else ()
        yield Side(
            each.name, each.payload or None, fit,
            each.resolution_m + each.msde_m if half_m else None, secant,
            _secants(at_n, secant, half_m) if secant and half_m else None,
            *used, law, tuple(Loading(end_m, law.force_n) for end_m in ends_m),
        )  # fmt: skip


def table_one(found: Comparison) -> Table:
    """K, n, secant by fit as in the paper's Table I, and the chord: one row for every run, as test
    1, 2 … of its payload."""
    columns = ["payload", "test", "run"]
    for name in COLUMNS.values():
        columns += [f"{name}: K [N/mⁿ]", "n", "secant [N/m]"]
    columns += ["chord [N/m]", "95 % interval"]
    rows, names = list[list[str]](), list[str]()
    for place, each in enumerate(found.runs):
        names.append(each.run.metadata.get("payload", "") or NOTHING)
        row = [names[-1], f"{names.count(names[-1])}", each.run.name]
        for fit in map(each.found.fits.get, COLUMNS):
            row += [NOTHING] * 3 if fit is None else [
                power_of_ten(fit.k), f"{fit.n:.2f}", power_of_ten(fit.secant_n_per_m)
            ]  # fmt: skip
        chord = [NOTHING] * 2
        if found.chords:
            low, high = map(power_of_ten, found.chords[place].interval_n_per_m)
            chord = [power_of_ten(found.chords[place].value_n_per_m), f"[{low}, {high}]"]
        rows.append([*row, *chord])
    if len(set(names)) == 1:
        columns, rows = columns[1:], [row[1:] for row in rows]
    at = f(found.secant_force_n, "N")
    notes = [f"Secants (28) at {at}; K and n are not to be read apart: K carries the unit of n."]
    title = "Results side by side, as Table I of the paper"
    return Table(title, columns, rows, notes, page_only=True)


def table_two(listed: list[Side], at_n: float) -> list[Table]:
    """Table II of these runs and curves, and their bounds."""
    at = f(at_n, "N")
    of = f"A change is relative to {listed[0].name}, the first."
    notes = [
        "RS-BTLS takes the zero of the deformation as given: the touch of a run.",
        f"{of} K and n are not to be read apart: K carries the unit of n.",
    ]
    return [
        table(f"Results at {at}, as Table II of the paper", ResultRow, listed, notes),
        table(f"Bounds of the secant at {at}", BoundsRow, listed, [of]),
    ]


def table_two_csv(found: Comparison) -> str:
    """Table II and the bounds as CSV, one line for each run and curve."""
    rows = []
    for each in sides(found):
        row = data(ResultRow, each) | data(BoundsRow, each)
        for key in ("bounds_n_per_m", "interval_n_per_m"):
            row[f"{key}_low"], row[f"{key}_high"] = row.pop(key) or (None, None)
        rows.append(row)
    file = io.StringIO()
    writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return file.getvalue()


def overlay(listed: list[Side]) -> str:
    """All runs and curves over each other from their zeros, as Figs. 8–13 of the paper.

    Shaded: δ ± (δ_Δ + √MSDE). Dashed: 95 %.
    """
    total = sum(each.force_n.size for each in listed)
    with figures.figure_of(4.2) as (figure, (axes,)):
        for index, each in enumerate(listed):
            colour, step = figures.colour(index), max(1, total // figures.MOST_DOTS)
            axes.plot(each.deformation_m[::step] * 1e6, each.force_n[::step], ".", color=colour,
                      ms=2.0)  # fmt: skip
            law_m, law_n = each.law
            axes.plot(law_m * 1e6, law_n, color=colour, label=figures.plain(each.name))
            if (bound_m := each.bound_m) is not None:
                axes.fill_betweenx(law_n, (law_m - bound_m) * 1e6, (law_m + bound_m) * 1e6,
                                   color=colour, alpha=0.15, lw=0.0)  # fmt: skip
            for end_m, end_n in each.ends:
                axes.plot(end_m * 1e6, end_n, "--", color=colour, lw=0.7)
        axes.set(xlabel="payload deformation from its zero [µm]", ylabel="force [N]")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        if len(listed) <= figures.MOST_NAMES:
            axes.legend(loc="best", fontsize=8)
        return figures.svg_of(figure)
