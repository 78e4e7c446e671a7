"""From a record or a curve to the contact parameters of a simulator."""

from __future__ import annotations

from pathlib import Path

from stepload.estimators.hunt_crossley import HuntCrossley
from stepload.record.untrusted import untrusted
from stepload.results.analyse import identify_payload
from stepload.results.extras import extras_of
from stepload.results.from_file import identify_file
from stepload.results.saved import RECORD, saved_run
from stepload.results.snippets import Kind, Spring, spring_of
from stepload.results.wishes import Wishes


def spring_of_file(path: Path, *, at_n: float | None = None, kind: Kind = "tangent") -> Spring:
    """The law of a record (.mcap, or the directory of a run) or of a curve, linearised.

    Damping is looked for in records only: a curve from elsewhere has no phases.

    Raises:
        BadInputError: the file is invalid, or has no result at that force.
    """
    if not (path.is_dir() or path.suffix.lower() in (Path(RECORD).suffix, ".part")):
        found, _ = identify_file(path, Wishes())
        return spring_of(found, at_n=at_n, kind=kind)
    with untrusted(path):
        run = saved_run(path)
        found = identify_payload(run.data, run.conditions)
        damping = extras_of(run.data, found).hunt_crossley
    d = damping.dissipation_s_per_m if isinstance(damping, HuntCrossley) else None
    return spring_of(found, at_n=at_n, kind=kind, dissipation_s_per_m=d, simulated=run.simulated)
