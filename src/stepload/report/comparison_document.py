"""A comparison as a document for people and as an object for programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator

import stepload
from stepload.identification.difference import Agreement, Difference
from stepload.report import figures
from stepload.report.certificate import few, shared_facts
from stepload.report.comparison import Comparison
from stepload.report.comparison_curve import AgainstCurve
from stepload.report.comparison_table import (
    BoundsRow,
    ResultRow,
    Side,
    overlay,
    sides,
    table_one,
    table_two,
)
from stepload.report.identified import FitRow, reported_fits
from stepload.report.model import (
    NOTHING,
    Certificate,
    Document,
    Figure,
    Mood,
    Table,
    Verdict,
    first_rows,
)
from stepload.report.provenance import runs_table
from stepload.report.rows import Row, data, figure, part, schema_of, table
from stepload.units import change, changes, percent
from stepload.units import format_quantity as f

LONGEST_TITLE, LONGEST_NAMES = 200, 40
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


_two_digits = partial(percent, digits=2)
Groups = Annotated[tuple[str, ...], " + ".join]
Changes = Annotated[tuple[float, float] | None, changes]


class CurveRow(Row):
    """The difference of a curve from the chord and the secant of a run."""

    curve: str = figure("Name of the curve.", "curve")
    run: str = figure("Name of the run that it is relative to.", "relative to")
    judged: Annotated[
        str | None, BeforeValidator(lambda kind: kind and NAMES[kind]), part("kind")
    ] = figure("Which stiffness decides.", "of")
    judged_change: Annotated[float | None, part("relative"), change] = figure(
        "Its difference, relative to the run.", "change", at="judged"
    )
    judged_interval: Annotated[Changes, part("interval")] = figure(
        "The 95 % interval of that.", "95 % interval", at="judged"
    )
    smallest_detectable: Annotated[float | None, part("smallest_detectable"), percent] = figure(
        "Smallest relative difference that could have been seen.", "could show", at="judged"
    )
    verdict: str = figure("agree, differ or cannot tell.", "verdict")
    chord_from_n: float = figure("Lower force of the chord.", at="from_n")
    secant_force_n: float = figure("Upper force; that of the secant.", at="to_n")
    chord_change: Annotated[float | None, part("relative")] = figure(
        "Difference of the chords, relative to the run.", at="chord"
    )
    chord_interval: Annotated[Changes, part("interval")] = figure("Its 95 %.", at="chord")
    secant_change: Annotated[float | None, part("relative")] = figure(
        "Difference of the secants, relative to the run.", at="secant"
    )
    secant_interval: Annotated[Changes, part("interval")] = figure("Its 95 %.", at="secant")
    secant_n_per_m: float | None = figure("Secant of the curve.")
    estimator: str = figure("The fit of the run.")
    force_rms_n: float | None = figure("Rms difference at equal deformation.")
    deformation_rms_m: float | None = figure("Rms difference at equal force.")
    correction: float = figure("Ratio of the equivalent moduli (V-A) in the forces of the curve.")
    points: Annotated[int, BeforeValidator(len)] = figure("Of the curve.", at="force_n")
    points_beyond: int = figure("Beyond the forces of the run.", at="left_out")


class DifferenceLineRow(Row):
    """Contribution of one source to a difference; relative standard uncertainties."""

    source: str = figure("Where the uncertainty comes from.", "source")
    first: Annotated[float, _two_digits] = figure("In a run of group 1.", "group 1")
    second: Annotated[float, _two_digits] = figure("In a run of group 2.", "group 2")
    common: str = figure("Which runs share it.", "shared")
    left: Annotated[float, _two_digits] = figure("Of the difference.", "in all")


class DifferenceRow(Row):
    """The difference of two groups of runs."""

    first: Groups = figure("Runs of group 1.", "group 1")
    second: Groups = figure("Runs of group 2.", "group 2")
    quantity: Annotated[str, BeforeValidator(NAMES.__getitem__)] = figure(
        "Which stiffness.", "of", at="kind"
    )
    from_n: Annotated[float, lambda n: f(n, "N") if n else NOTHING] = figure("Lower force.", "from")
    to_n: float = figure("Upper force.", "to")
    relative: Annotated[float, change] = figure("Of 2 against 1, relative.", "2 against 1")
    interval: Changes = figure("Its 95 % interval.", "95 % interval")
    smallest_detectable: Annotated[float | None, percent] = figure(
        "Smallest relative difference that could have been seen.", "could show"
    )
    tolerance: float = figure("Relative difference that matters.")
    verdict: str = figure("agree, differ or cannot tell.", "verdict")
    why: str = figure("The same in a sentence.")
    scatter: float | None = figure("Of the runs of a group, relative; null without repeats.")
    scatter_degrees: int = figure("Its degrees of freedom.")
    scatter_expected: float | None = figure("By the errors of the runs.")
    open_sources: tuple[str, ...] = figure("Sources that may or may not be shared.")
    lines: tuple[DifferenceLineRow, ...] = figure("Its budget.")


class ComparedRow(Row):
    """One run of a comparison."""

    name: str = figure("Its name in the comparison.")
    path: Path = figure("Its record.")
    run_id: str | None = figure("Twelve hexadecimal digits.")
    specimen: str | None = figure("Which piece.")
    payload: str | None = figure("Name of the payload.")
    rig: str | None = figure("Name of the rig.")
    selected: str = figure("Which of the fits is the one to use.")
    fits: Mapping[str, FitRow] = figure("By the name of the estimator.")
    interval_secant_n_per_m: tuple[float, float] | None = figure("95 % interval of its secant.")


class ComparisonRow(Row):
    """JSON of `stepload compare`, version 1. SI units; NaN and infinities are null."""

    simulated: bool = figure("Whether simulated devices made the data of a run.")
    verdict: str = figure("agree, disagree, differs (a run and a curve) or cannot tell.")
    headline: str = figure("The same in a sentence.")
    agreement: str = figure("agree, differ or cannot tell.")
    tolerance: float = figure("Relative difference that matters.")
    groups: tuple[tuple[str, ...], ...] = figure("Names of the runs that are repeats.")
    differences: tuple[DifferenceRow, ...] = figure("Of every group from the first.")
    secant_force_n: float = figure("Force of the secants.")
    runs: tuple[ComparedRow, ...] = figure("Every run.")
    curve: tuple[CurveRow, ...] = figure("Every curve against every run.")
    results: tuple[ResultRow, ...] = figure("Table II: every run, every curve.")
    bounds: tuple[BoundsRow, ...] = figure("Bounds of the secants, in the same order.")
    notes: tuple[str, ...] = figure("What a reader must know.")


def comparison_schema() -> dict[str, Any]:
    """The JSON Schema of a comparison."""
    return schema_of(ComparisonRow, "comparison")


def comparison_document(found: Comparison) -> Document:
    """A comparison for people."""
    listed = sides(found)
    tables = [
        table("Differences", DifferenceRow, found.differences),
        *map(_difference_table, found.differences),
    ]
    if found.curve:
        tables.append(
            table("Curves against runs", CurveRow, found.curve, correction_notes(found.curve))
        )
    tables += table_two(listed, found.secant_force_n)
    reasons = [*_reasons(found), *found.notes]
    if found.runs:
        tables += [table_one(found), runs_table([each.run for each in found.runs])]
    return Document(
        title="Comparison",
        subtitle=_named(found),
        verdict=verdict(found),
        reasons=reasons,
        tables=tables,
        figures=_chords(found),
        simulated=any(each.run.simulated for each in found.runs),
        certificate=_sheet(found, listed, reasons),
    )


def _named(found: Comparison) -> str:
    """The groups by the names of their runs, shortened if there are many."""
    groups = [" + ".join(found.runs[place].run.name for place in group) for group in found.groups]
    text = " against ".join((*groups, *(each.name for each in found.given)))
    return text if len(text) <= LONGEST_TITLE else f"{text[: LONGEST_TITLE - 1]}…"


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
    return table(f"{title}{len(each.second)}", DifferenceLineRow, rows, notes)


def _reasons(found: Comparison) -> list[str]:
    """Every difference as a sentence, if there is more than one; the curves that differ."""
    differ = [
        f"{each.curve} from {each.run}"
        for each in found.curve
        if each.verdict is Agreement.DIFFER and len(found.curve) > 1
    ]
    reasons = [f"curves that differ: {', '.join(differ)}"] if differ else []
    if len(found.differences) < 2:
        return reasons
    told = (f"{' + '.join(each.second)}: {each.verdict}, {each.why}" for each in found.differences)
    return [*told, *reasons]


def correction_notes(curve: Sequence[AgainstCurve]) -> list[str]:
    """The factors by which the forces of curves were multiplied; nothing where they were not."""
    factors = {(each.curve, f"{each.correction:.4f}") for each in curve if each.correction != 1.0}
    return [
        f"The forces of {name} are multiplied by {factor}, the ratio of the equivalent moduli (4)."
        for name, factor in sorted(factors)
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


def comparison_data(found: Comparison) -> dict[str, Any]:
    """A comparison for programs."""
    judged, listed = verdict(found), sides(found)
    keys = ("run_id", "specimen", "payload", "rig")
    return data(ComparisonRow, {
        "simulated": any(each.run.simulated for each in found.runs),
        "verdict": _v1_word(found, judged),
        "headline": judged.text,
        "agreement": judged.word,
        "tolerance": found.tolerance,
        "groups": [[found.runs[place].run.name for place in group] for group in found.groups],
        "differences": found.differences,
        "secant_force_n": found.secant_force_n,
        "runs": [
            {
                "name": each.run.name,
                "path": each.run.path,
                **{key: each.run.metadata.get(key) for key in keys},
                "selected": each.found.selected,
                "fits": {row.name: row for row in reported_fits(each.found)},
                "interval_secant_n_per_m": each.found.interval_secant_n_per_m,
            }
            for each in found.runs
        ],
        "curve": found.curve,
        "results": listed,
        "bounds": listed,
        "notes": found.notes,
    })  # fmt: skip


def _v1_word(found: Comparison, judged: Verdict) -> str:
    """The verdict by its name in version 1 of the schema."""
    if judged.word == Agreement.DIFFER:
        return "disagree" if found.differences else "differs"
    return judged.word


def verdict(found: Comparison) -> Verdict:
    """Whether the compared results agree: runs by their groups, else a run and its curves."""
    judged = [each.judged for each in found.curve if each.judged is not None]
    if not found.runs:
        return Verdict("doubt", Agreement.CANNOT_TELL.value, "Curves without a run are not judged")
    if not found.differences and (len(found.runs) > 1 or not judged):
        text = "The runs have no chord between common forces"
        return Verdict("doubt", Agreement.CANNOT_TELL.value, text)
    worst = max(found.differences or judged, key=_gravity)
    first, second = (" + ".join(names) for names in (worst.first, worst.second))
    if found.differences and len(first) + len(second) > LONGEST_NAMES:
        first, second = "group 1", f"group {found.differences.index(worst) + 2}"
    told = f"{NAMES[worst.kind].capitalize()} of {second} relative to {first}: {worst.why}"
    return Verdict(_MOODS[worst.verdict], worst.verdict.value, told)


def _gravity(each: Difference) -> tuple[int, float]:
    order = (Agreement.AGREE, Agreement.CANNOT_TELL, Agreement.DIFFER)
    return order.index(each.verdict), abs(each.relative) / max(each.half_width, 1e-12)


def _sheet(found: Comparison, listed: list[Side], reasons: Sequence[str]) -> Certificate:
    """The sheet of a comparison."""
    runs = [each.run for each in found.runs]
    tables = [
        table("Differences", DifferenceRow, found.differences),
        *table_two(listed, found.secant_force_n),
    ]
    curves = f", {len(found.given)} curves" if found.given else ""
    return Certificate(
        heading="Comparison of contact stiffness",
        facts=(
            [
                *shared_facts(runs, "payload", "specimen", "batch", "plan"),
                ("Compared", f"{len(runs)} runs in {len(found.groups)} groups{curves}"),
                ("Tolerance", f"{percent(found.tolerance)} of the stiffness"),
            ],
            shared_facts(runs, "rig", "arm", "force_sensor", "calibration", "operator", "day"),
        ),
        tables=[first_rows(each) for each in tables if each.rows],
        figure=Figure(
            "laws", "Force against deformation",
            "Runs from their fitted zeros, and curves, as Figs. 8–13 of the paper. Shaded: "
            "position resolution and √MSDE. Dashed: 95 %.",
            "force over deformation of every run and curve with bounds", partial(overlay, listed),
        ),
        remarks=few(reasons),
        signatures=(("Compared by", ""), ("Checked by", "")),
        foot=f"stepload {stepload.__version__} · comparison of {len(runs)} runs{curves}",
    )  # fmt: skip
