"""The verb `design`: the plan with the narrowest interval within F_c and a given time."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from stepload.errors import BadInputError
from stepload.results.terminal import AsJson, Output


def design(
    payload: Annotated[Path, typer.Argument(help="Payload file (YAML).", show_default=False)],
    rig: Annotated[
        str, typer.Argument(help="Rig profile, or a rig file (YAML).", show_default=False)
    ],
    time: Annotated[
        str, typer.Option("--time", help='How long the whole run may take, with its unit: "5 min".')
    ] = "5 min",
    surface_distance: Annotated[
        str,
        typer.Option(
            "--surface-distance", help="Travel from the start pose to the surface, with its unit."
        ),
    ] = "5 mm",
    out: Annotated[Path, typer.Option("--out", help="Plan to write; it must be new.")] = Path(
        "designed.yaml"
    ),
    as_json: AsJson = False,
) -> None:
    """Write the plan with the narrowest interval, below the elastic limit and within a time.

    Top force, number of steps and holds are chosen by the expected interval; nothing is moved. Exit
    3: no plan has one within ±1/t; the reason and what would help are told.

    Example: stepload design procedures/payloads/plastic-sphere.yaml stvf --time "3 min"
    """
    from stepload.design import plan_report as report
    from stepload.design.plan_design import design as designed
    from stepload.plan.room_to_write import check_new, check_room
    from stepload.units import format_quantity

    output = Output(as_json=as_json)
    within_s = _positive("--time", time, "s")
    surface = format_quantity(_positive("--surface-distance", surface_distance, "m"), "m", 6)
    check_new("--out", out)
    check_room("--out", out)
    found = designed(rig, payload, within_s=within_s, surface=surface)
    typed = ["stepload", "design", str(payload), rig, "--time", time, "--surface-distance",
             surface_distance]  # fmt: skip
    text = report.text_of(found, out, payload, rig, surface, shlex.join(typed))
    report.write(out, text)
    said = report.data(found)
    output.tables(report.curve_table(found))
    for sentence in report.sentences(found):
        output.line(sentence)
    output.line(f"written: {out}; look at it next with: stepload preflight {shlex.quote(str(out))}")
    output.result({**said, "path": out, "plan": text})


def _positive(option: str, text: str, unit: str) -> float:
    from stepload.units import parse_named

    value = parse_named(option, text, unit)
    if value <= 0.0:
        raise BadInputError(f"{option}: {text} is not more than nothing", hint="give more")
    return value
