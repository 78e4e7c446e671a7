"""The story of one experiment: check, open, run, make safe, record, identify, judge, report."""

from __future__ import annotations

import json
import platform
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import stepload
from stepload.errors import RefusedError
from stepload.feasibility.preflight import Preflight, preflight
from stepload.feasibility.verdict import Verdict
from stepload.findings import analyse, conditions, replayed
from stepload.findings.page import compose, headline
from stepload.findings.results import run_data
from stepload.findings.run_findings import RunFindings
from stepload.open_rig import OpenRig, opened
from stepload.plain import plain
from stepload.plan.model import Plan, SecondForceSource
from stepload.record.reader import read_recording
from stepload.record.recorder import Recorder
from stepload.report.page import render
from stepload.run.limits import RunLimits, derive_limits
from stepload.run.loop import run_loop
from stepload.run.operator import Operator
from stepload.run.tick import Engine

REPORT, RESULTS = "report.html", "results.json"


@dataclass(frozen=True, slots=True)
class Finished:
    """What a run left behind."""

    directory: Path
    findings: RunFindings
    data: Mapping[str, Any]
    headline: str


def run_directory(plan: Plan, *, dry_run: bool, out: Path | None) -> Path:
    """Where a run's files go: `out`, or a new directory below the plan's record directory."""
    if out is not None:
        return out
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    slug = re.sub(r"[^a-z0-9]+", "-", plan.name.lower()).strip("-")[:40] or "run"
    return plan.record.directory / f"{stamp}-{slug}{'-dry' if dry_run else ''}"


def _second_axis(plan: Plan) -> str:
    second = plan.rig.second_force
    has_sensor = second.source is SecondForceSource.SENSOR
    return second.sensor.axis if has_sensor and second.sensor else ""


def _metadata(plan: Plan, rig: OpenRig, *, dry_run: bool, seed: int | None) -> dict[str, str]:
    data = {
        "run_id": secrets.token_hex(6),
        "plan": plan.name,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "dry_run": str(dry_run).lower(),
        "seed": "" if seed is None else str(seed),
        "stepload": stepload.__version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "host": platform.node(),
        "operator": plan.record.operator,
        "notes": plan.record.notes,
        "force_axis": plan.rig.force.axis,
        "second_force_axis": _second_axis(plan),
        "rig": plan.rig.name,
        "payload": plan.payload.name,
    }
    for role, identity in rig.identities.items():
        data[role] = (
            f"{identity.driver}: {identity.model} {identity.serial_number}, firmware "
            f"{identity.firmware}, calibration {identity.calibration_revision}"
        )
    return data


def _attachments(plan: Plan, limits: RunLimits, check: Preflight) -> dict[str, bytes]:
    files = {
        conditions.FILE: conditions.to_bytes(conditions.planned(plan, check.theory.elastic_limit_n))
    }
    for index, source in enumerate(plan.sources):
        name = "plan.yaml" if index == 0 else f"plan-{index}-{Path(source.name).name}"
        files[name] = source.text.encode()
    files[replayed.FILE] = replayed.limits_to_bytes(limits)
    reasons = [
        {"code": r.code, "severity": r.severity.value, "message": r.message, "remedy": r.remedy}
        for r in check.reasons
    ]
    files["preflight.json"] = json.dumps(
        {"verdict": check.verdict.value, "reasons": reasons}
    ).encode()
    return files


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
    operator: Operator | None = None,
    on_progress: Callable[[Engine, Preflight], None] | None = None,
) -> Finished:
    """Run a plan from preflight to report.

    Args:
        dry_run: on the simulated rig in virtual time instead of the plan's devices.
        out: directory for the run's files; made where missing.
        seed: of the simulated rig; the plan's own when None.
        operator: where stop and pause requests come in.
        on_progress: called ten times a second of run time.

    Raises:
        RefusedError: preflight refused; nothing was opened or written.
        DeviceError: a device did not open; nothing moved.
        RecordingFailedError: the record could not be kept; the arm was made safe first.
    """
    check = preflight(plan)
    if check.verdict is Verdict.REFUSED:
        raise refuse(check)
    limits = derive_limits(plan, elastic_limit_n=check.theory.elastic_limit_n)
    operator = operator or Operator()
    directory = run_directory(plan, dry_run=dry_run, out=out)
    directory.mkdir(parents=True, exist_ok=True)
    with opened(plan, dry_run=dry_run, seed=seed) as rig:
        recorder = Recorder(
            directory,
            rates_hz=rig.rates_hz,
            clock=rig.clock,
            metadata=_metadata(plan, rig, dry_run=dry_run, seed=seed),
            attachments=_attachments(plan, limits, check),
            lossless=rig.clock.virtual,
        )
        try:
            engine = Engine(plan, limits, operator)
            progress = None
            if on_progress is not None:

                def progress(now: Engine) -> None:
                    on_progress(now, check)

            outcome = run_loop(engine, rig, recorder, on_progress=progress)
        except BaseException:
            recorder.abandon()
            raise
    recorder.sync()
    recording = read_recording(recorder.part_path)
    findings = analyse.run_findings(plan, check, outcome, recording, dry_run=dry_run)
    data = plain(run_data(findings))
    recorder.finish(data, str(data["verdict"]))
    (directory / RESULTS).write_text(json.dumps(data, indent=1, allow_nan=False))
    (directory / REPORT).write_text(render(compose(findings)), encoding="utf-8")
    return Finished(directory, findings, data, headline(findings)[2])
