"""The search in one stratum: points at random first, then CMA-ES from the best of them.

Every second of these points is drawn towards the ends of all its numbers. What breaks a rule is
often a rig with several figures at an end at once, such as a coarse sensor with hardly any noise,
and that is a corner that even draws seldom come to.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from random import Random
from typing import Any

import numpy as np

from stepload_verify.falsify.scene import length
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.trial import Point, Trial

SPREAD = 0.2
"""First standard deviation of CMA-ES in the unit cube."""
POPULATION = 12
NOWHERE = 1e6
"""The cost of a point without a run; the ranks alone matter."""
_FIRST = 0x57E9


def to_the_ends(number: float) -> float:
    """An even draw of 0 to 1 as one of the arcsine law: in 41 % within a tenth of an end."""
    return math.sin(0.5 * math.pi * number) ** 2


class Hunt:
    """The search in one stratum, asked for points and told what they came to.

    The same trials always ask for the same points: a search that is begun again with its old
    trials goes on where it was.

    Args:
        stratum: where to search.
        seed: of the search.
    """

    def __init__(self, stratum: Stratum, seed: int) -> None:
        self.stratum = stratum
        self.best: tuple[Point, Trial] | None = None
        """The point with the largest score so far, if one could be run."""
        self.worst: tuple[Point, Trial] | None = None
        """The point with the largest J so far."""
        self.found_after: int | None = None
        """Number of runs after which F_c had been passed first."""
        self.runs = 0
        """Trials that were runs."""
        self.tried = 0
        self._seed = seed
        self._length = length(stratum)
        self._chance = Random(f"falsify {seed} {stratum.name}")
        self._strategy: Any = None

    @property
    def done(self) -> bool:
        """Whether F_c has been passed here, by a named hazard or not: there is no more to find."""
        return self.worst is not None and self.worst[1].j > 1.0

    @property
    def score(self) -> float:
        """The best score so far."""
        return self.best[1].score if self.best else -math.inf

    def anywhere(self, count: int) -> list[Point]:
        """So many points drawn at random: even ones and such as are near the ends, in turn."""
        rows = [[self._chance.random() for _ in range(self._length)] for _ in range(count)]
        rows[1::2] = [[to_the_ends(number) for number in row] for row in rows[1::2]]
        return self._points(rows)

    def nearer(self) -> list[Point]:
        """The next generation about the best so far; points at random where there is none yet."""
        if self._strategy is None and self.best is None:
            return self.anywhere(POPULATION)
        if self._strategy is None:
            self._strategy = self._begin()
        return self._points(self._strategy.ask())

    def tell(self, points: Sequence[Point], trials: Sequence[Trial]) -> None:
        """What these points, of one call, came to."""
        for point, trial in zip(points, trials, strict=True):
            self.runs += math.isfinite(trial.j)
            if trial.broken and self.found_after is None:
                self.found_after = self.runs
            if math.isfinite(trial.j) and (self.worst is None or trial.j > self.worst[1].j):
                self.worst = point, trial
            if trial.score > self.score:
                self.best = point, trial
        if self._strategy is not None:
            costs = [NOWHERE if math.isinf(t.score) else -t.score for t in trials]
            self._strategy.tell([np.array(point.point) for point in points], costs)

    def _points(self, rows: Sequence[Sequence[float]]) -> list[Point]:
        found = []
        for row in rows:
            found.append(Point(self.stratum, self.tried, tuple(float(x) for x in row)))
            self.tried += 1
        return found

    def _begin(self) -> Any:
        """CMA-ES with a random source of its own, so that no other search changes this one."""
        import cma

        assert self.best is not None
        name = int.from_bytes(self.stratum.name.encode()[-8:], "big")
        rng = np.random.default_rng([_FIRST, self._seed, name])
        return cma.CMAEvolutionStrategy(
            list(self.best[0].point),
            SPREAD,
            {
                "bounds": [0.0, 1.0],
                "popsize": POPULATION,
                "CMA_diagonal": True,
                "randn": lambda *shape: rng.standard_normal(shape),
                "seed": math.nan,
                "verbose": -9,
                "tolx": 0.0,
                "tolfun": 0.0,
                "tolfunhist": 0.0,
                "tolflatfitness": 10**9,
            },
        )
