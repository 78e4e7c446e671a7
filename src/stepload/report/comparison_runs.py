"""The runs of a comparison: which are repeats, what errors they share, their chords."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.identification.conditions import BRANCHES
from stepload.identification.difference import SAME_FORCE, Difference, Measured, difference
from stepload.identification.identify import Identification
from stepload.identification.origin import Origin
from stepload.identification.quantity import Quantity
from stepload.identification.smooth import SHORTEST
from stepload.identification.verdict import judge
from stepload.report.analyse import identify_payload
from stepload.report.press_data import LOADING
from stepload.report.run_data import lateral_force_of
from stepload.report.run_record import SavedRun


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """One run, identified from its first loading."""

    run: SavedRun
    found: Identification

    def reached(self, force_n: float) -> bool:
        """Whether it was pressed up to this force."""
        return self.found.peak_force_n >= (1.0 - SAME_FORCE) * force_n

    def measured(self, figure: Quantity) -> Measured:
        """A figure of this run, with the origin of its errors."""
        return Measured(self.run.name, figure, origin_of(self.run))


def compared_run(run: SavedRun, secant_force_n: float) -> ComparedRun:
    """A run identified with its secants at this force."""
    conditions = dataclasses.replace(run.conditions, secant_force_n=secant_force_n)
    found = identify_payload(run.data, conditions)
    return ComparedRun(run, found)


def grouped(runs: Sequence[SavedRun], sizes: Sequence[int] | None) -> tuple[tuple[int, ...], ...]:
    """Indices of the runs that are repeats of each other, the first run's group first.

    Args:
        runs: all runs.
        sizes: number of runs in each group, in the order of the runs. None: runs of one plan and
            payload are repeats; if all are, each is a group of its own.

    Raises:
        BadInputError: the sizes do not add up, or a run is given twice.
    """
    ids = [run.metadata.get("run_id") or str(run.path) for run in runs]
    if len(set(ids)) < len(ids):
        raise BadInputError("one run is given twice; it would count as two")
    if sizes is not None:
        if sum(sizes) != len(runs) or min(sizes) < 1:
            raise BadInputError(
                "a group of runs is empty", hint="write: stepload compare A1 A2 vs B1 B2"
            )
        ends = [sum(sizes[:i]) for i in range(len(sizes) + 1)]
        return tuple(tuple(range(a, b)) for a, b in pairwise(ends))
    found: dict[tuple[str, str], list[int]] = {}
    for place, run in enumerate(runs):
        key = (run.metadata.get("payload", ""), run.metadata.get("plan", ""))
        found.setdefault(key, []).append(place)
    if len(found) == 1:
        return tuple((place,) for place in range(len(runs)))
    return tuple(map(tuple, found.values()))


def chords(runs: Sequence[ComparedRun]) -> tuple[Quantity, ...]:
    """The chord of every run between the forces that all have; none where one has no chord.

    They are of the branch that all plans ask for, else of the loading.
    """
    headlines = [each.found.headline for each in runs if each.found.headline is not None]
    branches = {each.run.conditions.branch for each in runs}
    branch = branches.pop() if len(branches) == 1 else BRANCHES[0]
    if not runs or len(headlines) < len(runs):
        return ()
    low_n, top_n = max(each.from_n for each in headlines), min(each.to_n for each in headlines)
    if not low_n < top_n:
        return ()
    between = [
        dataclasses.replace(
            each.found.run,
            between_n=(low_n, top_n),
            conditions=dataclasses.replace(each.found.conditions, branch=branch),
        )
        for each in runs
    ]
    try:
        return tuple(judge(run, laws=False).headline for run in between)
    except DomainError:
        return ()


def differences(
    runs: Sequence[ComparedRun],
    figures: Sequence[Quantity],
    groups: Sequence[Sequence[int]],
    tolerance: float,
) -> tuple[Difference, ...]:
    """Every group compared with the first."""
    if len(groups) < 2 or not figures:
        return ()
    values = [each.measured(figure) for each, figure in zip(runs, figures, strict=True)]
    first, *others = ([values[place] for place in group] for group in groups)
    return tuple(
        difference(first, other, tolerance=tolerance, comparisons=len(others)) for other in others
    )


def origin_of(run: SavedRun) -> Origin:
    """Everything in a record that decides which errors the run shares with others.

    A simulated rig differs from the real one of its name, and each of its seeds draws other errors
    of the travel.
    """
    sources, told, data = run.conditions.sources, run.metadata, run.data
    rig, stiffness = told.get("rig", ""), sources.system_stiffness_n_per_m
    all_loading, loading = data.branch(LOADING), data.first_loading()
    surface_m = reach_m = None
    begin_s = float(data.time_s[all_loading][0]) if all_loading.any() else np.inf
    if before := [touch.position_m for touch in data.touches if touch.time_s <= begin_s]:
        surface_m = before[-1]
    rise_n = float(np.ptp(data.force_n[loading])) if loading.any() else 0.0
    if not data.gauge and rise_n > 0.0:
        length_n = sources.smooth_length_n or SHORTEST * float(data.force_n.max())
        reach_m = length_n * float(np.ptp(data.travel_m[loading])) / rise_n
    return Origin(
        rig=f"{rig} (simulated)" if rig and run.simulated else rig,
        arm=_device(told.get("arm", ""))[0],
        force_sensor=", ".join(_device(told.get("force_sensor", ""))),
        axis=told.get("force_axis", ""),
        pose=run.conditions.pose,
        kinematics=f"seed {told.get('seed', '')}" if run.simulated else "",
        calibration=told.get("calibration", ""),
        stiffness_n_per_m=None
        if stiffness is None
        else (stiffness, sources.system_stiffness_sigma_n_per_m),
        surface_m=surface_m,
        reach_m=reach_m,
        across=lateral_force_of(data, run.conditions).errors,
    )


def _device(text: str) -> tuple[str, ...]:
    """Make with serial number, and calibration; empty where the number is not known.

    The text is that of `session.files.device_metadata`. Firmware is left out: it does not determine
    any error.
    """
    make, _, rest = text.partition(", firmware ")
    if not make or make.endswith((" ", " unknown")):
        return ("",)
    return make, rest.rpartition(", calibration ")[2]
