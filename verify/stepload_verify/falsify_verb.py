"""The verb that looks for the worst case instead of the typical one."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.errors import BadInputError, ExitCode
from stepload.results.terminal import AsJson, Output
from stepload_verify.campaign_verb import ORDER, ctrl_c_said

if TYPE_CHECKING:
    from stepload_verify.campaign.scenario import Scenario
    from stepload_verify.falsify.hunt import Hunt
    from stepload_verify.falsify.trial import Search, Trial

SHOWN = 15
PLAIN_EVERY_S = 30.0


def falsify(
    plan: Annotated[Path, typer.Argument(help=ORDER, show_default=False)],
    trials: Annotated[
        int,
        typer.Option("--trials", min=1, help="About how many runs; of each stratum at least 4."),
    ] = 20_000,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Decides every run.")] = 1,
    wrong: Annotated[
        list[str] | None,
        typer.Option(
            "--wrong",
            help="Only runs with these faults: force_gain+second_freeze; +any: and one more.",
        ),
    ] = None,
    wider: Annotated[
        bool, typer.Option("--wider", help="Faults that the campaign leaves out.")
    ] = False,
    axes: Annotated[
        str, typer.Option("--axes", help="one: along the press alone; six: the whole wrench.")
    ] = "one",
    out: Annotated[
        Path | None, typer.Option("--out", help="Directory of trials; the search goes on there.")
    ] = None,
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="Processes; all cores by default.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", help="A Dask cluster instead, such as tcp://10.0.0.5:8786."),
    ] = None,
    without: Annotated[
        str, typer.Option("--without", help="Leave out a rule or layer: R5, leash.")
    ] = "",
    replay: Annotated[
        Path | None, typer.Option("--replay", help="Run this scene file again.", show_default=False)
    ] = None,
    shrink: Annotated[
        Path | None,
        typer.Option("--shrink", help="Write the scene of --replay here, made simple."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Search for the run that passes F_c: exit 0 if none was found, else 4.

    Example: stepload falsify procedures/falsify.yaml --trials 20000 --out falsify
    """
    from stepload.plan.load import load_plan
    from stepload.runner.choose import open_pool
    from stepload_verify.campaign.ablation import Ablation
    from stepload_verify.campaign.scenario import axes_from
    from stepload_verify.falsify.falsify import falsify as search
    from stepload_verify.falsify.search import FEWEST
    from stepload_verify.falsify.strata import named, strata
    from stepload_verify.falsify.trial import Search

    output = Output(as_json=as_json)
    if without:
        without = Ablation(without).name
    what = Search(load_plan(plan), without)
    if replay is not None:
        with ctrl_c_said("interrupted: that scene has no result"):
            _replay(replay, shrink, what, output)
        return
    if shrink is not None:
        raise BadInputError("--shrink needs a scene", hint="give it with --replay FILE")
    axes = axes_from(axes)
    where = strata(wider=wider, axes=axes)
    if wrong:
        where = list(dict.fromkeys(one for text in wrong for one in named(text, axes)))
    if (least := FEWEST * len(where)) > trials:
        output.line(f"{least} runs, {FEWEST} in each of {len(where)} strata; fewer are no search")
    begun_s = time.monotonic()
    kept = f"the finished trials are in {out}; the same command goes on there"
    with (
        ctrl_c_said(kept if out else "interrupted; with --out it could go on"),
        _shown(trials) as show,
        open_pool(processes, scheduler) as pool,
    ):
        hunts = search(
            what, where, trials=trials, seed=seed, pool=pool, directory=out, on_progress=show
        )
    _report(hunts, time.monotonic() - begun_s, output)


