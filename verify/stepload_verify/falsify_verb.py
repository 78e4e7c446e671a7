"""The verb that looks for the worst case instead of the typical one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output, Processes
from stepload_verify.campaign_verb import ORDER, ctrl_c_said, now_and_then

if TYPE_CHECKING:
    from stepload_verify.falsify.falsify import Search
    from stepload_verify.falsify.hunt import Row
    from stepload_verify.falsify.strata import Stratum

SHOWN = 25


def falsify(
    plan: Annotated[Path, typer.Argument(help=ORDER, show_default=False)],
    evaluations: Annotated[
        int, typer.Option("--evaluations", min=1, help="Runs of each stratum.")
    ] = 1000,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Decides every run.")] = 1,
    wrong: Annotated[
        list[str] | None,
        typer.Option("--wrong", help="Only this fault; a pair: force_gain+second_freeze."),
    ] = None,
    phase: Annotated[
        str, typer.Option("--phase", help="Only faults that begin in: start, free, touch, …")
    ] = "",
    count: Annotated[
        int, typer.Option("--faults-per-run", min=1, max=2, help="1, or every pair.")
    ] = 1,
    axes: Annotated[
        str, typer.Option("--axes", help="one: along the press alone; six: the whole wrench; both.")
    ] = "both",
    channels: Annotated[
        int | None, typer.Option("--channels", min=1, max=2, help="Only rigs with 1 or 2.")
    ] = None,
    from_j: Annotated[
        float | None,
        typer.Option("--from-j", help="Only strata in --out whose worst J is at least this."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Directory of rows; the search goes on there.")
    ] = None,
    processes: Processes = None,
    replay: Annotated[
        str | None,
        typer.Option("--replay", help="A scene file, or the stratum of a search in --out."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Search for the run that passes F_c, per fault, phase and rig: exit 0 if none is found, or 4.

    Example: stepload falsify procedures/campaign.yaml --evaluations 1000 --out falsify
    """
    from stepload.jobs.pool import Pool
    from stepload.plan.load import load_plan
    from stepload_verify.campaign.scenario import series_from
    from stepload_verify.falsify.falsify import Search, stored_from
    from stepload_verify.falsify.falsify import falsify as search
    from stepload_verify.falsify.strata import PHASES, strata

    output = Output(as_json=as_json)
    what = Search(load_plan(plan), seed, evaluations)
    if phase and phase not in PHASES:
        raise BadInputError(f"no phase {phase!r}", hint=f"one of {', '.join(PHASES)}")
    which = (channels,) if channels else (2, 1)
    where = strata(series_from(axes), which, count, tuple(wrong or ()))
    where = [one for one in where if not phase or one.phase == phase]
    if from_j is not None:
        where = [one for one in where if one.name in stored_from(_needed(out), from_j)]
    if replay is not None:
        with ctrl_c_said("interrupted: that run has no result"):
            _replay(replay, what, where, out, output)
        return

    def told(rows: Sequence[Row]) -> str:
        worst = max(rows, key=lambda row: row.j or 0.0)
        done = f"falsify: {len(rows)} of {len(where)} strata"
        return f"{done}, worst J {_figure(worst.j)} ({worst.series})"

    begun_s = time.monotonic()
    kept = f"the finished strata are in {out}; the same command goes on there"
    with (
        ctrl_c_said(kept if out else "interrupted; with --out it could go on"),
        Pool(processes) as pool,
    ):
        rows = search(what, where, pool=pool, directory=out, on_progress=now_and_then(told))
    _report(rows, time.monotonic() - begun_s, output)


def _needed(out: Path | None) -> Path:
    if out is None:
        raise BadInputError("--from-j without --out", hint="name the directory of a search: --out")
    return out


def _report(rows: Sequence[Row], elapsed_s: float, output: Output) -> None:
    found = [row for row in rows if row.j is not None]
    broken = [row for row in found if row.above]
    apart = [row for row in rows if row.hazards_above]
    runs = sum(row.evaluations for row in rows)
    output.table(
        "Worst run of each stratum (J: 0 at the top force, above 1 beyond F_c)",
        ("stratum", "runs", "above F_c", "worst J", "F/F_c", "ended by", "in"),
        [
            (row.series, str(row.evaluations - row.hazards), str(row.above), _figure(row.j),
             _figure(row.peak_ratio), row.ended_by, row.phase.lower())
            for row in found[: max(SHOWN, len(broken))]
        ],
    )  # fmt: skip
    if apart:
        output.table(
            "Named hazards, counted apart",
            ("stratum", "hazard", "runs", "above F_c", "worst J"),
            [
                (row.series, row.hazard, str(row.hazards), str(row.hazards_above),
                 _figure(row.hazard_j))
                for row in apart
            ],
        )  # fmt: skip
    empty = sum(not row.evaluations for row in rows)
    output.line(
        f"{runs} runs in {len(rows)} strata in {elapsed_s:.0f} s: F_c was passed in {len(broken)};"
        f" the largest J is {_figure(found[0].j) if found else 'unknown'}"
        + (f"; {empty} strata have no run" if empty else "")
    )
    output.result({"runs": runs, "strata": len(rows), "strata_without_run": empty,
                   "broken": [row.series for row in broken], "rows": list(rows),
                   "elapsed_s": elapsed_s})  # fmt: skip
    if not runs:
        raise BadInputError(
            "nothing was searched: no point was a run",
            hint="a plan with a short order, such as procedures/campaign.yaml, or other --wrong",
        )
    raise typer.Exit(ExitCode.STOPPED if broken else ExitCode.OK)


def _replay(
    name: str, what: Search, where: Sequence[Stratum], out: Path | None, output: Output
) -> None:
    """A scene file again; or the worst run of a stratum, which is written as one."""
    from stepload_verify.campaign.replay import plant_rows, wrong_rows
    from stepload_verify.falsify.falsify import stored_scene
    from stepload_verify.falsify.scene_file import read_scene
    from stepload_verify.falsify.trial import judge

    path = Path(name)
    if not path.exists():
        if out is None:
            raise BadInputError(f"{name}: no such file", hint="or a stratum of the search in --out")
        path = stored_scene(what, where, out, name)
        output.line(f"written: {path}")
    scenario, found = read_scene(path)
    trial = judge(scenario)
    output.table("Plant", ("figure", "value"), list(plant_rows(scenario)))
    output.table("What goes wrong", ("when", "what"), list(wrong_rows(scenario)))
    before = f"; J = {found['j']:.4g} when it was written" if "j" in found else ""
    output.line(
        f"{scenario.series}: J = {trial.j:.4g}, true peak {trial.peak_ratio:.4f} F_c,"
        f" {trial.status}{f' by {trial.rule}' if trial.rule else ''} in {trial.phase}{before}"
        + (f"; hazard: {trial.hazard}" if trial.hazard else "")
    )
    output.result({"trial": trial, "found": found})
    broken = trial.j > 1.0 and not trial.hazard
    raise typer.Exit(ExitCode.STOPPED if broken else ExitCode.OK)


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"
