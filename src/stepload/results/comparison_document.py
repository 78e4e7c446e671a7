"""A comparison as a document for people and as an object for programs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

import stepload
from stepload.identification.difference import Agreement, Difference, DifferenceLine
from stepload.results import fields, figures
from stepload.results.certificate import few, shared_facts
from stepload.results.comparison import Comparison
from stepload.results.comparison_curve import AgainstCurve
from stepload.results.data import fits_data
from stepload.results.model import (
    NOTHING,
    Certificate,
    Document,
    Field,
    Figure,
    Mood,
    Table,
    Verdict,
    data,
    first_rows,
    named,
    quantity,
    table,
)
from stepload.results.provenance import runs_table
from stepload.units import change, changes, percent
from stepload.units import format_quantity as f

LONGEST_TITLE = 200
NAMES = {
    "chord": "chord stiffness",
    "unloading_chord": "chord stiffness of the unloading",
    "reloading_chord": "chord stiffness of the reloading",
    "secant_from_touch": "secant stiffness",
}
"""Displayed name of what is compared."""
COLUMNS = {"rs_btls": "RS-BTLS", "rs_rtls": "RS-RTLS"}
"""The paper's two estimators; the table shows the chord as well."""
_MOODS: dict[Agreement, Mood] = {
    Agreement.AGREE: "good",
    Agreement.DIFFER: "bad",
    Agreement.CANNOT_TELL: "doubt",
}


def _part(of: str, name: str, key: str, label: str, show: Any) -> Field[AgainstCurve]:
    """A figure of the difference of a curve from a run's chord or secant."""

    def value(row: AgainstCurve) -> Any:
        part = getattr(row, of)
        return None if part is None else getattr(part, name)

    return Field(value, key, label, show)


CURVE: tuple[Field[AgainstCurve], ...] = (
    named("run", "run"),
    Field(lambda row: row.from_n, "chord_from_n", "chord from", quantity("N")),
    Field(lambda row: row.to_n, "secant_force_n", "to", quantity("N")),
    _part("chord", "relative", "chord_change", "chord", change),
    _part("chord", "interval", "chord_interval", "95 % interval", changes),
    _part("secant", "relative", "secant_change", "secant", change),
    _part("secant", "interval", "secant_interval", "95 % interval", changes),
    _part("judged", "smallest_detectable", "smallest_detectable", "could show", percent),
    named("verdict", "verdict"),
    named("secant_n_per_m"),
    *map(named, ("estimator", "force_rms_n", "deformation_rms_m", "correction")),
    Field(lambda row: len(row.force_n), "points"),
    Field(lambda row: row.left_out, "points_beyond"),
)  # fmt: skip
_two_digits = partial(percent, digits=2)
DIFFERENCE_LINE: tuple[Field[DifferenceLine], ...] = (
    named("source", "source"),
    named("first", "group 1", _two_digits),
    named("second", "group 2", _two_digits),
    named("common", "shared"),
    named("left", "in all", _two_digits),
)
DIFFERENCE: tuple[Field[Difference], ...] = (
    Field(lambda each: " + ".join(each.first), label="group 1"),
    Field(lambda each: " + ".join(each.second), label="group 2"),
    Field(lambda each: NAMES[each.kind], "quantity", "of"),
    Field(lambda each: each.from_n or None, label="from", show=quantity("N")),
    named("from_n"),
    named("to_n", "to", quantity("N")),
    *map(named, ("first", "second")),
    named("relative", "2 against 1", change),
    named("interval", "95 % interval", changes),
    named("smallest_detectable", "could show", percent),
    named("tolerance"),
    named("verdict", "verdict"),
    *map(named, ("why", "scatter", "scatter_degrees", "scatter_expected", "open_sources")),
    Field(lambda each: [data(DIFFERENCE_LINE, line) for line in each.lines], "lines"),
)


