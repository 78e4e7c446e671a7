"""The verb `hazards`, and the question whether the hazards of a rig have been read."""

from __future__ import annotations

import shutil
import sys
import textwrap
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.results.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.envelope.envelope import Envelope
    from stepload.plan.model import Plan

HazardsRead = Annotated[
    bool,
    typer.Option("--yes", help="Ask nothing: the hazards were read (stepload hazards RIG)."),
]


def hazards(
    rig: Annotated[
        str, typer.Argument(help="Rig profile, rig file or plan (YAML).", show_default=False)
    ],
    as_json: AsJson = False,
) -> None:
    """Say what software cannot prevent on a rig, with its numbers; to be read and signed once.

    Example: stepload hazards stvf
    """
    from stepload.envelope.hazards import hazards_of
    from stepload.plan.hazards import HAZARDS, keys_of, read_words

    out = Output(as_json=as_json)
    plan = _plan_of(rig)
    found = hazards_of(plan.rig)
    out.line(f"Hazards of {plan.rig.name} ({read_words(plan)})\n")
    for line in _lines(plan):
        out.line(line, hang="    ")
    out.line("\nTo sign, below `rig:` in the rig file or plan:")
    for key in keys_of("NAME", date.today()):
        out.line(f"  {key}")
    out.result(
        {
            "rig": plan.rig.name,
            "read_by": plan.rig.hazards_read_by,
            "read_on": plan.rig.hazards_read_on,
            "people": HAZARDS,
            "hazards": found,
        }
    )


def _plan_of(rig: str) -> Plan:
    """A plan with this rig: the one that is named, or one that is made to read the rig."""
    from stepload.envelope.benches import PROBE_N
    from stepload.envelope.unwritten import plan_of
    from stepload.plan.load import load_plan
    from stepload.plan.places import tree_of
    from stepload.plan.shipped import payload_folder
    from stepload.plan.tree import Mapping

    path = Path(rig)
    if path.is_file():
        node = tree_of(path)
        if isinstance(node, Mapping) and node.entries.keys() & {"payload", "procedure"}:
            return load_plan(path)
        rig = str(path.resolve())
    return plan_of(rig, payload_folder() / "stiff-flat.yaml", PROBE_N)


def _lines(plan: Plan) -> list[str]:
    """What to read before a rig moves: for people, then for payload and rig."""
    from stepload.envelope.hazards import hazards_of
    from stepload.plan.hazards import HAZARDS

    lines = ["For people", *(f"  - {each}" for each in HAZARDS), "", "For payload and rig"]
    for each in hazards_of(plan.rig):
        lines += [f"  - {each.message}", f"    -> {each.remedy}"]
    return lines


def refuse_unread_driver(driver: str, read_now: bool) -> None:
    """Ask before a driver's arm moves, and refuse without a yes; no rig file stores the answer.

    Raises:
        RefusedError: reading the hazards was not confirmed.
    """
    from stepload.errors import RefusedError
    from stepload.plan.hazards import HAZARDS, PAGE

    lines = [f"  - {each}" for each in HAZARDS]
    if read_now or (_at_a_terminal() and _name(f"Before the arm of {driver!r} moves:", lines)):
        return
    raise RefusedError(
        f"--move: nobody has confirmed to have read the hazards of the arm that {driver!r} moves",
        hint=f"read {PAGE}; in a terminal the command asks; --yes in scripts",
    )


def _name(before: str, lines: list[str]) -> str:
    """Name of the person who has read the hazards, which are shown first; empty: none."""
    _say(before)
    for line in lines:
        _say(line, "    ")
    name: str = typer.prompt(
        "Your name, if you have read this and answer for the rig (empty: not now)",
        default="", show_default=False, err=True,
    )  # fmt: skip
    return name.strip()


def _say(text: str, hang: str = "") -> None:
    """A line on a terminal, wrapped between words."""
    columns = shutil.get_terminal_size().columns
    typer.echo(textwrap.fill(text, columns, subsequent_indent=hang), err=True)


def ask_hazards(envelope: Envelope) -> bool:
    """Whether a person at this terminal signs now; the rig file stores name and date.

    Without a terminal one line says that they are not read yet. A plan that is refused, or that
    names simulated devices, asks nothing.
    """
    from stepload.envelope.reason import PlanVerdict
    from stepload.plan.hazards import hazards_read, keep, keys_of, rig_argument
    from stepload.session.ready import simulated_devices

    plan = envelope.plan
    if hazards_read(plan) or envelope.verdict is PlanVerdict.REFUSED or simulated_devices(plan):
        return False
    if not _at_a_terminal():
        typer.echo(f"hazards not read yet: stepload hazards {rig_argument(plan)}", err=True)
        return False
    if not (name := _name(f"Before {plan.rig.name} moves for the first time:", _lines(plan))):
        return False
    today = date.today()
    if (path := keep(plan, name, today)) is not None:
        typer.echo(f"kept in {path}", err=True)
    else:
        typer.echo(f"for this time; to keep it, below `rig:`: {keys_of(name, today)}", err=True)
    return True


def _at_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()
