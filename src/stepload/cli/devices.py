"""Verbs about drivers: list them, show one, test one against the contract."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from stepload.cli.hazards import HazardsRead, refuse_unread_driver
from stepload.errors import BadInputError, ExitCode
from stepload.results.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.declaration.sections import Key


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


def _group(name: str, kind: str) -> str:
    """The entry-point group of driver `name`.

    Raises:
        BadInputError: no such driver, or several and `kind` does not select one.
    """
    from stepload.rig.plugins import GROUPS, driver_names

    if kind and f"stepload.{kind}" not in GROUPS:
        known = ", ".join(group.removeprefix("stepload.") for group in GROUPS)
        raise BadInputError(f"--kind {kind}", hint=f"one of {known}")
    found = [g for g in GROUPS if name in driver_names(g) and kind in ("", g.split(".")[1])]
    if len(found) == 1:
        return found[0]
    if not found:
        raise BadInputError(
            f"no driver named {name!r} is installed", hint=f"installed: {', '.join(_names(''))}"
        )
    kinds = ", ".join(group.removeprefix("stepload.") for group in found)
    raise BadInputError(f"several drivers are named {name!r}", hint=f"say --kind, one of {kinds}")


def _names(incomplete: str) -> list[str]:
    """Drivers whose names begin with a text, for the shell's completion."""
    from stepload.rig.plugins import GROUPS, driver_names

    names = {name for group in GROUPS for name in driver_names(group)}
    return sorted(name for name in names if name.startswith(incomplete))


@drivers.command("show")
def show(
    name: Annotated[
        str,
        typer.Argument(help="Driver, as `stepload drivers` lists it.", autocompletion=_names),
    ],
    kind: Annotated[
        str, typer.Option("--kind", help="arms, force_sensors or displacement_sensors.")
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Show a driver's options with units, defaults and limits, and how a plan names it.

    Example: stepload drivers ur
    """
    from stepload.declaration.sections import keys, schema_of
    from stepload.rig.plugins import GROUPS, driver_names, load_driver

    out = Output(as_json=as_json)
    groups = [_group(name, kind)] if kind else [g for g in GROUPS if name in driver_names(g)]
    shown = {}
    for group in groups or [_group(name, kind)]:
        driver = load_driver(group, name)
        about = (driver.__doc__ or "").strip().split("\n\n")[0]
        out.line(f"{name} ({KEYS[group]}): {' '.join(about.split())}")
        options = keys(driver.OPTIONS)
        rows = [(key.name, key.expected, _default(key), key.meaning) for key in options]
        out.table("options", ("key", "value", "default", "meaning"), rows)
        needed = [key.name for key in options if key.required]
        inside = f", options: {{{', '.join(f'{key}: …' for key in needed)}}}" if needed else ""
        out.line(f"in a plan: rig: {{{KEYS[group]}: {{driver: {name}{inside}}}}}")
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


KEYS = {
    "stepload.arms": "arm",
    "stepload.force_sensors": "force",
    "stepload.displacement_sensors": "displacement",
}
"""Key of a plan under which a driver of each group is named."""


def _default(key: Key) -> str:
    if key.required:
        return "required"
    shown = key.default_text
    if isinstance(shown, bool):
        return str(shown).lower()
    return str(key.info.default or "") if shown is None else str(shown)


@drivers.command("test")
def try_driver(
    name: Annotated[str, typer.Argument(help="Driver, as `stepload drivers` lists it.")],
    options: Annotated[
        list[str] | None,
        typer.Option("--options", help="KEY=VALUE as in a plan, repeatable; or one YAML file."),
    ] = None,
    kind: Annotated[
        str, typer.Option("--kind", help="arms, force_sensors or displacement_sensors.")
    ] = "",
    move: Annotated[
        str, typer.Option("--move", help='Move an arm this far towards the plate, "2 mm".')
    ] = "",
    unplug: Annotated[
        bool,
        typer.Option("--unplug", help="Ask for the cable to be pulled, to prove staleness."),
    ] = False,
    load: Annotated[
        str,
        typer.Option("--load", help='Ask for a known load, "9.81 N"; for a gauge a way, "1 mm".'),
    ] = "",
    noise: Annotated[
        str, typer.Option("--noise", help='Standard deviation of readings at rest, "0.1 N".')
    ] = "",
    resolution: Annotated[
        str, typer.Option("--resolution", help='Smallest step between readings, "0.05 N".')
    ] = "",
    seconds: Annotated[float, typer.Option("--seconds", help="How long to watch the data.")] = 1.0,
    hazards_read: HazardsRead = False,
    open_timeout: Annotated[float, typer.Option(help="Deadline of `open`, in s.")] = 15.0,
    as_json: AsJson = False,
) -> None:
    """Run the contract on a driver and its device. Exit 0: kept; 4: broken.

    Works for any installed driver, one of your own package too. The device is opened several times.
    Nothing is moved without --move, nor before somebody has read the hazards; do that in free air
    only, with twice that way free behind the arm. Let sensors be unloaded: `bias` is tried. What
    was not tried is listed with the reason.

    Example: stepload drivers test sim --kind force_sensors
    """
    from dataclasses import asdict
    from functools import partial

    from stepload.plan.driver_options import options_from_words
    from stepload.plan.overlay import SIMULATED
    from stepload.rig.contract import CheckStatus, Trial, run_trial, trial_of
    from stepload.rig.plugins import load_driver
    from stepload.units import parse_quantity

    group = _group(name, kind)
    given = options_from_words(group, name, options or [])
    unit = "m" if group == "stepload.displacement_sensors" else "N"
    make, make_with = trial_of(load_driver(group, name), given)
    move_m = parse_quantity(move, "m") if move else 0.0
    if move and not move_m > 0.0:
        raise BadInputError(f"--move {move!r} is not above 0", hint="how far towards the plate")
    size = parse_quantity(load, unit) if load else 0.0

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
        noise=parse_quantity(noise, unit) if noise else None,
        resolution=parse_quantity(resolution, unit) if resolution else 0.0,
        move_m=move_m,
    )
    if move and group == "stepload.arms" and name != SIMULATED:
        refuse_unread_driver(name, hazards_read)
    results = run_trial(trial)
    out = Output(as_json=as_json)
    out.table(
        f"contract of {name}",
        ("check", "status", "took", ""),
        [(r.name, r.status.value, f"{r.seconds:.1f} s", r.message) for r in results],
    )
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
