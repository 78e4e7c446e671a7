"""The story of one experiment: check, open, run, make safe, record, identify, judge, report."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stepload.errors import LeftEarlyError, RefusedError
from stepload.feasibility.preflight import Preflight, preflight
from stepload.feasibility.verdict import Verdict
from stepload.findings import analyse
from stepload.findings.page import compose, headline
from stepload.findings.results import outcome_data, run_data
from stepload.findings.run_findings import RunFindings
from stepload.open_rig import opened
from stepload.plain import plain
from stepload.plan.model import Plan
from stepload.record.reader import read_recording
from stepload.record.recorder import Recorder, RecordingFailedError
from stepload.record.rows import Phase
from stepload.report.page import render
from stepload.run.limits import derive_limits
from stepload.run.loop import PROGRESS_S, RunOutcome, run_loop
from stepload.run.operator import Operator
from stepload.run.tick import Engine
from stepload.session import control, files
from stepload.session.resume import resumable

WHOLE_TICKS, MEAN_TICKS = 250_000, 80_000
"""A run longer than the first is evaluated as so many means, to bound the memory it takes."""

Progress = Callable[[Engine, Preflight], None]


@dataclass(frozen=True, slots=True)
class Finished:
    """What a run left behind; `problems` are what went wrong after it.

    `left_early` is the signal that cut its evaluation short, 0 for none.
    """

    directory: Path
    outcome: RunOutcome
    data: Mapping[str, Any]
    findings: RunFindings | None
    headline: str
    problems: tuple[str, ...]
    left_early: int = 0


def refuse(check: Preflight) -> RefusedError:
    """The error of a refused plan: every refusing reason with its way out."""
    lines = [
        f"{reason.message}\n  -> {reason.remedy}"
        for reason in check.reasons
        if reason.severity == "refuse"
    ]
    return RefusedError("preflight refused the plan:\n" + "\n".join(lines))


def run_plan(
    plan: Plan,
    *,
    dry_run: bool,
    out: Path | None = None,
    seed: int | None = None,
    resume: Path | None = None,
    operator: Operator | None = None,
    on_progress: Progress | None = None,
) -> Finished:
    """Run a plan from preflight to report.

    Args:
        dry_run: on the simulated rig in virtual time instead of the plan's devices.
        out: directory for the run's files; made where missing.
        seed: of the simulated rig; the plan's own when None.
        resume: directory of an interrupted run of this plan, to go on after its last step.
        operator: where stop and pause requests come in.
        on_progress: called ten times a second of run time.

    Raises:
        RefusedError: preflight refused; nothing was opened or written.
        BadInputError: the directory cannot be used, or there is nothing to resume.
        DeviceError: a device did not open; nothing moved.
        RecordingFailedError: the record could not be kept; the arm was made safe first.
    """
    check = preflight(plan)
    if check.verdict is Verdict.REFUSED:
        raise refuse(check)
    if plan.rig.system_stiffness.simulated and not dry_run:
        raise RefusedError(
            f"the calibration record {plan.rig.system_stiffness.record} was made in a dry run",
            hint="measure K_s on the rig: stepload calibrate PLAN --record FILE",
        )
    limits = derive_limits(plan, elastic_limit_n=check.theory.elastic_limit_n)
    operator = operator or Operator()
    resumed = resumable(resume, plan, dry_run=dry_run) if resume else None
    engine = Engine(
        plan,
        limits,
        operator,
        start_cycle=resumed.start_cycle if resumed else 1,
        start_level=resumed.start_level if resumed else 0,
    )
    directory = files.run_directory(plan, dry_run=dry_run, out=out)
    files.make_directory(directory)
    try:
        with opened(plan, dry_run=dry_run, seed=seed) as rig:
            operator.moving = True
            metadata = files.metadata(plan, rig, dry_run=dry_run, seed=seed)
            metadata |= resumed.metadata if resumed else {}
            recorder = Recorder(
                directory,
                rates_hz=rig.rates_hz,
                clock=rig.clock,
                metadata=metadata,
                attachments=files.attachments(plan, limits, check),
                lossless=rig.clock.virtual,
            )
            virtual = rig.clock.virtual

            def progress(now: Engine) -> None:
                if on_progress is not None:
                    on_progress(now, check)
                if virtual and now.procedure.phase == Phase.PAUSED:
                    time.sleep(PROGRESS_S)  # virtual time waits with whoever paused it

            def status() -> dict[str, object]:
                row = engine.row
                if row is None:
                    return {"run_id": metadata["run_id"]}
                return {
                    "run_id": metadata["run_id"],
                    "phase": Phase(row.phase).name, "cycle": row.cycle, "step": row.step,
                    "level_n": row.level_n, "force_n": row.force_n,
                }  # fmt: skip

            try:
                with control.listening(directory, operator, status) as missing:
                    outcome = run_loop(
                        engine, rig, recorder, on_progress=progress, identities=rig.identities
                    )
            except BaseException:
                recorder.abandon()
                raise
    except BaseException:
        with contextlib.suppress(OSError):
            directory.rmdir()  # only where nothing was written into it
        raise
    errors = (*outcome.errors, *rig.close_errors, *([missing] if missing else []))
    outcome = replace(outcome, errors=errors)
    return _keep(plan, check, outcome, recorder, directory, operator, dry_run=dry_run)


def _keep(
    plan: Plan,
    check: Preflight,
    outcome: RunOutcome,
    recorder: Recorder,
    directory: Path,
    operator: Operator,
    *,
    dry_run: bool,
) -> Finished:
    """Evaluate a run that is over, and finish its files whatever the evaluation comes to."""
    problems: list[str] = []
    data = plain(outcome_data(outcome, check))
    findings, text, left_early = None, "no result", 0
    try:
        recorder.sync()
        try:
            ticks = outcome.lateness.ticks
            mean_of = 1 if ticks <= WHOLE_TICKS else -(-ticks // MEAN_TICKS)
            recording = read_recording(recorder.part_path, mean_of)
            try:
                operator.moving = False  # nothing moves any more: a signal ends the evaluation
                findings = analyse.run_findings(plan, check, outcome, recording, dry_run=dry_run)
            except LeftEarlyError as error:
                left_early = error.signal_number
                problems.append(
                    "the evaluation was left out on request: `stepload identify` does it"
                )
            except Exception as error:  # a bug there must not cost the report
                problems.append(f"the evaluation failed: {type(error).__name__}: {error}")
            finally:
                operator.moving = True
            if findings is None:
                findings = RunFindings(
                    plan, check, outcome, recording, dry_run, problem=problems[0]
                )
            data, text = plain(run_data(findings)), headline(findings)[2]
        except Exception as error:  # a bug here must not cost the record
            problems.append(f"the evaluation failed: {type(error).__name__}: {error}")
            data["reasons"] = list(problems)
        recorder.finish(data, str(data["verdict"]))
    except Exception as error:  # the recorder's own; what got to the disk stays there
        told = f"{type(error).__name__}: {error}"
        if isinstance(error, RecordingFailedError):
            told = error.message
        data["reasons"] = [told]
        with contextlib.suppress(Exception):
            recorder.abandon()
        with contextlib.suppress(OSError):
            _write_results(directory, data)
        raise RecordingFailedError(
            f"{outcome.why}\n{told}",
            hint="free disk space if it is full; the next run, or `stepload recover`, repairs it",
        ) from error
    try:
        _write_results(directory, data)
        if findings is not None:
            files.write_file(directory / files.REPORT, render(compose(findings)))
    except Exception as error:  # the record is whole already
        problems.append(f"report or results not written: {type(error).__name__}: {error}")
    return Finished(directory, outcome, data, findings, text, tuple(problems), left_early)


def _write_results(directory: Path, data: Mapping[str, Any]) -> None:
    files.write_file(directory / files.RESULTS, json.dumps(data, indent=1, allow_nan=False) + "\n")
