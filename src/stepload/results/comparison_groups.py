"""Groups of repeated runs, and the differences between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.estimators.difference import Agreement, Difference, difference
from stepload.estimators.judge import ResultVerdict
from stepload.estimators.measured import at_common_forces
from stepload.evidence.gates import LATERAL_SHARE
from stepload.evidence.identification import REPORTED
from stepload.evidence.sideways import Sideways
from stepload.results.comparison_quantity import chord_of, secant_of
from stepload.results.saved import SavedRun
from stepload.units import beside_limit

if TYPE_CHECKING:
    from stepload.results.comparison import ComparedRun


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


def common_estimator(runs: Sequence[ComparedRun]) -> str | None:
    """The fit by which all runs are compared: the most frequent believed fit that all runs have."""
    believed = [each.found.believe for each in runs]
    order = [*sorted(set(believed), key=believed.count, reverse=True), "joint", *REPORTED]
    return next((name for name in order if all(name in r.found.budgets for r in runs)), None)


def differences(
    runs: Sequence[ComparedRun], groups: Sequence[Sequence[int]], tolerance: float
) -> tuple[Difference, ...]:
    """Every group compared with the first; none where the runs have no interval in common.

    A run that is not identifiable, or lateral shares too different for one K_s, gives CANNOT_TELL.
    """
    if len(groups) < 2:
        return ()
    headlines = [each.found.headline for each in runs]
    known = [headline for headline in headlines if headline is not None]
    if len(known) == len(runs):
        ranges = [(headline.from_n, headline.to_n) for headline in known]
        values = at_common_forces(ranges, [partial(chord_of, each) for each in runs])
    elif (estimator := common_estimator(runs)) is not None:
        ranges = [(0.0, each.found.fits[estimator].secant_force_n) for each in runs]
        values = at_common_forces(ranges, [partial(secant_of, each, estimator) for each in runs])
    else:
        return ()
    first, *others = groups
    return tuple(
        _doubted(
            difference(
                [values[place] for place in first],
                [values[place] for place in other],
                tolerance=tolerance,
                comparisons=len(others),
            ),
            [runs[place] for place in (*first, *other)],
        )
        for other in others
    )


def _doubted(found: Difference, runs: Sequence[ComparedRun]) -> Difference:
    unfit = [
        each.run.name
        for each in runs
        if each.found.judgement.verdict is ResultVerdict.NOT_IDENTIFIABLE
    ]
    doubts = [f"not identifiable: {', '.join(unfit)}"] if unfit else []
    if (apart := shares_apart([each.found.run.sideways for each in runs])) > LATERAL_SHARE:
        shown, limit = beside_limit(apart, LATERAL_SHARE)
        doubts.append(
            f"their shares of force across the axis differ by {shown} (allowed {limit}), and one "
            "K_s does not hold for both: calibrate dry and greased"
        )
    if not doubts:
        return found
    why = "; ".join((found.why, *doubts))
    return replace(found, verdict=Agreement.CANNOT_TELL, why=why)


def shares_apart(runs: Sequence[Sideways]) -> float:
    """Largest difference of the lateral shares between runs of the rule "one number"; else 0."""
    known = [np.array(each.errors) for each in runs if each.rule == "one number"]
    pairs = combinations(known, 2)
    return max((float(np.linalg.norm(one - other)) for one, other in pairs), default=0.0)


def pair_half_width(
    one: ComparedRun, other: ComparedRun, estimator: str, tolerance: float
) -> float | None:
    """Half width of ln(S2/S1) of two single runs; None where a budget is missing."""
    try:
        values = [
            secant_of(each, estimator, 0.0, each.found.fits[estimator].secant_force_n)
            for each in (one, other)
        ]
        return difference(values[:1], values[1:], tolerance=tolerance).half_width
    except DomainError:
        return None
