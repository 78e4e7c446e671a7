"""A comparison for people and for programs."""

from __future__ import annotations

from typing import Any

from stepload.identify.compare import Spread
from stepload.results import fields
from stepload.results.comparison import AgainstCurve, Comparison, Pair
from stepload.results.comparison_figures import figures_of
from stepload.results.data import fits_data
from stepload.results.model import (
    NOTHING,
    Card,
    Document,
    Field,
    Table,
    Verdict,
    by_name,
    data,
    named,
    number,
    quantity,
    table,
)
from stepload.units import format_quantity as f

DISAGREE = 1.0
"""Normalised error above which two results disagree."""


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
    fits = [(each.run.name, row) for each in found.runs for row in fields.fits_of(each.found)]
    shown = [field for field in fields.FIT if field.label != "rms residual"]
    title = f"Fits of the virgin contact (* believed), secants at {at}"
    tables = [table(title, by_name("run", shown), fits)]
    if found.pairs:
        note = (
            "The normalised error is the difference of the secants over its 95 % uncertainty; "
            "what both runs have in common is taken out."
        )
        tables.append(table("Against the first run", PAIR, found.pairs, [note]))
    if found.spreads:
        tables.append(_spread_table(found))
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
        figures=figures_of(found),
    )


def _spread_table(found: Comparison) -> Table:
    def row(name: str, of: str, each: Spread) -> tuple[str, ...]:
        def size(sd: float | None) -> str:
            if sd is None:
                return NOTHING
            return f"{sd:.4f}" if of == "n" else f"{sd / each.mean:.2%}"

        mean = f"{each.mean:.3f}" if of == "n" else f(each.mean, "N/m")
        odds = NOTHING if each.p_value is None else f"{each.p_value:.2g}"
        return name, of, mean, size(each.within_sd), size(each.between_sd), odds

    columns = ("fit", "of", "mean", "within a run", "between runs", "odds if alike")
    rows = [
        row(name, of, value)
        for name, each in found.spreads.items()
        for of, value in (("secant", each.secant), ("n", each.n))
    ]
    return Table("Spread", columns, rows)


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