def _report(hunts: Sequence[Hunt], elapsed_s: float, output: Output) -> None:
    from stepload_verify.falsify.falsify import worst
    from stepload_verify.falsify.scene import LONGEST_FROZEN_S, LONGEST_S

    rows = worst(hunts)
    broken = [row for row in rows if row.found_after is not None]
    claimed = [row.j for row in rows if row.j is not None and not row.hazard]
    largest = _figure(claimed[0]) if claimed else "unknown: there was no such run"
    named = sum(row.j is not None and row.j > 1.0 and bool(row.hazard) for row in rows)
    runs = sum(row.runs for row in rows)
    output.table(
        "Worst run per stratum (J: 0 at the top force, above 1 beyond F_c)",
        ("second channel: what is wrong", "runs", "worst J", "F/F_c", "ended by", "in", "hazard"),
        [
            (row.stratum, str(row.runs), _figure(row.j), _figure(row.peak_ratio), row.ended_by,
             row.phase.lower(), row.hazard)
            for row in rows[:SHOWN]
        ],
    )  # fmt: skip
    for row in broken:
        output.line(f"F_c was passed: {row.stratum}, after {row.found_after} runs of it")
    empty = sum(row.runs == 0 for row in rows)
    output.line(
        f"{runs} runs in {len(rows)} strata in {elapsed_s:.0f} s: F_c was passed in"
        f" {len(broken)} strata, and in {named} more by a hazard that preflight names;"
        f" the largest J without one is {largest}"
    )
    if empty:
        output.line(
            f"not searched: {empty} of these strata, where no point was a run: both channels lie,"
            " which preflight names, or no rig could press within the time"
        )
    output.line("what a search did not find may exist: its figures bound nothing")
    output.result(
        {
            "runs": runs,
            "strata": len(rows),
            "strata_without_run": empty,
            "broken": [row.stratum for row in broken],
            "worst": rows,
            "elapsed_s": elapsed_s,
        }
    )
    if not runs:
        raise BadInputError(
            "nothing was searched: no point was a run",
            hint=f"a plan with a short order, such as procedures/falsify.yaml: runs longer than"
            f" {LONGEST_S:g} s ({LONGEST_FROZEN_S:g} s where a channel freezes) are left out; or"
            " other --wrong",
        )
    raise typer.Exit(ExitCode.STOPPED if broken else ExitCode.OK)


def _replay(path: Path, simple: Path | None, what: Search, output: Output) -> None:
    from stepload.plan.room_to_write import check_new, check_room
    from stepload_verify.campaign.replay import plant_rows, wrong_rows
    from stepload_verify.falsify.scene_file import read_scene, text_of
    from stepload_verify.falsify.shrink import shrink
    from stepload_verify.falsify.trial import judge

    scenario, found = read_scene(path)
    if simple is not None:
        check_new("--shrink", simple)
        check_room("--shrink", simple)
    trial = judge(scenario, what.ablation)
    if simple is not None:
        scenario = shrink(scenario, _as_bad_as(trial, what))
        trial = judge(scenario, what.ablation)
        figures = {"j": trial.j, "peak_ratio": trial.peak_ratio}
        simple.write_text(text_of(scenario, figures), encoding="utf-8")
    output.table("plant", ("figure", "value"), list(plant_rows(scenario)))
    output.table("what goes wrong", ("when", "what"), list(wrong_rows(scenario)))
    output.line(
        f"{trial.series}: J = {trial.j:.4g}, true peak {trial.peak_ratio:.4f} F_c,"
        f" {trial.status}{f' by {trial.rule}' if trial.rule else ''} in {trial.phase}"
        f"{_before(found)}"
    )
    output.result({"trial": trial, "found": found})
    raise typer.Exit(ExitCode.STOPPED if trial.broken else ExitCode.OK)


def _as_bad_as(trial: Trial, what: Search) -> Callable[[Scenario], bool]:
    """Whether a simpler run passes F_c too; or nine tenths of J, where this one did not.

    A run that passes F_c without a named hazard is never made into one that a hazard explains.
    """
    from stepload_verify.falsify.trial import judge

    least = 1.0 if trial.broken else 0.9 * trial.j

    def still(scenario: Scenario) -> bool:
        simpler = judge(scenario, what.ablation)
        return simpler.j >= least and simpler.broken >= trial.broken

    return still


def _before(found: Mapping[str, float]) -> str:
    return f"; J = {found['j']:.4g} when it was written" if "j" in found else ""


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


@contextmanager
def _shown(trials: int) -> Iterator[Callable[[list[Hunt]], None]]:
    due_s = [time.monotonic() + PLAIN_EVERY_S]

    def show(hunts: list[Hunt]) -> None:
        if time.monotonic() < due_s[0]:
            return
        due_s[0] = time.monotonic() + PLAIN_EVERY_S
        best = max(hunts, key=lambda hunt: hunt.score)
        tried = sum(hunt.tried for hunt in hunts)
        told = f", worst J {best.best[1].j:.3f} ({best.stratum.name})" if best.best else ""
        print(f"falsify: {tried} of about {trials} trials{told}", file=sys.stderr, flush=True)

    yield show
