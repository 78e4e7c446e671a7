"""The search in one stratum: points at random first, then CMA-ES from the best of them.

Every second of these points is drawn towards the ends of all its numbers. A rule is often broken by
a rig with several figures at an end at once, such as a coarse sensor with hardly any noise, which
uniform draws seldom reach.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from random import Random

from stepload_verify.falsify.blind import Blind
from stepload_verify.falsify.scene import RIG, length
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.strategy import POPULATION, Strategy
from stepload_verify.falsify.trial import Point, Trial

AFRESH = 4
"""Interval, in generations, at which points are drawn at random, to find a better start."""
BLIND_EVERY = 2
"""Interval, in generations, of the search for hidden force where a channel freezes."""
DRAWN, CLIMBED, REDRAWN = 128, 384, 0.1
"""Rigs drawn to find a weak one; rigs made from the weakest of them, a tenth of it redrawn."""
NOWHERE = 1e6
"""The cost of a point without a run; the ranks alone matter."""
ELSEWHERE = 10.0
"""Added to the cost of a run that ended in another way than those of its niche."""


def to_the_ends(number: float) -> float:
    """A uniform number of 0 to 1 made arcsine-distributed: in 41 % within a tenth of an end."""
    return math.sin(0.5 * math.pi * number) ** 2


Weigh = Callable[[Stratum, Sequence[float]], float]


class Niche:
    """The search among the runs of a stratum that ended in one way: by a rule, or by a status.

    J cannot distinguish a run that one rule stops at the last moment from one that another rule
    stops far too late. Each niche continues from its own worst run, so that none is abandoned for
    the one that was ahead at first.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.best: tuple[Point, Trial] | None = None
        self.generations = 0
        self.strategy: Strategy | None = None

    @property
    def score(self) -> float:
        """The best score so far."""
        return self.best[1].score if self.best else -math.inf

    def ask(self, seed: int, stratum: str) -> list[list[float]]:
        """The next generation."""
        assert self.best is not None
        self.generations += 1
        if self.strategy is None:
            self.strategy = Strategy(self.best[0].point, seed, f"{stratum} {self.name}")
        return self.strategy.ask()

    def tell(self, points: Sequence[Point], trials: Sequence[Trial]) -> None:
        """Record the results of a generation."""
        assert self.strategy is not None
        costs = [self._cost(trial) for trial in trials]
        self.strategy.tell([point.point for point in points], costs)

    def _cost(self, trial: Trial) -> float:
        """Cost that CMA-ES minimises: runs that end in another way rank last."""
        if math.isinf(trial.score):
            return NOWHERE
        return -trial.score + (0.0 if trial.ended_by == self.name else ELSEWHERE)


class Hunt:
    """The search in one stratum, which proposes points and receives their results.

    The same trials always lead to the same points: a search that is restarted with its old trials
    continues where it was.

    Args:
        stratum: where to search.
        seed: of the search.
        weigh: how weak the rig at a point is, negative where there is none: rigs are chosen by it
            before runs are spent. Without it they are taken as they are drawn.
    """

    def __init__(self, stratum: Stratum, seed: int, weigh: Weigh | None = None) -> None:
        self.stratum = stratum
        self._weigh = weigh
        self.best: tuple[Point, Trial] | None = None
        """The point with the largest score so far, if one could be run."""
        self.worst: tuple[Point, Trial] | None = None
        """The point with the largest J so far."""
        self.found_after: int | None = None
        """Number of runs at which F_c was first exceeded."""
        self.runs = 0
        """Number of trials that were runs."""
        self.tried = 0
        self._seed = seed
        self._length = length(stratum)
        self._chance = Random(f"falsify {seed} {stratum.name}")
        self._generations = 0
        self._niches: dict[str, Niche] = {}
        self._asked: Niche | Blind | None = None
        self._blind = Blind(seed, stratum.name)

    @property
    def done(self) -> bool:
        """Whether F_c was exceeded here, by a named hazard or not: the search can end."""
        return self.worst is not None and self.worst[1].j > 1.0

    @property
    def score(self) -> float:
        """The best score so far."""
        return self.best[1].score if self.best else -math.inf

    def anywhere(self, count: int) -> list[Point]:
        """So many points drawn at random: even ones and such as are near the ends, in turn."""
        self._asked = None
        return self._points([self._drawn(ends=index % 2 == 1) for index in range(count)])

    def _drawn(self, *, ends: bool) -> list[float]:
        """One point at random where a rig can press; towards the ends it is made a weak rig."""
        best = self._row(ends)
        most = self._weight(best)
        for number in range(1, DRAWN + CLIMBED):
            if most == 0.0 or (most > 0.0 and not ends):
                break
            row = self._row(ends) if number < DRAWN else self._redrawn(best)
            weight = self._weight(row)
            if weight > most:
                best, most = row, weight
        return best

    def _row(self, ends: bool) -> list[float]:
        row = [self._chance.random() for _ in range(self._length)]
        return [to_the_ends(number) for number in row] if ends else row

    def _redrawn(self, row: Sequence[float]) -> list[float]:
        """The same point with some numbers of its rig drawn again."""
        again, chance = self._row(True), self._chance
        return [
            new if index < RIG and chance.random() < REDRAWN else old
            for index, (old, new) in enumerate(zip(row, again, strict=True))
        ]

    def _weight(self, row: Sequence[float]) -> float:
        return self._weigh(self.stratum, row) if self._weigh else 0.0

    def nearer(self) -> list[Point]:
        """The next generation of a niche; at times, and where there is none, points at random."""
        self._generations += 1
        if not self._niches or self._generations % AFRESH == 0:
            return self.anywhere(POPULATION)
        if self._generations % BLIND_EVERY and self._blind.ready:
            self._asked = self._blind
            return self._points(self._blind.ask())
        self._asked = niche = self._next()
        return self._points(niche.ask(self._seed, self.stratum.name))

    def tell(self, points: Sequence[Point], trials: Sequence[Trial]) -> None:
        """Record the results of these points, which were proposed together."""
        for point, trial in zip(points, trials, strict=True):
            self.runs += math.isfinite(trial.j)
            if trial.broken and self.found_after is None:
                self.found_after = self.runs
            if math.isfinite(trial.j) and (self.worst is None or trial.j > self.worst[1].j):
                self.worst = point, trial
            if trial.score > self.score:
                self.best = point, trial
            if math.isfinite(trial.score):
                niche = self._niches.setdefault(trial.ended_by, Niche(trial.ended_by))
                if trial.score > niche.score:
                    niche.best = point, trial
        if self._asked is not None:
            self._asked.tell(points, trials)
            return
        for point, trial in zip(points, trials, strict=True):
            if math.isfinite(trial.j) and self._weight(point.point) > 0.0:
                self._blind.drawn(point, trial)

    def _next(self) -> Niche:
        """The niche with the fewest generations for its rank; the second best gets a quarter."""
        ranked = sorted(self._niches.values(), key=lambda niche: -niche.score)
        shares = {niche.name: niche.generations * rank**2 for rank, niche in enumerate(ranked, 1)}
        return min(ranked, key=lambda niche: shares[niche.name])

    def _points(self, rows: Sequence[Sequence[float]]) -> list[Point]:
        found = []
        for row in rows:
            found.append(Point(self.stratum, self.tried, tuple(float(x) for x in row)))
            self.tried += 1
        return found
