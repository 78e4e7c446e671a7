"""The verb that tries to break everything: the fault campaign on simulated rigs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stepload.errors import BadInputError, ExitCode
from stepload.report.terminal import AsJson, Output, Processes

if TYPE_CHECKING:
    from stepload.jobs.pool import Pool
    from stepload_verify.campaign.ablation import Without
    from stepload_verify.campaign.result import Job, Result
    from stepload_verify.campaign.summary import Group
    from stepload_verify.campaign.work import Work

ORDER = "Plan (YAML): its order, times and distances are used; rigs and payloads are drawn."
EVERY_S = 30.0
MOST = 3
"""How many of the things that stopped the runs instead are named."""


def campaign(
    plan: Annotated[Path, typer.Argument(help=ORDER, show_default=False)],
    runs: Annotated[int, typer.Option("--runs", min=1, help="How many, over all rigs.")],
    faults: Annotated[
        str,
        typer.Option("--faults", help="all; kinds separated by commas; none: plans of labs."),
    ] = "all",
    count: Annotated[
        int, typer.Option("--faults-per-run", min=1, max=2, help="1, or pairs of faults.")
    ] = 1,
    seed: Annotated[int, typer.Option("--seed", help="Decides every run.")] = 1,
    axes: Annotated[
        str, typer.Option("--axes", help="one: along the press alone; six: the whole wrench; both.")
    ] = "both",
    world: Annotated[
        str, typer.Option("--world", help="Simulator in place of sim; servo has one axis.")
    ] = "sim",
    out: Annotated[
        Path | None, typer.Option("--out", help="Directory of results; the campaign goes on there.")
    ] = None,
    processes: Processes = None,
    parquet: Annotated[
        bool, typer.Option("--parquet", help="Write runs.parquet into --out when it ends.")
    ] = False,
    ablate: Annotated[
        list[str] | None,
        typer.Option("--ablate", help="Without this rule (or R1+R2) or layer; repeatable."),
    ] = None,
    ablation: Annotated[
        bool, typer.Option("--ablation", help="Without each rule and layer in turn: a table.")
    ] = False,
    replay: Annotated[
        str | None, typer.Option("--replay", help="Show this run in full, such as one-17.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Random rigs, random faults, true peak force: exit 0 if it never passed F_c, else 4.

    Example: stepload campaign procedures/campaign.yaml --runs 100
    """
    from stepload.data.columns import library, write_columns
    from stepload.jobs.pool import Pool
    from stepload.plan.load import load_plan
    from stepload.rig.world import load_world
    from stepload_verify.campaign.ablation import LAYERS, Ablation
    from stepload_verify.campaign.campaign import jobs_for
    from stepload_verify.campaign.result import Result
    from stepload_verify.campaign.scenario import kinds_from, series_from
    from stepload_verify.campaign.work import Work

    output = Output(as_json=as_json)
    series = series_from(axes)
    kinds = () if faults == "none" else kinds_from(faults)
    load_world(world)  # an unknown one is refused here
    work = Work(load_plan(plan), seed, kinds, count, world=world)
    layers = list(LAYERS) if ablation else [Ablation(name).name for name in ablate or ()]
    if replay is not None:
        if len(layers) > 1:
            raise BadInputError("--replay shows one run", hint="give --ablate once")
        with ctrl_c_said("interrupted: that run has no result"):
            _replay(work._replace(ablation="".join(layers)), replay, output)
        return
    begun_s = time.monotonic()
    if parquet:
        if out is None:
            raise BadInputError("--parquet without --out", hint="name a directory: --out")
        library("pyarrow", "Parquet")  # told before the runs and not after them
    with Pool(processes) as pool:
        results = _campaign("campaign", work, jobs_for(runs, series), pool, out)
        again = [_without(name, work, results, pool, out) for name in layers]
    if parquet and out is not None:
        table = out / "runs.parquet"
        table.unlink(missing_ok=True)  # of the campaign before it went on
        names = [field.name for field in fields(Result)]
        write_columns({name: [getattr(each, name) for each in results] for name in names}, table)
    if layers:
        _ablations(results, again, output)
    else:
        _report(results, time.monotonic() - begun_s, output)


def _campaign(
    title: str, work: Work, jobs: Sequence[Job], pool: Pool, out: Path | None
) -> list[Result]:
    from stepload_verify.campaign.campaign import run_campaign
    from stepload_verify.campaign.summary import claimed

    def told(rows: Sequence[Result]) -> str:
        above = sum(row.peak_ratio > 1.0 for row in claimed(rows))
        false = sum(row.false_trip for row in rows)
        return f"{title}: {len(rows)} of {len(jobs)} runs, {above} above F_c, {false} false trips"

    kept = f"the finished runs are in {out}; the same command goes on there"
    with ctrl_c_said(kept if out else "interrupted; with --out it could go on"):
        return run_campaign(work, jobs, pool=pool, directory=out, on_progress=now_and_then(told))


