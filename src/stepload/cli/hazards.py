"""Asks the user, before the first start of a rig, whether the hazards have been read."""

from __future__ import annotations

import shutil
import sys
import textwrap
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from stepload.envelope.envelope import Envelope

HazardsRead = Annotated[
    bool,
    typer.Option("--yes", help="The hazards were read (docs/risk-assessment.md); for scripts."),
]


def refuse_unread_driver(driver: str, read_now: bool) -> None:
    """Ask before a driver's arm moves, and refuse without a yes; no rig file stores the answer.

    Raises:
        RefusedError: reading the hazards was not confirmed.
    """
    from stepload.errors import RefusedError
    from stepload.plan.hazards import PAGE

    if read_now or (_at_a_terminal() and _name(f"Before the arm of the driver {driver!r} moves:")):
        return
    raise RefusedError(
        f"--move: nobody has confirmed to have read the hazards of the arm that {driver!r} moves",
        hint=f"read {PAGE}; in a terminal the command asks; --yes in scripts",
    )


def _name(before: str) -> str:
    """Name of the person who has read the hazards, which are shown first; empty: none."""
    from stepload.plan.hazards import HAZARDS, PAGE

    _say(before)
    for hazard in HAZARDS:
        _say(f"  - {hazard}", "    ")
    _say(f"More, with what to do about each: {PAGE}", "  ")
    name: str = typer.prompt(
        "Your name, if you have read this and answer for the rig (empty: no)",
        default="", show_default=False, err=True,
    )  # fmt: skip
    return name.strip()


def _say(text: str, hang: str = "") -> None:
    """A line on a terminal, wrapped between words."""
    columns = shutil.get_terminal_size().columns
    typer.echo(textwrap.fill(text, columns, subsequent_indent=hang), err=True)


def ask_hazards(envelope: Envelope) -> bool:
    """Whether a person at this terminal confirms now; the rig file stores name and date.

    Without a terminal, or for a plan that is refused, there is no question and the answer is no.
    """
    from datetime import date

    from stepload.envelope.reason import PlanVerdict
    from stepload.plan.hazards import hazards_read, keep, keys_of
    from stepload.session.ready import refuse_simulated

    plan = envelope.plan
    if hazards_read(plan) or envelope.verdict is PlanVerdict.REFUSED:
        return False
    if not _at_a_terminal():
        return False
    refuse_simulated(plan)  # before a question about a rig that does not exist
    name = _name(f"Before the rig {plan.rig.name!r} moves for the first time:")
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
