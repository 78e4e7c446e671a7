"""Verbs about drivers: which there are, whether they keep the contract."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from stepload.errors import BadInputError, ExitCode
from stepload.results.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.rig.contract import CheckResult

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


def _group(name: str, kind: str) -> str:
    """The entry-point group of driver `name`.

    Raises:
        BadInputError: no such driver, or several and `kind` does not say which.
    """
    from stepload.rig.plugins import GROUPS, driver_names

    if kind and f"stepload.{kind}" not in GROUPS:
        known = ", ".join(group.removeprefix("stepload.") for group in GROUPS)
        raise BadInputError(f"--kind {kind}", hint=f"one of {known}")
    found = [g for g in GROUPS if name in driver_names(g) and kind in ("", g.split(".")[1])]
    if len(found) == 1:
        return found[0]
    if not found:
        names = sorted({n for group in GROUPS for n in driver_names(group)})
        raise BadInputError(
            f"no driver named {name!r} is installed", hint=f"installed: {', '.join(names)}"
        )
    kinds = ", ".join(group.removeprefix("stepload.") for group in found)
    raise BadInputError(f"several drivers are named {name!r}", hint=f"say --kind, one of {kinds}")


@drivers_app.command("test")
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
    seconds: Annotated[float, typer.Option("--seconds", help="How long to watch the data.")] = 1.0,
    open_timeout: Annotated[float, typer.Option(help="Deadline of `open`, in s.")] = 15.0,
    as_json: AsJson = False,
) -> None:
    """Run the contract on a driver and its device. Exit 0: kept; 4: broken.

    Works for any installed driver, one of your own package too. The device is opened several times.
    Nothing is moved without --move; do that in free air only. Let sensors be unloaded: `bias` is
    tried.
    """
    from stepload.plan.option_text import options_from_words
    from stepload.rig.contract import Trial, Verdict, run_trial
    from stepload.rig.plugins import load_driver
    from stepload.units import parse_quantity

    group = _group(name, kind)
    given = options_from_words(group, name, options or [])
    driver = load_driver(group, name)
    trial = Trial(
        lambda: driver(**given),
        open_timeout_s=open_timeout,
        observe_s=seconds,
        move_m=parse_quantity(move, "m") if move else 0.0,
    )
    results = run_trial(trial)
    out = Output(as_json=as_json)
    _show(name, results, out)
    broken = [result for result in results if result.verdict is Verdict.FAILED]
    kept = "keeps the contract" if not broken else f"breaks it in {len(broken)} checks"
    out.line(f"{name}: {kept}")
    out.result({"driver": name, "kind": group, "kept": not broken, "checks": results})
    if broken:
        raise typer.Exit(ExitCode.STOPPED)


def _show(name: str, results: list[CheckResult], out: Output) -> None:
    out.table(
        f"contract of {name}",
        ("check", "verdict", "took", ""),
        [(r.name, r.verdict.value, f"{r.seconds:.1f} s", r.message) for r in results],
    )


def register(app: typer.Typer) -> None:
    """Add this room's verbs."""
    app.add_typer(drivers_app, name="drivers")
