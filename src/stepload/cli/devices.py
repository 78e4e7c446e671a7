"""Verbs about devices: list, show and test drivers; examine a plan's rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option
from typer.core import TyperGroup

from stepload.cli.hazards import HazardsRead, ask_hazards, refuse_unread_driver
from stepload.cli.options import DryRun, PlanFile, names_of, quantity
from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.declaration.sections import Key

KEYS = {
    "stepload.arms": "arm",
    "stepload.force_sensors": "force",
    "stepload.displacement_sensors": "displacement",
    "stepload.worlds": "simulation",
}
"""Key of a plan's rig under which a driver of each group, or a world, is named."""


class DriverNames(TyperGroup):
    """Makes `drivers NAME` short for `drivers show NAME`."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The verb that the arguments begin with; for a driver's name it is `show`."""
        if args and args[0] not in self.commands and not args[0].startswith("-"):
            args = ["show", *args]
        return super().resolve_command(ctx, args)


drivers = typer.Typer(cls=DriverNames, help="Installed drivers, and the contract they must keep.")


@drivers.callback(invoke_without_command=True)
def list_all(context: typer.Context, as_json: AsJson = False) -> None:
    """List installed drivers; broken ones with the reason."""
    if context.invoked_subcommand is not None:
        return
    from stepload.rig.plugins import list_drivers

    out, found = Output(as_json=as_json), list_drivers()
    rows = [(_kind(d.group), d.name, d.distribution, d.problem or "ready") for d in found]
    out.table("Drivers", ("kind", "name", "from", "state"), rows)
    out.result({"drivers": found})


def _kind(group: str) -> str:
    return group.removeprefix("stepload.")


def _groups(name: str, kind: str) -> list[str]:
    """The entry-point groups with a driver `name`, of one `kind` if it is not "".

    Raises:
        BadInputError: there is no such driver or kind.
    """
    from stepload.rig.plugins import driver_names

    if kind and f"stepload.{kind}" not in KEYS:
        raise BadInputError(f"--kind {kind}", hint=f"one of {', '.join(_kind(g) for g in KEYS)}")
    found = [g for g in KEYS if name in driver_names(g) and kind in ("", _kind(g))]
    if not found:
        raise BadInputError(
            f"no driver named {name!r} is installed",
            hint=f"installed: {', '.join(names_of(KEYS, ''))}",
        )
    return found


def _kinds(incomplete: str) -> list[str]:
    """Kinds of driver that begin with a text, for the shell's completion."""
    return [kind for kind in map(_kind, KEYS) if kind.startswith(incomplete)]


DriverName = Annotated[
    str,
    Argument(
        help="Driver, as `stepload drivers` lists it.",
        autocompletion=lambda incomplete: names_of(KEYS, incomplete),
    ),
]
Kind = Annotated[
    str,
    Option(help="arms, force_sensors, displacement_sensors or worlds.", autocompletion=_kinds),
]


@drivers.command("show")
def show(name: DriverName, kind: Kind = "", as_json: AsJson = False) -> None:
    """Show a driver's options with units, defaults and limits, and how a plan names it.

    Example: stepload drivers ur
    """
    from stepload.declaration.sections import keys, schema_of
    from stepload.rig.plugins import WORLDS, load_plugin, options_of

    out, shown = Output(as_json=as_json), {}
    for group in _groups(name, kind):
        about = (load_plugin(group, name).__doc__ or "").strip().split("\n\n")[0]
        out.line(f"{name} ({KEYS[group]}): {' '.join(about.split())}")
        options = keys(options_of(group, name))
        rows = [(key.name, key.expected, _default(key), key.meaning) for key in options]
        out.table("Options", ("key", "value", "default", "meaning"), rows)
        needed = ", ".join(f"{key.name}: …" for key in options if key.required)
        named, given = ("world", "world_options") if group == WORLDS else ("driver", "options")
        inside = f", {given}: {{{needed}}}" if needed else ""
        out.line(f"in a plan: rig: {{{KEYS[group]}: {{{named}: {name}{inside}}}}}")
        shown[group] = {
            key.name: {
                "help": key.meaning,
                "required": key.required,
                "default": None if key.required else key.info.default,
                "schema": schema_of(key.hint),
            }
            for key in options
        }
    out.result({"name": name, "options": shown})


