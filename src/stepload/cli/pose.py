"""The verb `pose`: the best position of the plate and joint angles of the arm."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from stepload.cli.sheet import check_sheet, write_sheet
from stepload.errors import BadInputError
from stepload.results.terminal import AsJson, Output

LONGEST_M = 10.0
SOFTEST, STIFFEST = 1.0, 1e9
"""Stiffness of a joint, in the unit used in the file of an arm."""


def pose(
    rig: Annotated[str, typer.Argument(help="Rig profile, or a rig file (YAML).")],
    arm: Annotated[
        str | None,
        typer.Option("--arm", help="Arm, or a file of its DH parameters; else the rig names it."),
    ] = None,
    payload: Annotated[
        Path | None, typer.Option("--payload", help="Payload file, or a plan with a payload.")
    ] = None,
    calibration: Annotated[
        list[Path] | None,
        typer.Option("--calibration", help="Calibration record of this arm; may be repeated."),
    ] = None,
    joint_stiffness: Annotated[
        str,
        typer.Option("--joint-stiffness", help='Six numbers: "1.6e4 N m/rad, 1.6e4 N m/rad, ...".'),
    ] = "",
    tool: Annotated[
        str,
        typer.Option("--tool", help="Flange to contact; else the calibration's TCP, or 120 mm."),
    ] = "",
    press: Annotated[
        tuple[float, float, float],
        typer.Option("--press", help="Direction of the press in the base, any length."),
    ] = (0.0, 0.0, -1.0),
    radius: Annotated[
        str,
        typer.Option(
            "--radius", help='Contact from the base\'s axis: "400 mm", "300 mm to 500 mm".'
        ),
    ] = "",
    height: Annotated[
        str, typer.Option("--height", help='Contact above the base\'s foot: "0 mm".')
    ] = "",
    travel: Annotated[
        str, typer.Option("--travel", help="From the start pose to the contact.")
    ] = "50 mm",
    out: Annotated[
        Path | None, typer.Option("--out", help="Directory for the picture and the figures.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say where to put the plate and how to hold the arm, so that it gives way least.

    A ranking by assumed joint stiffness, or by that of calibrations; nothing is moved, and nothing
    is calibrated by it. Exit 3: a machine of one axis, or no pose can be reached.

    Example: stepload pose ur5e --height "0 mm" --payload procedures/payloads/silicone-sphere.yaml
    """
    from stepload.posture import tables
    from stepload.posture.rig_search import make
    from stepload.posture.search import direction

    output = Output(as_json=as_json)
    if out is not None:
        check_sheet(out, "pose")
    found = make(
        rig,
        arm=arm,
        payload=payload,
        press=direction(*press),
        tool_m=_quantity("--tool", tool, "m", 0.0) if tool else None,
        radius_m=_range("--radius", radius, 0.0) if radius else None,
        height_m=_range("--height", height, -math.inf) if height else None,
        travel_m=_quantity("--travel", travel, "m", 0.0),
        joint_stiffness=_stiffnesses(joint_stiffness),
        calibrations=calibration or [],
    )
    said = tables.data(found)
    output.tables(tables.place_table(found), tables.stiffness_table(found))
    for sentence in said["answers"]:
        output.line(sentence)
    if out is not None:
        from stepload.posture import picture

        output.line(write_sheet(out, "pose", lambda: picture.drawn(found), said))
    output.result(said)


def _quantity(option: str, text: str, unit: str, least: float) -> float:
    from stepload.units import parse_named

    value = parse_named(option, text, unit)
    if not value >= least:
        raise BadInputError(f"{option}: {text.strip()} is below {least:g} {unit}", hint="give more")
    if unit == "m" and abs(value) > LONGEST_M:
        raise BadInputError(f"{option}: {text.strip()} is more than {LONGEST_M:g} m")
    return value


def _range(option: str, text: str, least: float) -> tuple[float, float]:
    parts = [_quantity(option, each, "m", least) for each in text.split(" to ")]
    if len(parts) > 2 or parts[0] > parts[-1]:
        raise BadInputError(f"{option}: {text} is no range", hint='as in "300 mm to 500 mm"')
    return parts[0], parts[-1]


def _stiffnesses(text: str) -> list[float] | None:
    if not text:
        return None
    found = [_quantity("--joint-stiffness", each, "N m/rad", 0.0) for each in text.split(",")]
    if not all(SOFTEST <= each <= STIFFEST for each in found):
        raise BadInputError(
            f"--joint-stiffness: {text} is no stiffness of joints",
            hint=f"{SOFTEST:g} to {STIFFEST:g} N m/rad each",
        )
    return found
