"""What the reader of a run's result must know, the same sentences for page and program."""

from __future__ import annotations

from stepload.results.analyse import Evaluation, beyond_theory
from stepload.results.remarks import levels, remarks, sideways
from stepload.results.until import loaded


def reasons_of(run: Evaluation) -> list[str]:
    """All remarks on the result but the problem that left it out, doubts first."""
    found, events = run.identification, run.recording.events
    reasons = [*found.judgement.reasons] if found is not None else []
    if (until := loaded(events, found)) is not None:
        reasons.append(until.text)
    if run.data is not None:
        reasons += [
            *remarks(run.data), *levels(events), *sideways(events),
            *beyond_theory(run),
        ]  # fmt: skip
    if resumed := run.recording.metadata.get("resumed"):
        reasons.append(resumed)
    return reasons
