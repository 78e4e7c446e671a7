"""Verbs that export a result to other programs: snippet."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from stepload.cli.run_paths import RunOrCurve
from stepload.errors import BadInputError
from stepload.results.terminal import AsJson, Output


def snippet(
    file: RunOrCurve,
    simulator: Annotated[str, typer.Option("--for", help="mujoco (MJCF) or drake (SDFormat).")],
    at: Annotated[
        str | None,
        typer.Option("--at", help='Operating force, "150 N"; half of the highest if none.'),
    ] = None,
    kind: Annotated[
        str, typer.Option("--stiffness", help="tangent, or chord from 10 % of that force.")
    ] = "tangent",
    mass: Annotated[
        str | None, typer.Option("--mass", help='MuJoCo: effective mass at the contact, "2 kg".')
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the identified law as contact parameters of a simulator, linearised at a force.

    Example: stepload snippet runs/20260801-101500-demo --for mujoco --mass "1 kg"
    """
    from stepload.results.conditions import Stated
    from stepload.results.from_file import results_of_file
    from stepload.results.snippets import KINDS, SIMULATORS, spring_of
    from stepload.results.snippets import snippet as written
    from stepload.units import parse_quantity

    if simulator not in SIMULATORS:
        raise BadInputError(f"--for {simulator!r}", hint=", ".join(SIMULATORS))
    if kind not in KINDS:
        raise BadInputError(f"--stiffness {kind!r}", hint=" or ".join(KINDS))
    told, at_n = results_of_file(file, Stated()), None if at is None else parse_quantity(at, "N")
    spring = spring_of(told.found, at_n=at_n, kind=kind, simulated=told.simulated)
    text = written(
        spring,
        simulator,
        mass_kg=None if mass is None else parse_quantity(mass, "kg"),
    )
    output = Output(as_json=as_json)
    output.line(text.rstrip("\n"))
    output.result({**asdict(spring), "for": simulator, "snippet": text})