def comparison_document(found: Comparison) -> Document:
    """A comparison for people."""
    tables = [_differences(found), table_one(found), *map(_difference_table, found.differences)]
    if found.curve:
        tables.append(table("Against the curve", CURVE, found.curve, correction_notes(found.curve)))
    reasons = [*_reasons(found), *found.notes]
    return Document(
        title="Comparison",
        subtitle=_named(found),
        verdict=verdict(found),
        reasons=reasons,
        tables=[*tables, runs_table([each.run for each in found.runs])],
        figures=_chords(found),
        simulated=any(each.run.simulated for each in found.runs),
        certificate=_sheet(found, reasons),
    )


def _named(found: Comparison) -> str:
    """The groups by the names of their runs, shortened if there are many."""
    groups = [" + ".join(found.runs[place].run.name for place in group) for group in found.groups]
    text = " against ".join(groups)
    return text if len(text) <= LONGEST_TITLE else f"{text[: LONGEST_TITLE - 1]}…"


def _differences(found: Comparison) -> Table:
    return table("Differences", DIFFERENCE, found.differences)


def _difference_table(each: Difference) -> Table:
    notes = [
        "Standard uncertainties: of a single run of each group, and of the difference.",
    ]
    if each.scatter is not None:
        expected = each.scatter_expected or 0.0
        notes.append(
            f"Runs of a group scatter by {percent(each.scatter)} ({each.scatter_degrees} degrees of"
            f" freedom); their own errors explain {percent(expected)}."
        )
    span = f"{f(each.from_n, 'N')} to {f(each.to_n, 'N')}"
    title = f"Difference of {NAMES[each.kind]}, {span}: {len(each.first)} against "
    rows = [line for line in each.lines if line.left or line.first or line.second]
    return table(f"{title}{len(each.second)}", DIFFERENCE_LINE, rows, notes)


def _reasons(found: Comparison) -> list[str]:
    """Every difference as a sentence, if there is more than one."""
    if len(found.differences) < 2:
        return []
    return [f"{' + '.join(each.second)}: {each.verdict}, {each.why}" for each in found.differences]


def table_one(found: Comparison) -> Table:
    """K, n, secant by fit as in the paper's Table I, and the chord: one row for every run, as test
    1, 2 … of its payload; and one for the curve, corrected."""
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
    secants = dict.fromkeys(
        f"secant {power_of_ten(each.secant_n_per_m)} at {f(each.to_n, 'N')}"
        for each in found.curve
        if each.secant_n_per_m is not None
    )
    left = [NOTHING] * (len(columns) - 4)
    rows += [[NOTHING, NOTHING, "imported curve", *left[:-1], NOTHING, each] for each in secants]
    if len(set(names)) == 1:
        columns, rows = columns[1:], [row[1:] for row in rows]
    at = f(found.secant_force_n, "N")
    notes = [f"Secants (28) at {at}; K and n are not to be read apart: K carries the unit of n."]
    title = "Results side by side, as Table I of the paper"
    return Table(title, columns, rows, [*notes, *correction_notes(found.curve)], page_only=True)


def power_of_ten(value: float) -> str:
    """A number as the paper prints it: 4.80e6."""
    return re.sub(r"e\+?(-?)0*(\d)", r"e\1\2", f"{value:.2e}")


def correction_notes(curve: Sequence[AgainstCurve]) -> list[str]:
    """The factors by which the forces of the curve were multiplied; nothing where they were not."""
    factors = {f"{each.correction:.4f}" for each in curve if each.correction != 1.0}
    return [
        f"The curve's forces are multiplied by {factor}, the ratio of the equivalent moduli (4): "
        "its secant, its chord and the picture are those of the corrected curve."
        for factor in sorted(factors)
    ]


