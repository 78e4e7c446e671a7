"""Verbs about devices: which drivers there are, whether they keep the contract."""

from __future__ import annotations

import typer

from stepload.cli.output import Output
from stepload.cli.plans import AsJson

drivers_app = typer.Typer(help="Installed drivers, and the contract they must keep.")


@drivers_app.callback(invoke_without_command=True)
def list_all(context: typer.Context, as_json: AsJson = False) -> None:
    """List installed drivers; broken ones with the reason."""
    if context.invoked_subcommand is not None:
        return
    from stepload.rig.plugins import list_drivers

    out = Output(as_json=as_json)
    found = list_drivers()
    out.table(
        "drivers",
        ("kind", "name", "from", "state"),
        [
            (d.group.removeprefix("stepload."), d.name, d.distribution, d.problem or "ready")
            for d in found
        ],
    )
    out.result({"drivers": found})


def register(app: typer.Typer) -> None:
    """Add this room's verbs."""
    app.add_typer(drivers_app, name="drivers")
