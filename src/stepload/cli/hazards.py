"""Asks, before the first start of a rig, whether hazards were read and the wiring checked."""

from __future__ import annotations

import shutil
import sys
import textwrap
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import date

    from stepload.envelope.envelope import Envelope
    from stepload.plan.model import Plan

HazardsRead = Annotated[
    bool,
    typer.Option("--yes", help="The hazards were read (docs/risk-assessment.md); for scripts."),
]
WiringChecked = Annotated[
    bool,
    typer.Option(
        "--wiring-checked", help="Axis and sign of the force were checked on this rig; for scripts."
    ),
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

    from stepload.plan.hazards import hazards_read, read_by

    plan = envelope.plan
    if hazards_read(plan) or not _may_ask(envelope):
        return False
    name = _name(f"Before the rig {plan.rig.name!r} moves for the first time:")
    if name:
        _keep(plan, read_by(name, date.today()))
    return bool(name)


def ask_before_pressing(envelope: Envelope, read: bool, checked: bool) -> tuple[bool, bool]:
    """Whether the hazards were read and the wiring checked; asks what is not known yet."""
    return read or ask_hazards(envelope), checked or ask_wiring(envelope)


def ask_wiring(envelope: Envelope) -> bool:
    """Whether a person at this terminal has checked the wiring; the rig file stores the date."""
    from datetime import date

    from stepload.plan.hazards import WIRED, WIRING

    plan = envelope.plan
    if plan.rig.wiring_checked_on is not None or not _may_ask(envelope):
        return False
    _say(f"Before the rig {plan.rig.name!r} presses for the first time: {WIRING}")
    checked = typer.confirm("Was this checked?", default=False, err=True)
    if checked:
        _keep(plan, {WIRED: date.today()})
    return checked


def _may_ask(envelope: Envelope) -> bool:
    """Whether there is somebody to ask, and a plan that may run."""
    from stepload.envelope.reason import PlanVerdict
    from stepload.session.ready import refuse_simulated

    if envelope.verdict is PlanVerdict.REFUSED or not _at_a_terminal():
        return False
    refuse_simulated(envelope.plan)  # before a question about a rig that does not exist
    envelope.plan.refuse_missing()
    return True


def _keep(plan: Plan, keys: Mapping[str, str | date]) -> None:
    """Write what was confirmed into the rig file, or show how to."""
    from stepload.plan.hazards import keep, rows_of

    if (path := keep(plan, keys)) is not None:
        typer.echo(f"kept in {path}", err=True)
    else:
        shown = "; ".join(rows_of(keys))
        typer.echo(f"for this time; to keep it, below `rig:`: {shown}", err=True)


def _at_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()