def _chords(found: Comparison) -> list[Figure]:
    """The chord of every run with its interval."""
    if not found.chords:
        return []
    rows = [
        (each.run.name, chord.value_n_per_m, *chord.interval_n_per_m)
        for each, chord in zip(found.runs, found.chords, strict=True)
    ]
    spans = f"{f(found.chords[0].from_n, 'N')} to {f(found.chords[0].to_n, 'N')}"
    return [
        Figure(
            "chords", f"Chord stiffness, {spans}",
            "With its 95 % interval, which holds what all runs have in common.",
            "chord stiffness of every run with intervals",
            partial(figures.intervals, rows, "chord stiffness [N/µm]"),
        )
    ]  # fmt: skip


def _laws(found: Comparison) -> str:
    """Measured points with the selected fits, and an imported curve as larger points."""
    lines = list[figures.Line]()
    total = sum(each.found.force_n.size for each in found.runs)
    for index, each in enumerate(found.runs):
        fit, force_n = each.found.fit, each.found.force_n
        colour, step = figures.colour(index), max(1, total // figures.MOST_DOTS)
        deformation_m = (each.found.deformation_m - fit.zero_m)[::step]
        lines.append((deformation_m * 1e6, force_n[::step], ".", {"color": colour, "ms": 2.0}))
        law_n = np.linspace(0.0, each.found.peak_force_n, 121)
        style = {"color": colour, "label": figures.plain(each.run.name)}
        lines.append(((law_n / fit.k) ** (1.0 / fit.n) * 1e6, law_n, "-", style))
    if found.curve:
        x, y = found.curve[0].deformation_m * 1e6, found.curve[0].force_n
        lines.append((x, y, ".", {"color": figures.INK, "ms": 5.0, "label": "imported curve"}))
    axes = "payload deformation from its zero [µm]", "force [N]"
    return figures.lines(lines, *axes, height=3.8, legend=len(found.runs) <= figures.MOST_NAMES)


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
                "selected": each.found.selected,
                "fits": fits_data(fields.fits_of(each.found)),
                "interval_secant_n_per_m": each.found.interval_secant_n_per_m,
            }
            for each in found.runs
        ],
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
        of = "" if len(found.groups) == 2 else f" of {' + '.join(worst.second)}"
    elif len(found.runs) == 1 and (judged := found.curve[0].judged) is not None:
        worst, of = judged, " of the curve"
    else:
        text = "The runs have no chord between common forces"
        return Verdict("doubt", Agreement.CANNOT_TELL.value, text)
    told = f"{NAMES[worst.kind].capitalize()}{of}: {worst.why}"
    return Verdict(_MOODS[worst.verdict], worst.verdict.value, told)


def _gravity(each: Difference) -> tuple[int, float]:
    order = (Agreement.AGREE, Agreement.CANNOT_TELL, Agreement.DIFFER)
    return order.index(each.verdict), abs(each.relative) / max(each.half_width, 1e-12)


def _sheet(found: Comparison, reasons: Sequence[str]) -> Certificate:
    """The sheet of a comparison."""
    runs = [each.run for each in found.runs]
    tables = [_differences(found), table_one(found)]
    corrected = any(each.correction != 1.0 for each in found.curve)
    imported = "; the curve is corrected for its modulus." if corrected else "."
    return Certificate(
        heading="Comparison of contact stiffness",
        facts=(
            [
                *shared_facts(runs, "payload", "specimen", "batch", "plan"),
                ("Compared", f"{len(runs)} runs in {len(found.groups)} groups"),
                ("Tolerance", f"{percent(found.tolerance)} of the stiffness"),
            ],
            shared_facts(runs, "rig", "arm", "force_sensor", "calibration", "operator", "day"),
        ),
        tables=[first_rows(each) for each in tables],
        figure=Figure(
            "laws", "Force against deformation",
            f"What was measured, each from its fitted zero, and the selected fits{imported}",
            "force over deformation of every run with its law", partial(_laws, found),
        ),
        remarks=few(reasons),
        signatures=(("Compared by", ""), ("Checked by", "")),
        foot=f"stepload {stepload.__version__} · comparison of {len(runs)} runs",
    )  # fmt: skip
