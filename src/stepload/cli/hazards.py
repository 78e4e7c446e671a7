"""The verb `hazards`, and what is asked once per rig: hazards read, wiring checked."""

from __future__ import annotations

import shutil
import sys
import textwrap
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.cli.options import rig_names
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stepload.feasibility.preflight import Preflight
    from stepload.plan.model import Plan

HazardsRead = Annotated[
    bool, typer.Option("--yes", help="Ask nothing: the hazards were read (stepload hazards RIG).")
]
WiringChecked = Annotated[
    bool, typer.Option("--wiring-checked", help="Ask nothing: axis, sign, approach were checked.")
]


def hazards(
    rig: Annotated[
        str,
        typer.Argument(
            help="Rig profile, rig file or plan (YAML).",
            show_default=False,
            autocompletion=rig_names,
        ),
    ],
    as_json: AsJson = False,
) -> None:
    """Say what software cannot prevent on a rig; to be read and signed once.

    Example: stepload hazards stvf
    """
    from stepload.feasibility.hazards import hazards_of
    from stepload.plan.hazards import HAZARDS, read_by, read_words, rows_of
    from stepload.plan.references import names_a_file

    out = Output(as_json=as_json)
    plan = _plan_of(rig)
    found = hazards_of(plan.rig)
    out.line(f"Hazards of {plan.rig.name} ({read_words(plan)})\n")
    for line in _lines(plan):
        out.line(line, hang=4)
    out.line("\nTo sign, below `rig:` in the rig file or plan:")
    rows = rows_of(read_by("NAME", date.today()))
    for row in rows if names_a_file(rig) else [f"profile: {rig}", *rows]:
        out.line(f"  {row}")
    signed = {"read_by": plan.rig.hazards_read_by, "read_on": plan.rig.hazards_read_on}
    out.result({"rig": plan.rig.name, **signed, "people": HAZARDS, "hazards": found})


def _plan_of(rig: str) -> Plan:
    """A plan with this rig: the one that is named, or one that is made to read the rig."""
    from stepload.feasibility.draft_plan import plan_of
    from stepload.feasibility.map_grid import PROBE_N
    from stepload.plan.load import load_plan
    from stepload.plan.references import tree_of
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
    from stepload.feasibility.hazards import hazards_of
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


def ask_before_pressing(preflight: Preflight, hazards_read: bool, wiring_checked: bool) -> bool:
    """Ask what is not known of a rig yet; True where the rig file may have changed.

    Without a terminal a line says what was not confirmed. A plan that is refused, or that names
    simulated devices, asks nothing.
    """
    signed = not hazards_read and ask_hazards(preflight)
    return _ask_wiring(preflight, wiring_checked) or signed


def ask_hazards(preflight: Preflight) -> bool:
    """Whether a person at this terminal signs now; the rig file stores name and date."""
    from stepload.plan.hazards import hazards_read, read_by, rig_argument

    plan = preflight.plan
    if hazards_read(plan) or not _may_move(preflight):
        return False
    if not _at_a_terminal():
        typer.echo(f"hazards not read yet: stepload hazards {rig_argument(plan)}", err=True)
        return False
    if name := _name(f"Before {plan.rig.name} moves for the first time:", _lines(plan)):
        _keep(plan, read_by(name, date.today()))
    return bool(name)


def _ask_wiring(preflight: Preflight, checked: bool) -> bool:
    """Whether axis and sign were checked by hand on this rig; the rig file stores the date."""
    from stepload.plan.hazards import WIRED, WIRING

    plan = preflight.plan
    if plan.rig.wiring_checked_on is not None or not _may_move(preflight):
        return False
    if not checked:
        _say(f"{plan.rig.name} presses for the first time. {WIRING}")
        if not _at_a_terminal():
            return False
        checked = typer.confirm("Was the wiring checked by hand?", default=False, err=True)
    if checked:
        _keep(plan, {WIRED: date.today()})
    return checked


def _may_move(preflight: Preflight) -> bool:
    """Whether the plan may run on devices."""
    from stepload.feasibility.reason import PlanVerdict
    from stepload.session.experiment import simulated_devices

    plan = preflight.plan
    refused = preflight.verdict is PlanVerdict.REFUSED
    return not (refused or simulated_devices(plan) or plan.missing)


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
