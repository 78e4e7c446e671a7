"""One whole dry run, from plan to report, with the truth that only the simulator knows."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from stepload.engine.open_rig import OpenRig, opened
from stepload.envelope.envelope import envelope_of
from stepload.plan.model import Plan
from stepload.session.experiment import run_plan


class Whole(NamedTuple):
    """The results of a run, and the largest true force over F_c."""

    data: dict[str, Any]
    peak_share: float


def dry_run(plan: Plan, seed: int) -> Whole:
    """Run a plan on its simulated rig and delete the files of the run."""
    peaks: list[float] = []

    @contextmanager
    def watched(*args: Any, **kwargs: Any) -> Iterator[OpenRig]:
        with opened(*args, **kwargs) as rig:
            yield rig
            assert rig.world is not None
            peaks.append(rig.world.true_peak_force_n)

    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "run"
        done = run_plan(envelope_of(plan), dry_run=True, out=out, seed=seed, open_rig=watched)
    data = dict(done.data)
    return Whole(data, peaks[0] / data["elastic_limit_n"])
