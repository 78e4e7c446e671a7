"""Everything known about a run once it is over."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.envelope.envelope import Envelope
from stepload.identify.identification import Identification
from stepload.identify.runin import RunIn
from stepload.identify.system import SystemStiffnessFit
from stepload.record.outcome import RunOutcome
from stepload.record.reader import Recording
from stepload.results.press_data import PressData


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A run and what its data say; None where it did not get so far, `problem` says why."""

    envelope: Envelope
    outcome: RunOutcome
    recording: Recording
    dry_run: bool
    data: PressData | None = None
    identification: Identification | None = None
    system: SystemStiffnessFit | None = None
    run_in: RunIn | None = None
    problem: str = ""
