"""The verb that examines a rig before its use."""

from __future__ import annotations

from typing import Annotated

import typer

from stepload.cli.hazards import HazardsRead, ask_hazards
from stepload.cli.plans import PlanFile
from stepload.errors import ExitCode
from stepload.results.terminal import AsJson, Output


def doctor(
    plan: PlanFile,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="On the simulated rig, in virtual time.")
    ] = False,
    still: Annotated[
        bool, typer.Option("--still", help="Move nothing; stop and delays stay unproven.")
    ] = False,
    against_spring: Annotated[
        bool,
        typer.Option(
            "--against-spring",
            help="Measure the loop delay T in contact, with small steps on a spring.",
        ),
    ] = False,
    seconds: Annotated[
        float, typer.Option("--seconds", help="How long to watch the data at rest.")
    ] = 10.0,
    hazards_read: HazardsRead = False,
    as_json: AsJson = False,
) -> None:
    """Examine a plan's rig: data, disk, clocks, that stop really stops. Exit 0: sound; 4: not.

    Needs free air: the arm moves up to 2 mm away from the plate, at up to 4 mm/s, and back. With
    --against-spring it also runs the plan's approach and presses up to its top force.

    Example: stepload doctor procedures/plastic-sphere.yaml --dry-run
    """
    from stepload.engine.operator import Operator
    from stepload.envelope.envelope import envelope_of
    from stepload.plan.load import load_plan
    from stepload.session.hardware_check import refuse_simulated
    from stepload.setup.checkup import examine

    out = Output(as_json=as_json)
    operator = Operator()

    envelope = envelope_of(load_plan(plan))
    if not dry_run:
        refuse_simulated(envelope.plan)
    if not dry_run and not hazards_read and not (still and not against_spring):
        ask_hazards(envelope)
    with operator.listening():
        found = examine(
            envelope, dry_run=dry_run, seconds=seconds, still=still, against_spring=against_spring,
            tell=lambda line: out.finding(line.finding), operator=operator,
        )  # fmt: skip
    if found.snippet:
        out.line("\nmeasured, for the rig file:\n")
        out.line(found.snippet)
    marks = [line.mark.value for line in found.lines]
    out.line(f"{marks.count('ok')} ok, {marks.count('warn')} warn, {marks.count('fail')} fail")
    out.result({"sound": not found.failed, "lines": found.lines, "rig": found.snippet})
    if found.failed:
        raise typer.Exit(ExitCode.STOPPED)
