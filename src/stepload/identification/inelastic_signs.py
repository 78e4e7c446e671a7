"""Signs of inelastic behaviour, from two cycles, unloading, and holds against ramps.

Each sign is a length in metres that vanishes for an elastic contact on a steady rig: a weighted sum
of the travel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stepload.identification.chord import (
    LocalDeformation,
    chord,
    deformation_at,
    held_deformation,
    top_deformation,
)
from stepload.identification.elastic import Elastic
from stepload.identification.fit import FloatArray, IntArray
from stepload.identification.loops import Branch, Loop, Path

LOWEST_SHARE = 0.15
"""Share of the top force at which the gap is taken if there are no holds on the way down."""
FOOT_SHARE = 0.03
"""Share of the top force at which a seat is looked for, or where the data begin above it."""

WORK_STEPS = 200
"""Forces at which the work of a branch is summed up."""

Compliance = Callable[[float], float]
"""dδ/dF in m/N at a force in N: here of payload and system together."""
REACH = 0.1
"""Stretches of a ramp within this share of a hold's force are compared with it."""


@dataclass(frozen=True, slots=True)
class Sign:
    """One sign.

    Attributes:
        terms: (branch, weights (B,)) whose sum over travel is this sign.
    """

    name: str
    value_m: float
    terms: tuple[tuple[Branch, FloatArray], ...]
    force_n: float

    @property
    def elapsed_s(self) -> float:
        """What a drift of 1 m/s would add, in m: the time between what is compared."""
        return sum(float(weights @ branch.path.time_s) for branch, weights in self.terms)


def signs_of(loops: Sequence[Loop], compliance: Compliance) -> list[Sign]:
    """All signs that these cycles can show."""
    first, second = loops[0], loops[1] if len(loops) > 1 else None
    low_n = lowest_common(loops)
    found: list[Sign] = []
    if low_n is not None:
        found += _gap(first, low_n, compliance)
    found += _seat(loops, compliance)
    if second is not None:
        tops = [(loop.loading, top_deformation(loop.loading.path)) for loop in (first, second)]
        shift = _shift("top_shift", tops, compliance)
        found.append(shift)
        at = low_n if low_n is not None else LOWEST_SHARE * tops[0][1].force_n
        lows = [(loop.loading, _low_deformation(loop.loading, at)) for loop in (first, second)]
        low = _shift("low_shift", lows, compliance)
        turned = tuple((branch, -weights) for branch, weights in shift.terms)
        terms = (*low.terms, *turned)
        found.append(Sign("set", low.value_m - shift.value_m, terms, low.force_n))
        whole = chord(first.loading)
        again = chord(second.loading, whole.from_n, min(whole.to_n, _top(second.loading)))
        same = chord(first.loading, again.from_n, again.to_n)
        found.append(
            Sign(
                "reload",
                again.span_m - same.span_m,
                ((second.loading, again.weights), (first.loading, -same.weights)),
                whole.to_n,
            )
        )
    return found


def _seat(loops: Sequence[Loop], compliance: Compliance) -> list[Sign]:
    """Shift at the foot of the first loading: the next branch that comes as low, less the first.

    Empty where there is none, or where the foot is not below half the force of `LOWEST_SHARE`.
    """
    first = loops[0].loading
    later = loops[1].loading if len(loops) > 1 else loops[0].unloading
    if later is None:
        return []
    top_n = float(first.path.force_n.max())
    reached_n = max(float(branch.path.force_n.min()) for branch in (first, later))
    foot_n = max(FOOT_SHARE * top_n, reached_n)
    if foot_n > 0.5 * LOWEST_SHARE * top_n:
        return []
    feet = [(branch, deformation_at(branch.path, foot_n)) for branch in (first, later)]
    return [_shift("seat", feet, compliance)]


def lowest_common(loops: Sequence[Loop]) -> float | None:
    """The lowest force at which loading and unloading can be compared; None without unloading."""
    ups = [loop.unloading.path for loop in loops[:2] if loop.unloading is not None]
    if not ups:
        return None
    held = [float(path.force_n[path.held > 0].min()) for path in ups if (path.held > 0).any()]
    top_n = float(loops[0].loading.path.force_n.max())
    reached = max(float(path.force_n.min()) for path in [*ups, loops[0].loading.path])
    if held:
        return max(max(held), reached)
    return max(LOWEST_SHARE * top_n, reached)


def _top(branch: Branch) -> float:
    return float(branch.path.force_n.max())


def _low_deformation(branch: Branch, force_n: float) -> LocalDeformation:
    return held_deformation(branch.path, force_n) or deformation_at(branch.path, force_n)


