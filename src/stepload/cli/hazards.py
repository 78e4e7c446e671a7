"""Asks whoever starts a rig for the first time whether the hazards have been read."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from stepload.envelope.envelope import Envelope

HazardsRead = Annotated[
    bool,
    typer.Option("--yes", help="The hazards were read (docs/risk-assessment.md); for scripts."),
]


def ask_hazards(envelope: Envelope) -> bool:
    """Whether somebody at this terminal confirms now; the rig file keeps who and when.

    Without a terminal, or for a plan that is refused, nobody is asked and the answer is no.
    """
    from datetime import date

    from stepload.envelope.reason import PlanVerdict
    from stepload.plan.hazards import hazards_read, keep, keys_of
    from stepload.session.hazards import HAZARDS, PAGE

    plan = envelope.plan
    if hazards_read(plan) or envelope.verdict is PlanVerdict.REFUSED:
        return False
    if not _at_a_terminal():
        return False
    typer.echo(f"Before the rig {plan.rig.name!r} moves for the first time:", err=True)
    for hazard in HAZARDS:
        typer.echo(f"  - {hazard}", err=True)
    typer.echo(f"More, with what to do about each: {PAGE}", err=True)
    name = typer.prompt(
        "Your name, if you have read this and answer for the rig (empty: no)",
        default="", show_default=False, err=True,
    ).strip()  # fmt: skip
    if not name:
        return False
    today = date.today()
    if (path := keep(plan, name, today)) is not None:
        typer.echo(f"kept in {path}", err=True)
    else:
        typer.echo(f"for this time; to keep it, below `rig:`: {keys_of(name, today)}", err=True)
    return True


def _at_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()
