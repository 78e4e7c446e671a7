"""stepload's own verbs, built on demand: until one is called, its name and line of help suffice.

Parsing the options of every verb costs more than most verbs need to begin. Verbs of other installed
packages (entry points of the group `stepload.verbs`) are looked up only if all names are needed, or
one that is not stepload's own.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any, ClassVar, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_group

from stepload.errors import BadInputError

ENTRY_POINTS = "stepload.verbs"
LINES = {
    "preflight.preflight": "Say whether a run can succeed. Exit 0: go or warn; 3: refused.",
    "reference.schema": "Print the JSON Schema of a plan, for editors, or that of results.json.",
    "reference.profiles": "List the rig profiles and data sheets that come with stepload.",
    "reference.plans": "Plans that come with stepload, ready to run or to begin with.",
    "setup.setup": "Write a rig file step by step; left at any time, the next start goes on.",
    "setup.init": "Write the plan of a payload from answers. Exit 3: preflight refuses it.",
    "run.run": "Run a plan: preflight, press, record, identify, report.",
    "run.pause": "Pause a run after its step, unloaded; with --resume it goes on.",
    "ui.ui": "Show runs, reports, the live run and preflight in a browser; it starts no motion.",
    "reference.layout": "Write a layout for Foxglove and Lichtblick.",
    "batch.batch": "Press specimen after specimen by a list; table and control chart of all.",
    "identify.identify": "Identify the contact law from a record, or a curve of another machine.",
    "records.recover": "Repair what was not finished, verify it, and identify what is there.",
    "records.replay": "Run the supervisor over a record. Exit 4: it would have tripped.",
    "calibrate.calibrate": "Measure the system stiffness K_s (26) and write its record.",
    "compare.compare": "Compare runs and curves: which differ, and Table II of the paper.",
    "data.runs": "List the runs of a directory: payload, date, verdict, stiffness, end.",
    "data.export": "Write curve, levels, touches and raw streams for other programs.",
    "data.snippet": "Print the identified law as contact parameters of a simulator.",
    "devices.drivers": "Installed drivers, and the contract they must keep.",
    "devices.doctor": "Examine a plan's rig: data, disk, clocks, stop. Exit 0: sound; 4: not.",
    "hazards.hazards": "Say what software cannot prevent on a rig; to be read and signed once.",
    "reference.explain": "Say what a code, key, threshold or word means and what to do.",
    "design.map": "Say which payloads a rig can measure, and what narrows their intervals.",
    "design.design": "Write the plan with the narrowest interval, below F_c and within a time.",
    "predict.predict": "Predict force against deformation of a payload; nothing is moved.",
    "design.pose": "Say where to put the plate and how to hold the arm.",
}
"""The first paragraph of each verb's help, by its module and its name."""


class Verb(NamedTuple):
    """Declaration of a verb that is not built yet."""

    name: str
    room: str
    """Module with the function or group of this name, and their `CONTEXT_SETTINGS` if any."""
    line: str
    """The first paragraph of its help."""


class Declared(TyperCommand):
    """Placeholder of a verb where only its name and its line are needed."""

    def __init__(self, verb: Verb) -> None:
        super().__init__(verb.name, help=verb.line, short_help=verb.line, rich_markup_mode=None)
        self.verb = verb

    def built(self) -> Any:
        """The verb itself, from its module."""
        app, room = typer.Typer(rich_markup_mode=None), import_module(self.verb.room)
        found = getattr(room, self.verb.name)
        if isinstance(found, typer.Typer):
            app.add_typer(found, name=self.verb.name)
        else:
            app.command(context_settings=getattr(room, "CONTEXT_SETTINGS", None))(found)
        return _group_of(app).commands[self.verb.name]


def _group_of(app: typer.Typer) -> TyperGroup:
    """The verbs of an application; lists show the whole first paragraph of each one's help."""
    group = get_group(app)
    whole: list[Any] = [group]
    for each in whole:
        whole += getattr(each, "commands", {}).values()
        each.short_help = each.short_help or " ".join((each.help or "").split("\n\n")[0].split())
    return group


@cache
def _others() -> typer.Typer:
    """Verbs of other installed packages, looked up once in a process."""
    from importlib.metadata import entry_points

    app = typer.Typer(rich_markup_mode=None)
    for point in entry_points(group=ENTRY_POINTS):
        point.load()(app)
    return app


class OwnVerbs(TyperGroup):
    """The `stepload` command's group, of which only the verb that is called is built."""

    VERBS = tuple(
        Verb(name, f"stepload.cli.{room}", line)
        for (room, _, name), line in ((path.partition("."), line) for path, line in LINES.items())
    )
    ELSEWHERE: ClassVar = dict.fromkeys(
        ("campaign", "emulate", "falsify", "paper"),
        ("stepload-verify", 'pip install "stepload[verify]"'),
    )
    """Verbs of a package of ours that need not be installed: its name, and how it is."""

    def __init__(self, **attrs: Any) -> None:
        super().__init__(**attrs)
        self.commands = {verb.name: Declared(verb) for verb in self.VERBS} | dict(self.commands)
        self._requested = False

    def _ask_others(self) -> None:
        if not self._requested:
            self._requested = True
            self.commands = {**_group_of(_others()).commands, **self.commands}

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The verb of this name, or its placeholder; None where there is none.

        Raises:
            BadInputError: the package that it is in is not installed.
        """
        if cmd_name not in self.commands:
            self._ask_others()
        if cmd_name not in self.commands and cmd_name in self.ELSEWHERE:
            package, hint = self.ELSEWHERE[cmd_name]
            raise BadInputError(f"`{cmd_name}` needs {package}, which is not installed", hint=hint)
        return self.commands.get(cmd_name)

    def list_commands(self, ctx: Any) -> list[str]:
        """Every verb's name: stepload's own, then those of other packages."""
        self._ask_others()
        own = [verb.name for verb in self.VERBS]
        return own + [name for name in self.commands if name not in own]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The verb that the arguments begin with, built."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command.built() if isinstance(command, Declared) else command, rest
