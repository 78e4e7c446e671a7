"""Verbs about what a rig can measure and where: map, design, pose."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from stepload.cli.options import RigName, quantity
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LONGEST_M = 10.0
Sheet = Annotated[Path | None, Option("--out", help="Directory for the picture and the figures.")]


def map(
    rig: RigName,
    payload: Annotated[
        list[Path] | None, Option(help="Payload file, beside those that come with stepload.")
    ] = None,
    top_force: Annotated[float | None, quantity("--top-force", "N", 'As in "300 N".')] = None,
    out: Sheet = None,
    parquet: Annotated[Path | None, Option(help="Write every cell to a Parquet file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Say which payloads a rig can measure, and what narrows their intervals.

    Example: stepload map stvf --payload procedures/payloads/plastic-sphere.yaml --out map
    """
    from stepload.data.columns import check_parquet, write_columns
    from stepload.design import map_report as report
    from stepload.design.map import make, shipped_payloads
    from stepload.plan.room_to_write import check_room

    output = Output(as_json=as_json)
    if parquet is not None:
        check_parquet(parquet)
        check_room("--parquet", parquet)
    if out is not None:
        check_sheet(out, "map")
    found = make(
        rig, payload or [], shipped=shipped_payloads(), top_n=top_force,
        on_start=lambda cells: output.line(f"{cells} cells"),
    )  # fmt: skip
    said = report.data(found)
    output.line(f"{found.rig.name} at {found.rig.top_n:.4g} N: {found.rig.note}")
    output.tables(report.payload_table(found), report.reach_table(found))
    for sentence in said["answers"]:
        output.line(sentence)
    if out is not None:
        from stepload.design.map_picture import drawn

        output.line(write_sheet(out, "map", lambda: drawn(found), said))
    if parquet is not None:
        cells = said["cells"]
        write_columns({name: [each[name] for each in cells] for name in cells[0]}, parquet)
        output.line(f"written: {parquet}")
    output.result(said)


def design(
    payload: Annotated[Path, Argument(help="Payload file (YAML).", show_default=False)],
    rig: RigName,
    time: Annotated[str, Option(help='How long the run may take: "5 min".')] = "5 min",
    surface_distance: Annotated[
        str, Option(help="Travel from the start pose to the surface, with its unit.")
    ] = "5 mm",
    out: Annotated[Path, Option(help="Plan to write; it must be new.")] = Path("designed.yaml"),
    as_json: AsJson = False,
) -> None:
    """Write the plan with the narrowest interval, below F_c and within a time.

    Top force, number of steps and holds are chosen by the expected interval; nothing is moved. Exit
    3: no plan has one within ±1/t; the reason and what would help are told.

    Example: stepload design procedures/payloads/plastic-sphere.yaml stvf --time "3 min"
    """
    from stepload.design import plan_report as report
    from stepload.design.plan_design import design as designed
    from stepload.plan.room_to_write import check_new, check_room
    from stepload.units import format_quantity

    output = Output(as_json=as_json)
    within_s = _quantity("--time", time, "s", zero=False)
    surface = format_quantity(
        _quantity("--surface-distance", surface_distance, "m", zero=False), "m", 6
    )
    check_new("--out", out)
    check_room("--out", out)
    found = designed(rig, payload, within_s=within_s, surface=surface)
    typed = ["stepload", "design", str(payload), rig, "--time", time, "--surface-distance",
             surface_distance]  # fmt: skip
    text = report.text_of(found, out, payload, rig, surface, shlex.join(typed))
    report.write(out, text)
    output.tables(report.curve_table(found))
    for sentence in report.sentences(found):
        output.line(sentence)
    output.line(f"written: {out}; look at it next with: stepload preflight {shlex.quote(str(out))}")
    output.result({**report.data(found), "path": out, "plan": text})