@contextmanager
def ctrl_c_said(text: str) -> Iterator[None]:
    """Ctrl+C ends the verb with this text."""
    try:
        yield
    except KeyboardInterrupt:
        print(text, file=sys.stderr)
        raise typer.Exit(ExitCode.INTERRUPTED) from None


def _report(results: Sequence[Result], elapsed_s: float, output: Output) -> None:
    from stepload.report.rows import table
    from stepload_verify.campaign.result import REFUSED
    from stepload_verify.campaign.summary import (
        FaultRow,
        Group,
        RuleRow,
        by_fault,
        by_rule,
        claimed,
        groups,
        summary,
    )

    claim, faults = groups(results)[0], by_fault(results)
    rows = [row for row in claimed(results) if row.status != REFUSED]
    output.tables(
        table("True peak force against F_c", Group, groups(results)),
        table("How the runs of the claim ended", RuleRow, by_rule(rows)),
        *([table("By fault; those with a named hazard apart", FaultRow, faults)] if faults else []),
    )
    data = dict(summary(results))
    for title, name in (
        ("above F_c", "violations"),
        ("false trips", "false_trip_runs"),
        ("levels given up", "level_missed_runs"),
    ):
        if data[name]:
            output.line(f"{title}, for --replay: {', '.join(data[name][:20])}")
    if data["refusals"]:
        told = ", ".join(f"{code} {number}" for code, number in data["refusals"].items())
        output.line(f"refused by preflight: {claim.refused} of {len(results)} plans ({told})")
    output.line(
        f"{claim.above_elastic_limit} of {claim.runs} runs above F_c: with 95 % confidence fewer"
        f" than {claim.rate_bound:.2g} of such runs; {len(results)} results in {elapsed_s:.0f} s"
    )
    output.result(data | {"elapsed_s": elapsed_s})
    raise typer.Exit(ExitCode.STOPPED if claim.above_elastic_limit else ExitCode.OK)


def _without(
    name: str, work: Work, results: Sequence[Result], pool: Pool, out: Path | None
) -> Without:
    from stepload_verify.campaign.ablation import jobs_without, without

    title = f"without {name}"
    directory = out / title.replace(" ", "-") if out else None
    jobs = jobs_without(name, results)
    again = _campaign(title, work._replace(ablation=name), jobs, pool, directory)
    return without(name, results, again)


def _ablations(results: Sequence[Result], found: Sequence[Without], output: Output) -> None:
    from stepload_verify.campaign.ablation import told
    from stepload_verify.campaign.summary import claimed, group

    base = group("nothing", claimed(results))
    output.table(
        f"{base.runs} runs with everything, and without one layer",
        ("without", "done again", "above F_c", "max F/F_c", "p99.9", "not stopped", "stopped by",
         "what is missing"),
        [("nothing", "", *_peaks(base), "", "", "")] + [
            (row.name, str(row.done_again), *_peaks(row.figures), str(row.not_stopped),
             _most(row.instead), told(row.name))
            for row in found
        ],
    )  # fmt: skip
    output.result({"everything": base, "without": {row.name: row for row in found}})
    raise typer.Exit(ExitCode.STOPPED if base.above_elastic_limit else ExitCode.OK)


def _peaks(figures: Group) -> tuple[str, str, str]:
    return (
        str(figures.above_elastic_limit),
        f"{figures.max_peak_ratio:.3f}",
        f"{figures.p999_peak_ratio:.3f}",
    )


def _most(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in list(counts.items())[:MOST])


def _replay(work: Work, name: str, output: Output) -> None:
    from stepload_verify.campaign.replay import plant_rows, replay, timeline, wrong_rows

    found = replay(work, name)
    result = found.result
    output.table("Plant", ("figure", "value"), list(plant_rows(found.scenario)))
    output.table(
        "Timeline",
        ("time [s]", "phase", "level [N]", "target [um]", "F [N]", "F2 [N]", "predicted [N]"),
        list(timeline(found)),
    )
    output.table("What goes wrong", ("when", "what"), list(wrong_rows(found.scenario)))
    if found.outcome is not None:
        output.line(found.outcome.why)
        for error in found.outcome.errors:
            output.line(f"error: {error}")
    output.line(
        f"run {result.series}-{result.index}: {result.status}, {result.rule or 'no rule'} in"
        f" {result.phase}; true peak {result.peak_n:.4g} N ="
        f" {result.peak_ratio:.4f} F_c ({result.elastic_limit_n:.4g} N)"
    )
    output.result({"result": result, "peak_ratio": result.peak_ratio})


def now_and_then(text: Callable[[Sequence[Any]], str]) -> Callable[[Sequence[Any]], None]:
    """Shows the progress of finished rows as a line on stderr each `EVERY_S`."""
    due_s = [time.monotonic() + EVERY_S]

    def show(rows: Sequence[Any]) -> None:
        if time.monotonic() >= due_s[0]:
            due_s[0] = time.monotonic() + EVERY_S
            print(text(rows), file=sys.stderr, flush=True)

    return show