def _default(key: Key) -> str:
    if key.required:
        return "required"
    shown = key.default_text
    if isinstance(shown, bool):
        return str(shown).lower()
    return str(key.info.default or "") if shown is None else str(shown)


@drivers.command("test")
def try_driver(
    name: DriverName,
    options: Annotated[
        list[str] | None, Option(help="KEY=VALUE as in a plan, repeatable; or one YAML file.")
    ] = None,
    kind: Kind = "",
    move: Annotated[
        float | None, quantity("--move", "m", 'Move an arm so far towards the plate, "2 mm".')
    ] = None,
    unplug: Annotated[
        bool, Option("--unplug", help="Ask for the cable to be pulled, to prove staleness.")
    ] = False,
    load: Annotated[
        str, Option(help='Ask for a known load, "9.81 N"; for a gauge a way, "1 mm".')
    ] = "",
    load_axis: Annotated[
        str, Option(help="Force component that the load makes larger, +fz: its sign is checked.")
    ] = "",
    noise: Annotated[str, Option(help='Standard deviation of readings at rest, "0.1 N".')] = "",
    resolution: Annotated[str, Option(help='Smallest step between readings, "0.05 N".')] = "",
    seconds: Annotated[float, Option(help="How long to watch the data.")] = 1.0,
    hazards_read: HazardsRead = False,
    open_timeout: Annotated[float, Option(help="Deadline of `open`, in s.")] = 15.0,
    as_json: AsJson = False,
) -> None:
    """Run the contract on a driver and its device, or on a world. Exit 0: kept; 4: broken.

    Works for any installed driver, one of your own package too. The device is opened several times.
    Nothing is moved without --move, nor before somebody has read the hazards; do that in free air
    only, with twice that way free behind the arm. Let sensors be unloaded: `bias` is tried. What
    was not tried is listed with the reason.

    Example: stepload drivers test sim --kind force_sensors
    """
    from dataclasses import asdict
    from functools import partial

    from stepload.declaration.quantities import Axis
    from stepload.plan.compose import SIMULATED
    from stepload.plan.driver_options import options_from_words
    from stepload.plan.reader import checked
    from stepload.rig.contract import CheckStatus, Trial, run_trial, trial_of
    from stepload.rig.contract_world import run_world
    from stepload.rig.plugins import WORLDS, load_plugin
    from stepload.units import parse_named

    group, *others = _groups(name, kind)
    if others:
        kinds = ", ".join(_kind(each) for each in (group, *others))
        raise BadInputError(
            f"several drivers are named {name!r}", hint=f"say --kind, one of {kinds}"
        )
    given = options_from_words(group, name, options or [])
    unit = "m" if group == "stepload.displacement_sensors" else "N"
    make, make_with = trial_of(load_plugin(group, name), given)
    if load_axis and not (load and group == "stepload.force_sensors"):
        raise BadInputError("--load-axis is of a force sensor under --load")
    if move is not None and not move > 0.0:
        raise BadInputError(f"--move: {move:g} m is not above 0", hint="how far towards the plate")
    size = parse_named("--load", load, unit) if load else 0.0

    def ask(text: str) -> None:
        """Ask the person at the device to do something by hand, and wait for Enter."""
        typer.prompt(f"{text}, then press Enter", default="", show_default=False, err=as_json)

    def put_on() -> float:
        ask(f"Put {load} on the device")
        return size

    trial = Trial(
        make,
        make_with,
        open_timeout_s=open_timeout,
        observe_s=seconds,
        silence=partial(ask, "Pull the data cable of the device") if unplug else None,
        restore=partial(ask, "Plug the cable in again"),
        load=put_on if load else None,
        load_axis=checked(Axis, load_axis) if load_axis else "",
        noise=parse_named("--noise", noise, unit) if noise else None,
        resolution=parse_named("--resolution", resolution, unit) if resolution else 0.0,
        move_m=move or 0.0,
    )
    if move and group == "stepload.arms" and name != SIMULATED:
        refuse_unread_driver(name, hazards_read)
    world = group == WORLDS
    results = run_world(load_plugin(group, name), given) if world else run_trial(trial)
    out = Output(as_json=as_json)
    rows = [(r.name, r.status.value, f"{r.seconds:.1f} s", r.message) for r in results]
    out.table(f"Contract of {name}", ("check", "status", "took", ""), rows)
    broken = [result for result in results if result.status is CheckStatus.FAILED]
    skipped = [result.name for result in results if result.status is CheckStatus.SKIPPED]
    kept = "keeps the contract" if not broken else f"breaks it in {len(broken)} checks"
    untried = f"; not tried: {', '.join(skipped)}" if skipped else ""
    out.line(f"{name}: {kept}{untried}")
    # `verdict` is the older name of `status`.
    checks = [{"name": r.name, "verdict": r.status} | asdict(r) for r in results]
    out.result({"driver": name, "kind": group, "kept": not broken, "checks": checks})
    if broken:
        raise typer.Exit(ExitCode.STOPPED)