def pose(
    rig: RigName,
    arm: Annotated[
        str | None, Option(help="Arm, or a file of its DH parameters; else the rig names it.")
    ] = None,
    payload: Annotated[Path | None, Option(help="Payload file, or a plan with a payload.")] = None,
    calibration: Annotated[
        list[Path] | None, Option(help="Calibration record of this arm; may be repeated.")
    ] = None,
    tool: Annotated[
        str, Option(help="Flange to contact; else the calibration's TCP, or 120 mm.")
    ] = "",
    press: Annotated[
        tuple[float, float, float], Option(help="Direction of the press in the base, any length.")
    ] = (0.0, 0.0, -1.0),
    radius: Annotated[
        str, Option(help='Contact from the base\'s axis: "400 mm", "300 mm to 500 mm".')
    ] = "",
    height: Annotated[str, Option(help='Contact above the base\'s foot: "0 mm".')] = "",
    travel: Annotated[str, Option(help="From the start pose to the contact.")] = "50 mm",
    out: Sheet = None,
    as_json: AsJson = False,
) -> None:
    """Say where to put the plate and how to hold the arm.

    A ranking by assumed joint stiffness, or by that of calibrations; nothing is moved, and nothing
    is calibrated by it. Exit 3: a machine of one axis, or no pose can be reached.

    Example: stepload pose ur5e --height "0 mm" --payload procedures/payloads/silicone-sphere.yaml
    """
    from stepload.pose import tables
    from stepload.pose.rig_search import make
    from stepload.pose.search import direction

    output = Output(as_json=as_json)
    if out is not None:
        check_sheet(out, "pose")
    found = make(
        rig,
        arm=arm,
        payload=payload,
        press=direction(*press),
        tool_m=_quantity("--tool", tool, "m") if tool else None,
        radius_m=_range("--radius", radius, 0.0) if radius else None,
        height_m=_range("--height", height, -math.inf) if height else None,
        travel_m=_quantity("--travel", travel, "m"),
        calibrations=calibration or [],
    )
    said = tables.data(found)
    output.tables(tables.place_table(found), tables.stiffness_table(found))
    for sentence in said["answers"]:
        output.line(sentence)
    if out is not None:
        from stepload.pose import picture

        output.line(write_sheet(out, "pose", lambda: picture.drawn(found), said))
    output.result(said)


def _quantity(option: str, text: str, unit: str, least: float = 0.0, *, zero: bool = True) -> float:
    from stepload.units import parse_named

    value = parse_named(option, text, unit)
    if not (value > least or (zero and value == least)):
        limit = f"{'below' if zero else 'not above'} {least:g} {unit}"
        raise BadInputError(f"{option}: {text.strip()} is {limit}", hint="give more")
    if unit == "m" and abs(value) > LONGEST_M:
        raise BadInputError(f"{option}: {text.strip()} is more than {LONGEST_M:g} m")
    return value


def _range(option: str, text: str, least: float) -> tuple[float, float]:
    parts = [_quantity(option, each, "m", least) for each in text.split(" to ")]
    if len(parts) > 2 or parts[0] > parts[-1]:
        raise BadInputError(f"{option}: {text} is no range", hint='as in "300 mm to 500 mm"')
    return parts[0], parts[-1]


def check_sheet(out: Path, name: str) -> None:
    """Refuse to overwrite the files of `write_sheet`, before anything is computed.

    Raises:
        BadInputError: `out` is a file, holds such files already, or has no room.
    """
    from stepload.plan.room_to_write import check_room

    if (out.exists() or out.is_symlink()) and not out.is_dir():
        raise BadInputError(f"--out {out}: that is a file", hint="name a directory")
    for path in _files(out, name):
        if path.exists() or path.is_symlink():
            raise _there_already(path)
    check_room("--out", out)


def write_sheet(
    out: Path,
    name: str,
    drawn: Callable[[], AbstractContextManager[Figure]],
    said: dict[str, object],
) -> str:
    """Write a picture in two formats and its figures as `name`; returns a line that says so.

    Args:
        drawn: draws the picture, once for each form.

    Raises:
        BadInputError: a file has appeared since the check; it is not changed.
    """
    from stepload.record.plain import json_text
    from stepload.report.figures import png_of, svg_of

    out.mkdir(parents=True, exist_ok=True)
    files = _files(out, name)
    with drawn() as figure:
        svg = svg_of(figure).encode()
    with drawn() as figure:
        png = png_of(figure)
    contents = svg, png, f"{json_text(said)}\n".encode()
    for path, content in zip(files, contents, strict=True):
        try:
            with path.open("xb") as file:
                file.write(content)
        except FileExistsError as error:
            raise _there_already(path) from error
    return f"written: {', '.join(str(path) for path in files)}"


def _there_already(path: Path) -> BadInputError:
    return BadInputError(f"{path} is there already", hint="name another directory")


def _files(out: Path, name: str) -> list[Path]:
    return [out / f"{name}.{form}" for form in ("svg", "png", "json")]