def _gap(loop: Loop, low_n: float, compliance: Compliance) -> list[Sign]:
    """Unloading less loading; empty where they have no low force in common."""
    if loop.unloading is None or float(loop.unloading.path.force_n.min()) > 1.05 * low_n:
        return []
    pair = [(loop.loading, _low_deformation(loop.loading, low_n)),
            (loop.unloading, _low_deformation(loop.unloading, low_n))]  # fmt: skip
    return [_shift("gap", pair, compliance)]


def _shift(
    name: str, pair: Sequence[tuple[Branch, LocalDeformation]], compliance: Compliance
) -> Sign:
    """The second less the first, reduced to one force."""
    (one, at), (other, there) = pair
    value = float(there.weights @ other.path.travel_m - at.weights @ one.path.travel_m)
    force_n = 0.5 * (at.force_n + there.force_n)
    value -= compliance(force_n) * (there.force_n - at.force_n)
    return Sign(name, value, ((other, there.weights), (one, -at.weights)), force_n)


def lost_work(loop: Loop) -> tuple[Sign, float] | None:
    """∮F dδ of a cycle in J, its weights in N in place of a length, and ∫F dδ of the loading.

    Both branches from the lowest to the highest force that they have in common; None without
    unloading.
    """
    if loop.unloading is None:
        return None
    forces = loop.loading.path.force_n, loop.unloading.path.force_n
    low_n, high_n = max(f.min() for f in forces), min(f.max() for f in forces)
    if not low_n < high_n:
        return None
    grid_n = np.linspace(low_n, high_n, WORK_STEPS)
    middle_n = 0.5 * (grid_n[1:] + grid_n[:-1])
    over_grid = np.concatenate([[0.0], middle_n]) - np.concatenate([middle_n, [0.0]])
    weights = [over_grid @ _between(force_n, grid_n) for force_n in forces]
    work_j = float(weights[0] @ loop.loading.deformation_m)
    if not work_j > 0.0:
        return None
    back_j = float(weights[1] @ loop.unloading.deformation_m)
    terms = (loop.loading, weights[0]), (loop.unloading, -weights[1])
    return Sign("loss", work_j - back_j, terms, float(high_n)), work_j


def _between(force_n: FloatArray, grid_n: FloatArray) -> FloatArray:
    """(G, B): values at the forces of a grid are this @ values of a branch, straight between."""
    order = np.argsort(force_n, kind="stable")
    columns = np.eye(force_n.size)[order]
    return np.column_stack([np.interp(grid_n, force_n[order], each) for each in columns.T])


def rate_sign(loops: Sequence[Loop], elastic: Elastic) -> Sign | None:
    """Deformation in the holds less that of the neighbouring ramps at the same force, in m.

    The mean over the holds of the first two loadings that have a ramp on both sides: steady creep
    or drift cancels. None without any.
    """
    found: list[tuple[Branch, FloatArray]] = []
    for loop in loops[:2]:
        found += [(loop.loading, weights) for weights in _corners(loop.loading.path)]
    if not found:
        return None
    terms = tuple((branch, weights / len(found)) for branch, weights in found)
    value = sum(float(w @ (b.path.travel_m - elastic.travel(b.path.force_n))) for b, w in terms)
    return Sign("rate", value, terms, elastic.top_n)


def _corners(path: Path) -> Iterator[FloatArray]:
    """(B,) weights of hold less ramps, for every hold between two ramps."""
    parts = np.split(np.arange(path.size), np.flatnonzero(np.diff(path.held)) + 1)
    for before, hold, after in zip(parts[:-2], parts[1:-1], parts[2:], strict=True):
        if path.held[hold[0]] == 0 or path.held[before[0]] or path.held[after[0]]:
            continue
        rest = _mean(path, hold)
        at_n = float(rest @ path.force_n)
        up, on = (_mean(path, _near(path, ramp, at_n)) for ramp in (before[::-1], after))
        low_n, high_n = float(up @ path.force_n), float(on @ path.force_n)
        if low_n < at_n < high_n:
            share = (at_n - low_n) / (high_n - low_n)
            yield rest - (1.0 - share) * up - share * on


def _near(path: Path, ramp: IntArray, at_n: float) -> IntArray:
    """Which stretches of a ramp, the next one to the hold first, are near a force."""
    near = np.abs(path.force_n[ramp] - at_n) <= REACH * at_n
    near[0] = True
    return np.asarray(ramp[near])


def _mean(path: Path, part: IntArray) -> FloatArray:
    """(B,) weights of the mean over some stretches."""
    weights = np.zeros(path.size)
    weights[part] = path.count[part] / path.count[part].sum()
    return weights
