"""A comparison for people and for programs."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

from stepload.identify.compare import Spread
from stepload.results import comparison_figures as figures
from stepload.results import fields
from stepload.results.comparison import AgainstCurve, ComparedRun, Comparison, Pair, virgin_band
from stepload.results.data import fits_data
from stepload.results.model import (
    Card,
    Document,
    Field,
    Figure,
    Verdict,
    data,
    named,
    number,
    quantity,
    table,
)
from stepload.units import format_quantity as f

DISAGREE = 1.0
"""Normalised error above which two results disagree."""


class _RunFit(NamedTuple):
    run: str
    fit: fields.NamedFit


class _SpreadOf(NamedTuple):
    estimator: str
    of: str
    spread: Spread


FIT: tuple[Field[_RunFit], ...] = (
    Field(lambda row: row.run, label="run"),
    *(field.of(lambda row: row.fit) for field in fields.FIT if field.key != "force_rms_n"),
)


def _error(error: float) -> str:
    return f"{error:.2f}, {'disagree' if error > DISAGREE else 'agree'}"


PAIR: tuple[Field[Pair], ...] = (
    Field(lambda pair: f"{pair.first} → {pair.second}", label="runs"),
    Field(lambda pair: pair.estimator, label="fit"),
    Field(lambda pair: pair.change.secant_change, "", "secant changes", number("+.1%")),
    Field(lambda pair: pair.change.n_change, "", "n changes", number("+.3f")),
    Field(lambda pair: pair.change.k_ratio, "", "ratio of K", number(".3g")),
    Field(lambda pair: pair.change.normalised_error, "", "normalised error", _error),
)


def _deviation(row: _SpreadOf, sd: float | None) -> str | None:
    if sd is None:
        return None
    return f"{sd:.4f}" if row.of == "n" else f"{sd / row.spread.mean:.2%}"


SPREAD: tuple[Field[_SpreadOf], ...] = (
    Field(lambda row: row.estimator, label="fit"),
    Field(lambda row: row.of, label="of"),
    Field(
        lambda row: f"{row.spread.mean:.3f}" if row.of == "n" else f(row.spread.mean, "N/m"),
        label="mean",
    ),
    Field(lambda row: _deviation(row, row.spread.within_sd), label="within a run"),
    Field(lambda row: _deviation(row, row.spread.between_sd), label="between runs"),
    Field(lambda row: row.spread.p_value, "", "odds if alike", number(".2g")),
)

CURVE: tuple[Field[AgainstCurve], ...] = (
    named("run", "run"),
    named("estimator", "fit"),
    Field(lambda row: row.result.inside_share, "inside_share", "inside the band", number(".0%")),
    Field(lambda row: row.result.force_rms_n, "force_rms_n", "rms force", quantity("N")),
    Field(
        lambda row: row.result.deformation_rms_m,
        "deformation_rms_m", "rms deformation", quantity("m"),
    ),
    Field(lambda row: row.result.secant_change, "secant_change", "secant", number("+.1%")),
    Field(lambda row: len(row.result.curve_n), "points"),
)  # fmt: skip


def comparison_document(found: Comparison) -> Document:
    """A comparison for people."""
    at = f(found.secant_force_n, "N")
    fits = [
        _RunFit(each.run.name, row) for each in found.runs for row in fields.fits_of(each.found)
    ]
    spreads = [
        row
        for name, each in found.spreads.items()
        for row in (_SpreadOf(name, "secant", each.secant), _SpreadOf(name, "n", each.n))
    ]
    tables = [table(f"Fits of the virgin contact (* believed), secants at {at}", FIT, fits)]
    if found.pairs:
        note = (
            "The normalised error is the difference of the secants over its 95 % uncertainty; "
            "what both runs have in common is taken out."
        )
        tables.append(table("Against the first run", PAIR, found.pairs, [note]))
    if spreads:
        tables.append(table("Spread", SPREAD, spreads))
    if found.curve:
        tables.append(table("Against the curve", CURVE, found.curve))
    return Document(
        title="Comparison",
        subtitle=" · ".join(each.run.name for each in found.runs),
        verdict=verdict(found),
        reasons=found.notes,
        tables=tables,
        cards=[
            Card(each.run.name, f(each.found.fit.secant_n_per_m, "N/m"), f"by {each.found.believe}")
            for each in found.runs
        ],
        figures=_figures(found),
    )


def comparison_data(found: Comparison) -> dict[str, Any]:
    """A comparison for programs."""
    judged = verdict(found)
    return {
        "verdict": judged.word,
        "headline": judged.text,
        "secant_force_n": found.secant_force_n,
        "runs": [
            {
                "name": each.run.name,
                "path": each.run.path,
                "payload": each.run.metadata.get("payload"),
                "rig": each.run.metadata.get("rig"),
                "believe": each.found.believe,
                "fits": fits_data(fields.fits_of(each.found)),
                "cycles": [
                    {"cycle": number}
                    | {
                        name: {"n": fit.n, "secant_n_per_m": fit.secant_n_per_m}
                        for name, fit in fits.items()
                    }
                    for number, fits in each.cycles.items()
                ],
            }
            for each in found.runs
        ],
        "spread": found.spreads,
        "pairs": found.pairs,
        "curve": [data(CURVE, each) for each in found.curve],
        "notes": found.notes,
    }


def verdict(found: Comparison) -> Verdict:
    """Whether what was compared agrees."""
    believed = {each.run.name: each.found.believe for each in found.runs}
    errors = [
        (pair, pair.change.normalised_error)
        for pair in found.pairs
        if believed.get(pair.second) == pair.estimator and pair.change.normalised_error is not None
    ]
    if errors:
        pair, worst = max(errors, key=lambda item: item[1])
        text = (
            f"Secants of {pair.estimator} differ by {pair.change.secant_change:+.1%}, normalised "
            f"error {worst:.2f} (above 1 they disagree)"
        )
        if worst > DISAGREE:
            return Verdict("bad", "disagree", text)
        return Verdict("good", "agree", text)
    if found.curve:
        least = min(found.curve, key=lambda each: each.result.inside_share)
        share = least.result.inside_share
        text = f"{share:.0%} of the curve lies inside the 95 % band of {least.estimator}"
        if share >= 0.95:
            return Verdict("good", "agree", text)
        return Verdict("doubt", "differs", text)
    return Verdict("doubt", "compared", "There is no interval to judge the difference by")


def _figures(found: Comparison) -> list[Figure]:
    laws = {
        each.run.name: figures.BandCurve(
            band.deformation_m, band.force_n, band.lower_n, band.upper_n
        )
        for each in found.runs
        if (band := virgin_band(each)) is not None
    }
    made = []
    imported = None
    if found.curve:
        first = found.curve[0].result
        imported = first.band.deformation_m, first.curve_n
    if laws:
        made.append(
            Figure(
                "laws", "Force against deformation",
                "Believed law of every run from its own zero, with its pointwise 95 % band"
                + ("; the imported curve is corrected for its modulus." if imported else "."),
                "force over deformation with confidence bands",
                partial(figures.bands, laws, imported),
            )
        )  # fmt: skip
    made.append(
        Figure(
            "secants", f"Secant stiffness at {f(found.secant_force_n, 'N')}",
            "Believed fit with its 95 % interval; small marks are the cycles by themselves. The "
            "interval holds what all runs have in common, the marks do not.",
            "secant stiffness of every run with intervals",
            partial(figures.secants, [_secant(each) for each in found.runs]),
        )
    )  # fmt: skip
    return made


def _secant(each: ComparedRun) -> figures.SecantPoint:
    name, stated = each.found.believe, each.found.budget
    return figures.SecantPoint(
        each.run.name,
        each.found.fit.secant_n_per_m,
        stated.interval_secant_n_per_m if stated else None,
        [fits[name].secant_n_per_m for fits in each.cycles.values() if name in fits],
    )
