"""Everything known about a run once it is over."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.feasibility.preflight import Preflight
from stepload.findings.identification import Identification
from stepload.findings.press_data import PressData
from stepload.identify.runin import RunIn
from stepload.identify.system import SystemStiffnessFit
from stepload.plan.model import Plan
from stepload.record.reader import Recording
from stepload.run.loop import RunOutcome


@dataclass(frozen=True, slots=True)
class RunFindings:
    """A run and what became of it; None where it did not get so far, `problem` says why."""

    plan: Plan
    check: Preflight
    outcome: RunOutcome
    recording: Recording
    dry_run: bool
    data: PressData | None = None
    identification: Identification | None = None
    system: SystemStiffnessFit | None = None
    run_in: RunIn | None = None
    problem: str = ""
