"""Groups of repeated runs, the quantity by which they are compared, and their differences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.estimators.difference import Agreement, Difference, difference
from stepload.estimators.measured import Measured, at_common_forces
from stepload.evidence.answer import weigh
from stepload.evidence.lateral import Sideways
from stepload.evidence.quantity import Quantity, ResultVerdict
from stepload.results.origins import origin_of
from stepload.results.saved import SavedRun
from stepload.units import beside_limit

if TYPE_CHECKING:
    from stepload.results.comparison import ComparedRun

LATERAL_SHARE = 0.05
"""Largest difference of the lateral shares of two runs for which one K_s holds."""
CHORD = "chord stiffness"
SECANT = "secant stiffness"


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


def differences(
    runs: Sequence[ComparedRun], groups: Sequence[Sequence[int]], tolerance: float
) -> tuple[Difference, ...]:
    """Every group compared with the first; none where a run has no chord.

    A run that is not identifiable, or lateral shares too different for one K_s, gives CANNOT_TELL.
    """
    if len(groups) < 2:
        return ()
    headlines = [each.found.headline for each in runs]
    known = [headline for headline in headlines if headline is not None]
    if len(known) < len(runs):
        return ()
    ranges = [(headline.from_n, headline.to_n) for headline in known]
    values = at_common_forces(ranges, [partial(chord_of, each) for each in runs])
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
            f"their shares of lateral force differ by {shown} (allowed {limit}), and one "
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


def pair_half_width(one: ComparedRun, other: ComparedRun, tolerance: float) -> float | None:
    """Half width of ln(S2/S1) of the secants of two single runs; None where one is not known."""
    found = [each.found.quantities.get("secant_from_touch") for each in (one, other)]
    values = [
        replace(measured(each.run, SECANT, secant), to_n=one.found.fit.secant_force_n)
        for each, secant in zip((one, other), found, strict=True)
        if secant is not None and math.isfinite(secant.half_width)
    ]
    if len(values) < 2:
        return None
    try:
        return difference(values[:1], values[1:], tolerance=tolerance).half_width
    except DomainError:
        return None


def measured(run: SavedRun, quantity: str, found: Quantity) -> Measured:
    """Any stiffness of a run in the form used for comparisons."""
    return Measured(
        run=run.name,
        quantity=quantity,
        ln_value=math.log(found.value_n_per_m),
        from_n=found.from_n,
        to_n=found.to_n,
        lines={line.source: line.relative for line in found.lines},
        origin=origin_of(run),
    )


def chord_of(each: ComparedRun, from_n: float, to_n: float) -> Measured:
    """The chord stiffness of a run between two forces, computed anew where they are not its own.

    Raises:
        DomainError: the data support no chord there.
    """
    headline = each.found.headline
    if headline is None or (from_n, to_n) != (headline.from_n, headline.to_n):
        headline = weigh(replace(each.found.run, between_n=(from_n, to_n))).headline
    return measured(each.run, CHORD, headline)
