"""Verbs about the plans that come with stepload: list them, copy one to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stepload.results.terminal import AsJson, Output

plans = typer.Typer(help="Plans that come with stepload, ready to run or to begin with.")


@plans.callback(invoke_without_command=True)
def list_all(context: typer.Context, as_json: AsJson = False) -> None:
    """List the plans that come with stepload."""
    if context.invoked_subcommand is not None:
        return
    from stepload.plan.shipped import shipped_plans

    out = Output(as_json=as_json)
    found = shipped_plans()
    out.table("plans", ("name", "what it is"), [(plan.name, plan.about) for plan in found])
    out.line("stepload plans copy NAME copies one, with the files it names, to begin with")
    out.result({"plans": found})


@plans.command("copy")
def copy(
    name: Annotated[str, typer.Argument(help="Plan, as `stepload plans` lists it.")],
    directory: Annotated[Path, typer.Argument(help="Where to; made where missing.")] = Path(),
    as_json: AsJson = False,
) -> None:
    """Copy a plan and the files it names; nothing that is there is overwritten.

    Example: stepload plans copy plastic-sphere
    """
    from stepload.plan.shipped import copy_plan

    out = Output(as_json=as_json)
    written = copy_plan(name, directory)
    for path in written:
        out.line(str(path))
    out.result({"written": written})
