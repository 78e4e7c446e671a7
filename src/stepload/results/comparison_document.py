"""A comparison as a document for people and as an object for programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import stepload
from stepload.evidence.difference import Agreement, Difference, DifferenceLine
from stepload.results import fields
from stepload.results.certificate import Facts, few, shared
from stepload.results.comparison import Comparison
from stepload.results.comparison_curve import AgainstCurve
from stepload.results.comparison_figures import LAWS, figures_of
from stepload.results.data import fits_data
from stepload.results.equations import equation_table
from stepload.results.model import (
    Card,
    Certificate,
    Document,
    Field,
    Figure,
    Mood,
    Table,
    Verdict,
    by_name,
    data,
    first_rows,
    interval,
    named,
    quantity,
    table,
)
from stepload.results.provenance import runs_table
from stepload.results.table_one import correction_notes, table_one
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

_MOODS: dict[Agreement, Mood] = {
    Agreement.AGREE: "good",
    Agreement.DIFFER: "bad",
    Agreement.CANNOT_TELL: "doubt",
}


_AGAINST: tuple[Field[Difference], ...] = (
    named("relative", "change", change),
    named("interval", "95 % interval", changes),
    named("smallest_detectable", "could show", percent),
    named("verdict", "verdict"),
)


def _part(of: str, field: Field[Difference], key: str = "", label: str = "") -> Field[Any]:
    """A field of the difference of a curve from a run's chord or secant."""
    part: Field[AgainstCurve] = field.of(lambda row: getattr(row, of))
    return replace(part, key=key, label=label)


CURVE: tuple[Field[AgainstCurve], ...] = (
    named("run", "run"),
    Field(lambda row: row.from_n, "chord_from_n", "chord from", quantity("N")),
    Field(lambda row: row.to_n, "secant_force_n", "to", quantity("N")),
    _part("chord", _AGAINST[0], "chord_change", "chord"),
    _part("chord", _AGAINST[1], "chord_interval", "95 % interval"),
    _part("secant", _AGAINST[0], "secant_change", "secant"),
    _part("secant", _AGAINST[1], "secant_interval", "95 % interval"),
    _part("judged", _AGAINST[2], "smallest_detectable", "could show"),
    named("verdict", "verdict"),
    named("secant_n_per_m"),
    *map(named, ("estimator", "force_rms_n", "deformation_rms_m", "correction")),
    Field(lambda row: len(row.force_n), "points"),
    Field(lambda row: row.left_out, "points_beyond"),
)  # fmt: skip


def _two_digits(share: float) -> str:
    return percent(share, 2)


DIFFERENCE_LINE: tuple[Field[DifferenceLine], ...] = (
    named("source", "source"),
    named("first", "group 1", _two_digits),
    named("second", "group 2", _two_digits),
    named("common", "shared"),
    named("left", "in all", _two_digits),
)
DIFFERENCE: tuple[Field[Difference], ...] = (
    Field(lambda each: NAMES[each.kind], "quantity"),
    *map(named, ("from_n", "to_n", "first", "second", "relative", "interval")),
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
            Card(
                each.run.name,
                f(chord.value_n_per_m, "N/m"),
                f"chord, 95 % {interval('N/m')(chord.interval_n_per_m)}",
            )
            for each, chord in zip(found.runs, found.chords, strict=False)
        ],
        figures=[each for each in pictures if each is not laws],
        simulated=any(each.run.simulated for each in found.runs),
        certificate=_sheet(found, reasons, laws),
    )
    runs = runs_table([each.run for each in found.runs])
    return replace(document, tables=[*document.tables, runs, equation_table(document)])


def _named(found: Comparison) -> str:
    """The groups by the names of their runs, shortened if there are many."""
    groups = [" + ".join(found.runs[place].run.name for place in group) for group in found.groups]
    text = " against ".join(groups)
    return text if len(text) <= LONGEST_TITLE else f"{text[: LONGEST_TITLE - 1]}…"


def _difference_table(each: Difference) -> Table:
    notes = [
        "Standard uncertainties: of a single run of each group, and of the difference.",
        f"Group 2 against group 1: {change(each.relative)}, 95 % interval "
        f"{changes(each.interval)}. Smallest difference that these runs "
        f"could have shown (in 80 of 100 tries, at 5 % false alarms): "
        f"{percent(each.smallest_detectable)}.",
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


_DIFFERENCE: tuple[Field[Difference], ...] = (
    Field(lambda each: " + ".join(each.first), label="group 1"),
    Field(lambda each: " + ".join(each.second), label="group 2"),
    Field(lambda each: NAMES[each.kind], label="of"),
    Field(lambda each: each.from_n or None, label="from", show=quantity("N")),
    Field(lambda each: each.to_n, label="to", show=quantity("N")),
    Field(lambda each: each.relative, label="2 against 1", show=change),
    Field(lambda each: each.interval, label="95 % interval", show=changes),
    Field(lambda each: each.smallest_detectable, label="could show", show=percent),
    Field(lambda each: each.verdict.value, label="verdict"),
)


def _sheet(found: Comparison, reasons: Sequence[str], figure: Figure | None) -> Certificate:
    """The sheet of a comparison; `figure` is the one with all laws."""
    told = [each.run.metadata for each in found.runs]

    def common(key: str) -> str:
        return shared(each.get(key, "") for each in told)

    what: Facts = [
        ("Payload", common("payload")),
        ("Specimens", common("specimen")),
        ("Batch", common("batch")),
        ("Plan", common("plan")),
        ("Compared", f"{len(told)} runs in {len(found.groups)} groups"),
        ("Tolerance", f"{percent(found.tolerance)} of the stiffness"),
    ]
    rig: Facts = [
        ("Rig", common("rig")),
        ("Arm", common("arm")),
        ("Force sensor", common("force_sensor")),
        ("K_s from", common("calibration")),
        ("Operator", common("operator")),
        ("Days", shared(each.get("started", "")[:10] for each in told)),
    ]
    tables = [table_one(found)]
    if found.differences:
        tables.insert(0, table("Differences", _DIFFERENCE, found.differences))
    return Certificate(
        heading="Comparison of contact stiffness",
        facts=(what, rig),
        tables=[first_rows(each) for each in tables],
        figure=figure,
        remarks=few(reasons),
        signatures=(("Compared by", ""), ("Checked by", "")),
        foot=f"stepload {stepload.__version__} · comparison of {len(told)} runs",
    )
