"""The whole search: every stratum briefly, then the better half at greater length, repeatedly."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from stepload_verify.falsify.hunt import Hunt, Weigh
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.strategy import POPULATION
from stepload_verify.falsify.trial import Point, Trial

FIRST_SHARE = 0.4
"""Share of all trials that is spent at random over all strata."""
FEWEST, MOST = 4, 48
"""Trials at random in one stratum."""
LAST_STRATA = 8
"""The halving ends at so many strata."""

Run = Callable[[Sequence[Point]], list[Trial]]
"""Tries points and gives their trials in the same order."""


@dataclass(frozen=True, slots=True)
class Round:
    """So many generations in each of the best strata."""

    strata: int
    generations: int


def rounds(strata: int, trials: int) -> tuple[int, list[Round]]:
    """Trials at random per stratum, and the rounds of halving after them.

    Args:
        strata: how many there are.
        trials: about how many there may be in all.
    """
    first = min(MOST, max(FEWEST, int(FIRST_SHARE * trials / strata)))
    left = max(0, trials - first * strata)
    halvings = max(1, math.ceil(math.log2(max(1.0, strata / LAST_STRATA))))
    found = []
    for number in range(1, halvings + 1):
        kept = max(min(LAST_STRATA, strata), strata >> number)
        generations = round(left / halvings / (kept * POPULATION))
        if generations:
            found.append(Round(kept, generations))
    return first, found


def search(
    strata: Iterable[Stratum],
    trials: int,
    seed: int,
    run: Run,
    on_progress: Callable[[list[Hunt]], None] | None = None,
    weigh: Weigh | None = None,
) -> list[Hunt]:
    """Search all strata; the same whatever runs the trials, and in whatever order.

    A stratum in which F_c was exceeded is not searched further, even if preflight names that
    hazard: it would attract all trials.

    Args:
        strata: where.
        trials: about how many in all.
        seed: decides every point.
        run: tries points.
        on_progress: called with all hunts after each batch.
        weigh: how weak the rig at a point is; see `Hunt`.
    """
    hunts = [Hunt(stratum, seed, weigh) for stratum in strata]

    def tell(asked: list[tuple[Hunt, list[Point]]]) -> None:
        results = iter(run([point for _, points in asked for point in points]))
        for hunt, points in asked:
            hunt.tell(points, [next(results) for _ in points])
        if on_progress:
            on_progress(hunts)

    first, later = rounds(len(hunts), trials)
    for part in _parts(hunts):
        tell([(hunt, hunt.anywhere(first)) for hunt in part])
    for one in later:
        best = sorted(hunts, key=lambda hunt: -hunt.score)
        open_ones = [hunt for hunt in best if not hunt.done][: one.strata]
        for _ in range(one.generations):
            going_on = [hunt for hunt in open_ones if not hunt.done]
            for part in _parts(going_on):
                tell([(hunt, hunt.nearer()) for hunt in part])
    return hunts


def _parts(hunts: list[Hunt], size: int = 100) -> Iterator[list[Hunt]]:
    for start in range(0, len(hunts), size):
        yield hunts[start : start + size]
