"""Verbs for the first setup: a rig file step by step, and a plan from answers."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from stepload.errors import BadInputError, guess
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.setup.questions import Question

CONTEXT_SETTINGS = {"allow_extra_args": True, "ignore_unknown_options": True}
STEP_HELP = "Stop after this step: arm, sensor, push, start, way, plan, doctor, touch."


class Terminal:
    """Shows text and asks questions on a terminal; without one there are no answers."""

    def __init__(self, out: Output) -> None:
        self._out = out
        self._asks = sys.stdin.isatty() and sys.stderr.isatty()

    def tell(self, line: str) -> None:
        """Show one line."""
        self._out.line(line)

    def ask(self, question: Question) -> str | None:
        """The typed answer; None without a terminal."""
        if not self._asks:
            return None
        form = " yes or no" if question.consent else ""
        shown: str = typer.prompt(
            question.text + (" (KEY=VALUE, comma between)" if question.many else form),
            default=question.default, show_default=bool(question.default), err=True,
        )  # fmt: skip
        return shown


def setup(
    context: typer.Context,
    rig: Annotated[Path, Argument(help="Rig file to write.", show_default=False)],
    redo: Annotated[
        str, Option(help="Do this step again; where it finds something else, those after it too.")
    ] = "",
    until: Annotated[str, Option(help=STEP_HELP)] = "",
    yes: Annotated[
        bool, Option("--yes", help="Give every consent beforehand; for scripts.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write a rig file step by step; left at any time, the next start goes on.

    Every question is also a flag: `--host 192.168.1.10`, `--material acetal`; a flag that is none
    lists them all. Nothing moves without consent. Exit 0: all done; 3: a step was refused.

    Example: stepload setup rig.yaml
    """
    from stepload.session.experiment import press
    from stepload.setup.answers import Answers, from_flags
    from stepload.setup.wizard import STEPS, set_up

    out = Output(as_json=as_json)
    given = Answers(from_flags(context.args), Terminal(out), yes=yes)
    left = set_up(rig, given, press=press, redo=redo, until=until)
    out.line(f"\nwritten: {rig}" + (f"; to come: {', '.join(left)}" if left else ""))
    if not left:
        out.line(
            f"next: stepload calibrate PLAN --record FILE --into {rig} for the system stiffness,"
            " then stepload run with the plan of the first payload"
        )
    out.result({"rig": rig, "done": [name for name in STEPS if name not in left], "left": left})


def _presets(begun: str) -> list[str]:
    from stepload.setup.questions import PRESETS

    return [name for name in PRESETS if name.startswith(begun)]


def _rig_as_named(rig: Path, plan: Path) -> str:
    """A rig as named by the plan: a profile, or a file relative to the plan.

    Raises:
        BadInputError: it is neither.
    """
    import os

    from stepload.plan.references import profiles

    if not rig.is_file():
        if str(rig) in (known := profiles()):
            return str(rig)
        raise BadInputError(
            f"{rig} is no file and no profile",
            hint=f"{guess(str(rig), known)}`stepload setup` writes a rig file,"
            " `stepload profiles` lists profiles",
        )
    from_here = os.path.relpath(rig.resolve(), plan.resolve().parent)
    return from_here if "/" in from_here or rig.suffix in (".yaml", ".yml") else f"./{from_here}"


def init(
    context: typer.Context,
    rig: Annotated[
        Path, Argument(help="Rig file, or a profile, that the plan is for; before all flags.")
    ] = Path("stvf"),
    start: Annotated[
        str,
        Option(
            "--preset",
            help="Payload to begin with: sphere, cone, pyramid, flat-punch, unknown.",
            autocompletion=_presets,
        ),
    ] = "",
    plan: Annotated[Path, Option(help="Plan to write.")] = Path("plan.yaml"),
    force: Annotated[bool, Option("--force", help="Replace a file that is there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write the plan of a payload from answers. Exit 3: preflight refuses it.

    The questions are those of the plan's step in `stepload setup`: --shape, --radius, --material …
    A preset proposes most answers. The comments of the plan say what each key means and where its
    value is found.

    Example: stepload init --preset sphere
    """
    from stepload.cli.preflight import show_preflight
    from stepload.setup.answers import Answers, from_flags
    from stepload.setup.first_plan import first_plan, write_plan
    from stepload.setup.questions import preset

    out = Output(as_json=as_json)
    if plan.exists() and not force:
        raise BadInputError(f"{plan} is there already", hint="name another --plan, or --force")
    flags = list(context.args)
    if str(rig).startswith("--"):  # the first flag of a question, where no rig is named
        flags, rig = [str(rig), *flags], Path("stvf")
    named = _rig_as_named(rig, plan)
    given = Answers(from_flags(flags), Terminal(out), preset=preset(start) if start else {})
    text, preflight = first_plan(given, named, plan)
    write_plan(plan, text, force)
    show_preflight(replace(preflight, plan=replace(preflight.plan, path=plan)), out)
    out.line(f"written: {plan}")
    out.result({"plan": plan, "verdict": preflight.verdict})
