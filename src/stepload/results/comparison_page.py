"""Composes the page of a comparison."""

from __future__ import annotations

from stepload.identify.compare import Spread
from stepload.identify.identification import REPORTED
from stepload.results import comparison_figures as figures
from stepload.results.comparison import ComparedRun, Comparison, virgin_band
from stepload.results.html import Card, Figure, Page, Table
from stepload.results.run_page import interval
from stepload.units import format_quantity as f

DISAGREE = 1.0
"""Normalised error above which two results disagree."""


def fit_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Every reported fit of every run: run, fit, K, n, secant, interval."""
    rows: list[tuple[str, ...]] = []
    for each in found.runs:
        for name in dict.fromkeys((*REPORTED, each.found.believe)):
            if (fit := each.found.fits.get(name)) is None:
                continue
            stated = each.found.budgets.get(name)
            rows.append(
                (
                    each.run.name,
                    f"{name} *" if name == each.found.believe else name,
                    f"{fit.k:.3g}",
                    f"{fit.n:.3f}",
                    f(fit.secant_n_per_m, "N/m"),
                    interval(*stated.interval_secant_n_per_m, "N/m") if stated else "–",
                )
            )
    return rows


def pair_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Every later run against the first: runs, fit, change of secant and n, ratio of K, En."""
    rows: list[tuple[str, ...]] = []
    for pair in found.pairs:
        error = pair.change.normalised_error
        verdict = "" if error is None else ", disagree" if error > DISAGREE else ", agree"
        rows.append(
            (
                f"{pair.first} → {pair.second}",
                pair.estimator,
                f"{pair.change.secant_change:+.1%}",
                f"{pair.change.n_change:+.3f}",
                f"{pair.change.k_ratio:.3g}",
                "–" if error is None else f"{error:.2f}{verdict}",
            )
        )
    return rows


def spread_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Spread of secant and exponent per fit: mean, within a run, between runs, odds."""
    rows: list[tuple[str, ...]] = []
    for name, each in found.spreads.items():
        rows.append((name, "secant", f(each.secant.mean, "N/m"), *_spread(each.secant, True)))
        rows.append((name, "n", f"{each.n.mean:.3f}", *_spread(each.n, False)))
    return rows


def _spread(each: Spread, relative: bool) -> tuple[str, str, str]:
    def size(sd: float | None) -> str:
        if sd is None:
            return "–"
        return f"{sd / each.mean:.2%}" if relative else f"{sd:.4f}"

    odds = "–" if each.p_value is None else f"{each.p_value:.2g}"
    return size(each.within_sd), size(each.between_sd), odds


def curve_rows(found: Comparison) -> list[tuple[str, ...]]:
    """Every run against the curve: run, fit, share inside the band, rms differences, secant."""
    return [
        (
            each.run,
            each.estimator,
            f"{each.result.inside_share:.0%}",
            f(each.result.force_rms_n, "N"),
            f(each.result.deformation_rms_m, "m"),
            "–" if each.result.secant_change is None else f"{each.result.secant_change:+.1%}",
        )
        for each in found.curve
    ]


FIT_COLUMNS = ("run", "fit", "K [N/mⁿ]", "n", "secant", "95 % interval")
PAIR_COLUMNS = ("runs", "fit", "secant changes", "n changes", "ratio of K", "normalised error")
SPREAD_COLUMNS = ("fit", "of", "mean", "within a run", "between runs", "odds if alike")
CURVE_COLUMNS = ("run", "fit", "inside the band", "rms force", "rms deformation", "secant")


def headline(found: Comparison) -> tuple[str, str, str]:
    """(mood, verdict, headline) of a comparison."""
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
        return ("bad", "disagree", text) if worst > DISAGREE else ("good", "agree", text)
    if found.curve:
        least = min(found.curve, key=lambda each: each.result.inside_share)
        share = least.result.inside_share
        text = f"{share:.0%} of the curve lies inside the 95 % band of {least.estimator}"
        mood, verdict = ("good", "agree") if share >= 0.95 else ("doubt", "differs")
        return mood, verdict, text
    return "doubt", "compared", "There is no interval to judge the difference by"


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
                "force over deformation with confidence bands", figures.bands(laws, imported),
            )
        )  # fmt: skip
    made.append(
        Figure(
            "secants", f"Secant stiffness at {f(found.secant_force_n, 'N')}",
            "Believed fit with its 95 % interval; small marks are the cycles by themselves. The "
            "interval holds what all runs have in common, the marks do not.",
            "secant stiffness of every run with intervals",
            figures.secants([_secant(each) for each in found.runs]),
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


def compose(found: Comparison) -> Page:
    """The page of a comparison."""
    mood, verdict, text = headline(found)
    tables = [Table("Fits of the virgin contact (* believed)", FIT_COLUMNS, fit_rows(found))]
    if found.pairs:
        tables.append(
            Table(
                "Against the first run", PAIR_COLUMNS, pair_rows(found),
                "The normalised error is the difference of the secants over its 95 % uncertainty; "
                "what both runs have in common is taken out.",
            )
        )  # fmt: skip
    if found.spreads:
        tables.append(Table("Spread", SPREAD_COLUMNS, spread_rows(found)))
    if found.curve:
        tables.append(Table("Against the curve", CURVE_COLUMNS, curve_rows(found)))
    return Page(
        title="Comparison",
        subtitle=" · ".join(each.run.name for each in found.runs),
        mood=mood,
        verdict=verdict,
        headline=text,
        reasons=found.notes,
        stopped="",
        cards=[
            Card(each.run.name, f(each.found.fit.secant_n_per_m, "N/m"), f"by {each.found.believe}")
            for each in found.runs
        ],
        figures=_figures(found),
        tables=tables,
    )
