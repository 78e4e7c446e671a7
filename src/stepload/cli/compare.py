"""The verb `compare`: runs and curves side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

import stepload.cli.curves as c
from stepload.cli.options import Surface, TipRadius, quantity, run_path
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output

Texts = list[str] | None
VERSUS = "vs"
"""Separates groups of runs on the command line; a directory of that name is `./vs/run.mcap`."""
FIRST_N = 300.0
"""Highest force of a predicted curve without a run and a secant force."""


def _pair(flag: str, text: str, units: tuple[str, str], hint: str) -> tuple[float, float]:
    """Two figures with a comma between them, in these units; "": a plain number.

    Raises:
        BadInputError: the text has another form.
    """
    from stepload.units import parse_named

    parts = text.split(",")
    try:
        first, second = (
            parse_named(flag, part, unit) if unit else float(part)
            for part, unit in zip(parts, units, strict=True)
        )
    except ValueError:
        raise BadInputError(f"{flag} {text!r}", hint=hint) from None
    return first, second


def _plate_modulus(flag: str, text: str) -> float:
    """E/(1 − ν²) of "200 GPa, 0.29"."""
    hint = 'Young\'s modulus and Poisson ratio: "200 GPa, 0.29"'
    modulus_pa, poisson = _pair(flag, text, ("Pa", ""), hint)
    if not -1.0 < poisson <= 0.5:
        raise BadInputError(f"{flag} {text!r}", hint=hint)
    return modulus_pa / (1.0 - poisson**2)


def _bounds(flag: str, text: str) -> tuple[float, float]:
    """Position resolution and √MSDE in m of "1 um, 1.31 um"."""
    hint = 'position resolution and √MSDE: "1 um, 1.31 um"'
    found = _pair(flag, text, ("m", "m"), hint)
    if min(found) < 0.0:
        raise BadInputError(f"{flag} {text!r}", hint=hint)
    return found


def _groups(runs: list[Path]) -> list[list[Path]]:
    """The runs, split at the word `vs`."""
    groups: list[list[Path]] = [[]]
    for path in runs:
        if path == Path(VERSUS):
            groups.append([])
        else:
            groups[-1].append(path)
    return groups


def _curves(texts: Sequence[str]) -> dict[str, Path]:
    """Files by the names of their curves: NAME=FILE, or the name of the file."""
    found: dict[str, Path] = {}
    for text in texts:
        name, equals, file = text.partition("=")
        if not equals or Path(text).exists():
            name, file = Path(text).stem, text
        if name in found:
            raise BadInputError(
                f"two curves are called {name!r}", hint="name them: --curve NAME=FILE"
            )
        found[name] = Path(file)
    return found


def _by_curve(flag: str, texts: Sequence[str] | None, curves: Mapping[str, Path]) -> dict[str, str]:
    """The texts of an option by curve: NAME=TEXT is for one, TEXT for every curve without one."""
    parts = [text.rpartition("=") for text in texts or ()]
    named = {name: text for name, equals, text in parts if equals}
    if texts and not curves:
        raise BadInputError(f"{flag}, and no --curve")
    if unknown := sorted(named.keys() - curves.keys()):
        raise BadInputError(
            f"{flag}: no curve is called {unknown[0]!r}", hint=f"curves: {', '.join(curves)}"
        )
    return {name: text for _, equals, text in parts if not equals for name in curves} | named


def compare(
    runs: Annotated[
        list[Path] | None,
        Argument(
            parser=run_path,
            metavar="RUNS",
            help="Runs (directory, record or id). A word `vs` between them parts repeats: "
            "A1 A2 A3 vs B1 B2 B3; without it, runs of one plan are repeats.",
        ),
    ] = None,
    curve: Annotated[
        Texts, Option(metavar="[NAME=]FILE", help="Curve of deformation, or payload.yaml.")
    ] = None,
    curve_modulus: Annotated[
        Texts, Option(help='Equivalent modulus of a curve (V-A), "[NAME=]2.95 GPa".')
    ] = None,
    curve_plate: Annotated[
        Texts, Option(help='Or its counter body (E, ν), "[NAME=]200 GPa, 0.29".')
    ] = None,
    bounds: Annotated[
        Texts, Option(help='Position resolution and √MSDE of a curve, "[NAME=]1 um, 1.31 um".')
    ] = None,
    columns: c.Columns = None,
    units: c.Units = None,
    sheet: c.Sheet = None,
    decimal: c.Decimal = None,
    encoding: c.Encoding = None,
    specimen: c.Specimen = None,
    mapping: Annotated[
        Texts, Option(metavar="[NAME=]FILE", help="YAML with these, as --look prints it.")
    ] = None,
    look: c.Look = False,
    rough: Annotated[Texts, Option(metavar="NAME", help="Curve to multiply by (10).")] = None,
    plastic: Annotated[Texts, Option(metavar="NAME", help="Curve to multiply by (15).")] = None,
    payload: Annotated[
        Path | None, Option(help="Payload of the curves in CSV, for (10), (15).")
    ] = None,
    surface: Surface = None,
    tip_radius: TipRadius = None,
    secant_force: Annotated[
        float | None, quantity("--secant-force", "N", 'Force of the secants, "300 N".')
    ] = None,
    tolerance: Annotated[
        float | None, quantity("--tolerance", "%", 'Difference that matters, "5 %"; else 1/t.')
    ] = None,
    out: Annotated[
        Path | None, Option(help="Directory for compare.html, compare.json, compare.csv.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare runs and curves: which differ, and Table II of the paper.

    AGREE, DIFFER or CANNOT TELL, and always the smallest difference that could have been seen.

    Example: stepload compare runs/a runs/b vs runs/c --curve FE=cone.csv --out compared
    """
    from stepload.plan.load import load_payload
    from stepload.record.curves import read_curve
    from stepload.record.plain import json_text
    from stepload.report.comparison import compare as compare_runs
    from stepload.report.comparison import reached_secant_force_n
    from stepload.report.comparison_curve import CurveGiven
    from stepload.report.comparison_document import comparison_data, comparison_document
    from stepload.report.comparison_table import table_two_csv
    from stepload.report.curve import deformation_curve
    from stepload.report.page import render
    from stepload.report.run_record import saved_run
    from stepload.report.terminal import wrapped
    from stepload.report.tip_factors import SHAPES, predicted_curve, tip_factors, with_factors
    from stepload.session.files import write_file
    from stepload.units import parse_named

    output, files = Output(as_json=as_json), _curves(curve or ())
    moduli = _by_curve("--curve-modulus", curve_modulus, files)
    plates = _by_curve("--curve-plate", curve_plate, files)
    errors = _by_curve("--bounds", bounds, files)
    if both := sorted(moduli.keys() & plates.keys()):
        raise BadInputError(f"--curve-modulus and --curve-plate of {both[0]}: give one of them")
    for flag, names in ("--rough", rough), ("--plastic", plastic):
        _by_curve(flag, [f"{name}=" for name in names or ()], files)
    body = None if payload is None else load_payload(payload)
    kept = _by_curve("--mapping", mapping, files)
    stated = columns, units, sheet, decimal, encoding, specimen
    mappings = {name: c.curve_mapping(kept.get(name), *stated) for name in files}
    if look:
        c.show_look(output, [(path, mappings[name]) for name, path in files.items()])
        return
    groups = _groups(runs or [])
    saved = [saved_run(path) for group in groups for path in group]
    top_n = secant_force or min(map(reached_secant_force_n, saved), default=FIRST_N)
    given = []
    for name, path in files.items():
        of = load_payload(path) if path.suffix.lower() in SHAPES else None
        if of:
            made = predicted_curve(of, top_n)
        else:
            made = deformation_curve(read := read_curve(path, mappings[name]), name)
            assert read.reading is not None
            for line in read.reading.lines():
                output.line(wrapped(f"{name}: {line}", 2))
        wanted = {"rough": name in (rough or ()), "plastic": name in (plastic or ())}
        if any(wanted.values()) or not (rough or plastic):
            factors = tip_factors(of or body, **wanted, surface=surface, radius_m=tip_radius)
            made = with_factors(made, factors)
        modulus, plate = moduli.get(name), plates.get(name)
        resolution_m, msde_m = _bounds("--bounds", errors[name]) if name in errors else (0.0, 0.0)
        given.append(CurveGiven(
            name, made,
            modulus_pa=None if modulus is None else parse_named("--curve-modulus", modulus, "Pa"),
            plate_pa=None if plate is None else _plate_modulus("--curve-plate", plate),
            resolution_m=resolution_m, msde_m=msde_m, payload=of.name if of else "",
        ))  # fmt: skip
    found = compare_runs(
        saved,
        secant_force_n=secant_force,
        given=given,
        sizes=[len(group) for group in groups] if len(groups) > 1 else None,
        tolerance=tolerance,
    )
    document, data = comparison_document(found), comparison_data(found)
    output.show(document)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
            write_file(out / "compare.html", render(document))
            write_file(out / "compare.json", json_text(data, indent=1) + "\n")
            write_file(out / "compare.csv", table_two_csv(found))
        except OSError as error:
            raise BadInputError(f"cannot write to {out}: {error.strerror}") from error
        output.line(f"report: {out / 'compare.html'}")
    output.result(data)
