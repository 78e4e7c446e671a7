"""A comparison as a document for people and as an object for programs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from stepload.estimators.compare import Spread
from stepload.estimators.difference import Agreement, Difference, DifferenceLine
from stepload.results import fields
from stepload.results.comparison import AgainstCurve, Comparison, Pair
from stepload.results.comparison_figures import LAWS, figures_of
from stepload.results.comparison_notes import REACHED
from stepload.results.comparison_sheet import comparison_sheet
from stepload.results.data import fits_data
from stepload.results.equations import equation_table
from stepload.results.model import (
    NOTHING,
    Card,
    Document,
    Field,
    Mood,
    Table,
    Verdict,
    by_name,
    data,
    named,
    number,
    quantity,
    table,
)
from stepload.results.provenance import runs_table
from stepload.results.table_one import correction_notes, table_one
from stepload.units import format_quantity as f

LONGEST_TITLE = 200
DISAGREE = 1.0
"""Normalised error above which two results disagree."""

_MOODS: dict[Agreement, Mood] = {
    Agreement.AGREE: "good",
    Agreement.DIFFER: "bad",
    Agreement.CANNOT_TELL: "doubt",
}


def _error(error: float) -> str:
    return f"{error:.2f}, differ" if error > DISAGREE else f"{error:.2f}"


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
    Field(lambda row: row.result.to_n, "secant_force_n", "at", quantity("N")),
    named("secant_n_per_m"),
    Field(lambda row: row.result.chord_change, "chord_change", "chord", number("+.1%")),
    Field(lambda row: row.result.from_n, "chord_from_n", "from", quantity("N")),
    Field(lambda row: row.smallest_detectable, "smallest_detectable", "could show",
          number(".1%")),
    Field(lambda row: row.verdict, "verdict", "verdict"),
    Field(lambda row: len(row.result.curve_n), "points"),
    Field(lambda row: row.result.left_out, "points_beyond"),
    named("correction"),
)  # fmt: skip

DIFFERENCE_LINE: tuple[Field[DifferenceLine], ...] = (
    named("source", "source"),
    named("first", "group 1", number(".2%")),
    named("second", "group 2", number(".2%")),
    named("common", "shared"),
    named("own", "own", number(".2%")),
    named("shared", "not cancelled", number(".2%")),
    named("left", "in all", number(".2%")),
)
DIFFERENCE: tuple[Field[Difference], ...] = (
    *map(named, ("quantity", "from_n", "to_n", "first", "second", "relative", "interval")),
    *map(named, ("smallest_detectable", "tolerance", "verdict", "why")),
    *map(named, ("scatter", "scatter_degrees", "scatter_expected", "open_sources")),
    Field(lambda each: [data(DIFFERENCE_LINE, line) for line in each.lines], "lines"),
)  # fmt: skip


def comparison_document(found: Comparison) -> Document:
    """A comparison for people."""
    at = f(found.secant_force_n, "N")
    fits = [(each.run.name, row) for each in found.runs for row in fields.fits_of(each.found)]
    shown = [field for field in fields.FIT if field.label != "rms residual"]
    title = f"Fits of the virgin contact (* believed), secants at {at}"
    tables = [table_one(found), table(title, by_name("run", shown), fits)]
    tables += [_difference_table(each) for each in found.differences]
    if found.pairs:
        note = (
            "The normalised error is the difference of the secants over half the width of its 95 % "
            "interval; what both runs have in common cancels in it. Above 1 the two differ; below, "
            "two runs by themselves do not show a difference, which more of them may."
        )
        tables.append(table("Against the first run", PAIR, found.pairs, [note]))
    if found.spreads:
        tables.append(_spread_table(found))
    if found.curve:
        tables.append(table("Against the curve", CURVE, found.curve, correction_notes(found.curve)))
    judged, pictures = verdict(found), figures_of(found)
    reasons = [*_reasons(found), *found.notes]
    laws = next((each for each in pictures if each.name == LAWS), None)
    document = Document(
        title="Comparison",
        subtitle=_named(found),
        verdict=judged,
        reasons=reasons,
        tables=tables,
        cards=[
            Card(each.run.name, f(each.found.fit.secant_n_per_m, "N/m"), f"by {each.found.believe}")
            for each in found.runs
        ],
        figures=[each for each in pictures if each is not laws],
        simulated=any(each.run.simulated for each in found.runs),
        certificate=comparison_sheet(found, reasons, laws),
    )
    runs = runs_table([each.run for each in found.runs])
    return replace(document, tables=[*document.tables, runs, equation_table(document)])


def _named(found: Comparison) -> str:
    """The groups by the names of their runs, shortened if there are many."""
    groups = [" + ".join(found.runs[place].run.name for place in group) for group in found.groups]
    text = " against ".join(groups)
    return text if len(text) <= LONGEST_TITLE else f"{text[: LONGEST_TITLE - 1]}…"


def _difference_table(each: Difference) -> Table:
    span = f"at {f(each.to_n, 'N')}" if each.from_n == 0.0 else (
        f"from {f(each.from_n, 'N')} to {f(each.to_n, 'N')}"
    )  # fmt: skip
    notes = [
        "Standard uncertainties: of a single run in each group, then what is left of them in the "
        "difference: of errors that each run has to itself, after averaging, and of shared ones, "
        "after cancelling.",
        f"Group 2 against group 1: {each.relative:+.2%}, 95 % interval "
        f"[{each.interval[0]:+.2%}, {each.interval[1]:+.2%}]. Smallest difference that these runs "
        f"could have shown (in 80 of 100 tries, at 5 % false alarms): "
        f"{each.smallest_detectable:.2%}.",
    ]
    if each.scatter is not None:
        expected = each.scatter_expected or 0.0
        notes.append(
            f"Runs of a group scatter by {each.scatter:.2%} ({each.scatter_degrees} degrees of "
            f"freedom); {expected:.2%} was expected of their own errors."
        )
    title = f"Difference of {each.quantity} {span}: {len(each.first)} against {len(each.second)}"
    return table(title, DIFFERENCE_LINE, [line for line in each.lines if line.left or line.first
                 or line.second], notes)  # fmt: skip


def _reasons(found: Comparison) -> list[str]:
    """Every difference as a sentence, if there is more than one."""
    if len(found.differences) < 2:
        return []
    return [f"{' + '.join(each.second)}: {each.verdict}, {each.why}" for each in found.differences]


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
        "simulated": any(each.run.simulated for each in found.runs),
        "verdict": _v1_word(found, judged),
        "headline": judged.text,
        "agreement": judged.word,
        "tolerance": found.tolerance,
        "groups": [[found.runs[place].run.name for place in group] for group in found.groups],
        "differences": [data(DIFFERENCE, each) for each in found.differences],
        "secant_force_n": found.secant_force_n,
        "runs": [
            {
                "name": each.run.name,
                "path": each.run.path,
                **{
                    key: each.run.metadata.get(key)
                    for key in ("run_id", "specimen", "payload", "rig")
                },
                "believe": each.found.believe,
                "fits": fits_data(fields.fits_of(each.found)),
                "interval_secant_n_per_m": each.found.interval_secant_n_per_m,
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


def _v1_word(found: Comparison, judged: Verdict) -> str:
    """The verdict by its name in version 1 of the schema."""
    if judged.word == Agreement.DIFFER:
        return "disagree" if found.differences else "differs"
    return judged.word


def verdict(found: Comparison) -> Verdict:
    """Whether the compared results agree: runs by their groups, else a run and the curve."""
    if found.differences:
        worst = max(found.differences, key=_gravity)
        told = (
            f"{worst.quantity.capitalize()} {worst.why}"
            if len(found.groups) == 2
            else f"{worst.quantity.capitalize()} of {' + '.join(worst.second)}: {worst.why}"
        )
        return Verdict(_MOODS[worst.verdict], worst.verdict.value, told)
    if found.curve and len(found.runs) == 1:
        each = found.curve[0]
        result, change = each.result, each.result.secant_change
        text = (
            f"{result.inside_share:.0%} of the curve lies inside the 95 % band of {each.estimator}"
        )
        if change is not None:
            text += (
                f"; secant at {f(result.to_n, 'N')} {change:+.1%}, smallest difference that this "
                f"run could have shown: {each.smallest_detectable:.1%}"
            )
        return Verdict(_MOODS[each.verdict], each.verdict.value, text)
    extrapolated = any(
        each.found.peak_force_n < REACHED * found.secant_force_n for each in found.runs
    )
    return Verdict(
        "doubt",
        Agreement.CANNOT_TELL.value,
        f"Not all runs have reached {f(found.secant_force_n, 'N')}"
        if extrapolated
        else "There is no interval to judge the difference by",
    )


def _gravity(each: Difference) -> tuple[int, float]:
    order = (Agreement.AGREE, Agreement.CANNOT_TELL, Agreement.DIFFER)
    return order.index(each.verdict), abs(each.relative) / max(each.half_width, 1e-12)
