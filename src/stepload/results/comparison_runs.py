"""The runs of a comparison: which are repeats, their chords between common forces, differences."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.estimators.conditions import BRANCHES
from stepload.estimators.fit import Fit
from stepload.estimators.fit_all import fit_all
from stepload.estimators.selection import select
from stepload.evidence.difference import SAME_FORCE, Difference, Measured, difference
from stepload.evidence.identification import REPORTED, Identification
from stepload.evidence.quantity import Quantity
from stepload.evidence.reading import branch_chord, read_of
from stepload.results.analyse import identify_payload
from stepload.results.origins import origin_of
from stepload.results.press_data import LOADING
from stepload.results.run_record import SavedRun


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """One run: its first loading, and the reported fits of every cycle separately."""

    run: SavedRun
    found: Identification
    cycles: Mapping[int, Mapping[str, Fit]]

    def reached(self, force_n: float) -> bool:
        """Whether it was pressed up to this force."""
        return self.found.peak_force_n >= (1.0 - SAME_FORCE) * force_n


def compared_run(run: SavedRun, secant_force_n: float) -> ComparedRun:
    """A run identified with its secants at this force."""
    conditions = dataclasses.replace(run.conditions, secant_force_n=secant_force_n)
    found = identify_payload(run.data, conditions)
    numbers = np.unique(run.data.cycle[run.data.branch(LOADING)])
    cycles = {int(number): _cycle_fits(run, int(number), secant_force_n) for number in numbers}
    return ComparedRun(run, found, cycles)


def _cycle_fits(run: SavedRun, cycle: int, secant_force_n: float) -> dict[str, Fit]:
    loading = run.data.branch(LOADING, cycle)
    force_n = run.data.force_n[loading]
    deformation_m = run.data.since_touch(cycle) - run.conditions.bend(force_n)
    selected = select(deformation_m, force_n, time_s=run.data.time_s[loading])
    fits = fit_all(selected, secant_force_n=secant_force_n)
    return {name: fit for name in REPORTED if (fit := fits.get(name)) is not None and usable(fit)}


def usable(fit: Fit) -> bool:
    """Whether the numbers of a fit are positive and finite."""
    return all(0.0 < value < math.inf for value in (fit.secant_n_per_m, fit.k, fit.n))


def grouped(runs: Sequence[SavedRun], sizes: Sequence[int] | None) -> tuple[tuple[int, ...], ...]:
    """Indices of the runs that are repeats of each other, the first run's group first.

    Args:
        runs: all runs.
        sizes: number of runs in each group, in the order of the runs. None: runs of one plan and
            payload are repeats; if all are, each is a group of its own and is compared with the
            first.

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
    return tuple(tuple(places) for places in found.values())


def chords(runs: Sequence[ComparedRun]) -> tuple[Quantity, ...]:
    """The chord of every run between the forces that all have; none where one has no chord.

    They are of the branch that all plans ask for, else of the loading.
    """
    headlines = [each.found.headline for each in runs if each.found.headline is not None]
    branches = {each.run.conditions.branch for each in runs}
    branch = branches.pop() if len(branches) == 1 else BRANCHES[0]
    if len(headlines) < len(runs):
        return ()
    low_n, top_n = max(each.from_n for each in headlines), min(each.to_n for each in headlines)
    if not low_n < top_n:
        return ()
    try:
        found = [_chord(each, branch, low_n, top_n) for each in runs]
    except DomainError:
        return ()
    return tuple(each for each in found if each is not None) if all(found) else ()


def _chord(each: ComparedRun, branch: str, low_n: float, top_n: float) -> Quantity | None:
    run = dataclasses.replace(each.found.run, between_n=(low_n, top_n))
    return branch_chord(run, read_of(run), branch)


def differences(
    runs: Sequence[ComparedRun],
    figures: Sequence[Quantity],
    groups: Sequence[Sequence[int]],
    tolerance: float,
) -> tuple[Difference, ...]:
    """Every group compared with the first."""
    if len(groups) < 2 or not figures:
        return ()
    values = [
        Measured(each.run.name, figure, origin_of(each.run))
        for each, figure in zip(runs, figures, strict=True)
    ]
    first, *others = groups
    return tuple(
        difference(
            [values[place] for place in first],
            [values[place] for place in other],
            tolerance=tolerance,
            comparisons=len(others),
        )
        for other in others
    )