@drivers.command("new")
def new(
    name: Annotated[str, Argument(help="Name of the driver and its package.", show_default=False)],
    arm: Annotated[bool, Option("--arm", help="For an arm.")] = False,
    force: Annotated[bool, Option("--force", help="For a force sensor.")] = False,
    out: Annotated[Path | None, Option("--out", help="A new directory; default: NAME.")] = None,
    as_json: AsJson = False,
) -> None:
    """Write the project of a new driver: package, emulator, contract test.

    As written it keeps the contract on its emulator; what is yours to change is marked HERE.

    Example: stepload drivers new acme_cell --force
    """
    from stepload.setup.driver_project import write_project

    if arm == force:
        raise BadInputError("say the kind of device", hint="--arm or --force")
    output, directory, kind = Output(as_json=as_json), out or Path(name), "arm" if arm else "force"
    files = write_project(name, kind, directory)
    output.line("\n".join(map(str, files)))
    output.line(f"next: cd {directory} && pip install -e '.[dev]' && pytest")
    output.result({"name": name, "kind": kind, "directory": directory, "files": files})


def doctor(
    plan: PlanFile,
    dry_run: DryRun = False,
    still: Annotated[
        bool, Option("--still", help="Move nothing; stop and delays stay unproven.")
    ] = False,
    seconds: Annotated[float, Option(help="How long to watch the data at rest.")] = 10.0,
    hazards_read: HazardsRead = False,
    as_json: AsJson = False,
) -> None:
    """Examine a plan's rig: data, disk, clocks, stop. Exit 0: sound; 4: not.

    Needs free air: the arm moves up to 2 mm away from the plate, at up to 4 mm/s, and back.

    Example: stepload doctor procedures/plastic-sphere.yaml --dry-run
    """
    from stepload.engine.operator import Operator
    from stepload.feasibility.preflight import preflight_of
    from stepload.plan.load import load_plan
    from stepload.session.experiment import refuse_simulated
    from stepload.setup.checkup import examine

    out = Output(as_json=as_json)
    preflight = preflight_of(load_plan(plan))
    if not dry_run:
        refuse_simulated(preflight.plan)
    if not dry_run and not hazards_read and not still:
        ask_hazards(preflight)
    with Operator().listening():
        found = examine(
            preflight, dry_run=dry_run, seconds=seconds, still=still,
            tell=lambda line: out.finding(line.finding),
        )  # fmt: skip
    if found.snippet:
        out.line("\nmeasured, for the rig file:\n")
        out.line(found.snippet)
    marks = [line.mark.value for line in found.lines]
    out.line(f"{marks.count('ok')} ok, {marks.count('warn')} warn, {marks.count('fail')} fail")
    out.result({"sound": not found.failed, "lines": found.lines, "rig": found.snippet})
    if found.failed:
        raise typer.Exit(ExitCode.STOPPED)
