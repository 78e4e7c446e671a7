"""The search in one stratum: points at random first, then CMA-ES from the worst of them.

Every second of the random points is drawn towards the ends of all its numbers: a rule is often
broken by a rig with several figures at an end at once. On each rig several faults are tried.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np

from stepload.declaration.sections import adapter
from stepload.plan.model import Plan
from stepload_verify.falsify.scene import Bench, length, rig_length
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.trial import Trial, judge

SPREAD = 0.1
"""First standard deviation in the unit cube."""
POPULATION = 12
_FIRST = 0x57E9


class Strategy:
    """CMA-ES from a point, with a random source of its own, so that no other search changes it.

    Args:
        start: the point.
        seed, name: of the search, and what it is for: decide what is asked for.
        held: so many numbers of the point, from the first on, stay as they are.
    """

    def __init__(self, start: Sequence[float], seed: int, name: str, held: int = 0) -> None:
        import cma

        self._held = list(start[:held])
        rng = np.random.default_rng([_FIRST, seed, int.from_bytes(name.encode()[-8:], "big")])
        self._cma: Any = cma.CMAEvolutionStrategy(
            list(start[held:]),
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

    def ask(self) -> list[list[float]]:
        """The next generation."""
        return [self._held + list(row) for row in self._cma.ask()]

    def tell(self, points: Sequence[Sequence[float]], costs: Sequence[float]) -> None:
        """Record the results of its points."""
        held = len(self._held)
        self._cma.tell([np.array(point[held:]) for point in points], list(costs))


RANDOM_SHARE = 0.4
"""Share of the evaluations that is spent at random."""
FAULTS_PER_RIG = 4
"""Faults that are tried on each rig that is drawn at random."""
POINTS_PER_RUN = 30
"""Points looked at for each evaluation at most: at some there is no rig that can press."""
NOWHERE = 1e6
"""Cost of a point without a run; the ranks alone matter."""
ELSEWHERE = 10.0
"""Added to the cost of a run that ended in another way than those of its niche."""


@dataclass(frozen=True, slots=True)
class Row:
    """The worst runs of a stratum after so many evaluations.

    `j` and what follows it are those of the worst run without a named hazard: how it ended, and the
    point with which it is done again; None and empty where there was no such run. `hazards` counts
    the evaluations with a hazard, `hazard_j` is the largest J of them.
    """

    series: str
    index: int
    evaluations: int
    above: int
    j: float | None
    peak_ratio: float | None
    ended_by: str
    phase: str
    hazard: str
    hazards: int
    hazards_above: int
    hazard_j: float | None
    point: tuple[float, ...]
    hazard_point: tuple[float, ...]

    def to_line(self) -> str:
        """One line of JSON, without its line end."""
        return str(adapter(Row).dump_json(self).decode())

    @classmethod
    def from_line(cls, line: str) -> Row:
        """The inverse of `to_line`; raises ValueError where it is no such line."""
        row: Row = adapter(Row).validate_json(line)
        return row


def to_the_ends(number: float) -> float:
    """A uniform number of 0 to 1 made arcsine-distributed: in 41 % within a tenth of an end."""
    return math.sin(0.5 * math.pi * number) ** 2


class Niche:
    """The runs of a stratum that ended in one way: by a rule, or by a status.

    J cannot distinguish a run that one rule stops at the last moment from one that another rule
    stops far too late. Each niche continues from its own worst run; every second generation keeps
    the rig and moves the faults alone.
    """

    def __init__(self, name: str, seed: int, stratum: Stratum) -> None:
        self.name = name
        self.best: tuple[tuple[float, ...], Trial] | None = None
        self.generations = 0
        self._seed, self._stratum = seed, stratum
        self._strategies: dict[int, Strategy] = {}
        self._held = 0
        self._moves = stratum.wrong != ("arm_turned",)
        """Whether the fault has anything to be moved."""

    @property
    def score(self) -> float:
        """The best score so far."""
        return self.best[1].score if self.best else -math.inf

    def ask(self) -> list[list[float]]:
        """The next generation."""
        assert self.best is not None
        self.generations += 1
        self._held = rig_length(self._stratum) * (self.generations % 2) * self._moves
        if self._held or self._held not in self._strategies:
            name = f"{self._stratum.name} {self.name} {self.generations}"
            self._strategies[self._held] = Strategy(self.best[0], self._seed, name, self._held)
        return self._strategies[self._held].ask()

    def tell(self, points: Sequence[Sequence[float]], trials: Sequence[Trial | None]) -> None:
        """Record the results of a generation."""
        self._strategies[self._held].tell(points, [self._cost(trial) for trial in trials])

    def _cost(self, trial: Trial | None) -> float:
        if trial is None:
            return NOWHERE
        return -trial.score + (0.0 if trial.ended_by == self.name else ELSEWHERE)


class Hunt:
    """The search in one stratum; the same stratum, seed and number give the same row.

    Runs with a named hazard are counted, and do not lead the search.
    """

    def __init__(self, template: Plan, stratum: Stratum, seed: int) -> None:
        self.stratum = stratum
        self.evaluations = 0
        self.above = self.hazards = self.hazards_above = 0
        self.worst: tuple[tuple[float, ...], Trial] | None = None
        self.worst_hazard: tuple[tuple[float, ...], Trial] | None = None
        self._bench = Bench(template, stratum)
        self._seed = seed
        self._chance = Random(f"falsify {seed} {stratum.name}")
        self._niches: dict[str, Niche] = {}
        self._tried = 0

    def search(self, evaluations: int) -> None:
        """Do so many evaluations, if there are so many points at which a rig can press."""
        most = POINTS_PER_RUN * evaluations
        for point in self._at_random():
            if self.evaluations >= RANDOM_SHARE * evaluations or self._tried >= most:
                break
            self._try(point)
        while self.evaluations < evaluations and self._tried < most and self._niches:
            niche = self._next()
            points = [tuple(map(float, row)) for row in niche.ask()]
            niche.tell(points, [self._try(point) for point in points])

    def _at_random(self) -> Iterator[tuple[float, ...]]:
        chance, count = self._chance, length(self.stratum)
        held = rig_length(self.stratum)
        number = 0
        while True:
            number += 1
            rig = [chance.random() for _ in range(held)]
            for _ in range(FAULTS_PER_RIG):
                point = [*rig, *(chance.random() for _ in range(count - held))]
                before = self.evaluations
                yield tuple(map(to_the_ends, point) if number % 2 else point)
                if self.evaluations == before:
                    break  # no rig that can press, mostly

    def _try(self, point: tuple[float, ...]) -> Trial | None:
        self._tried += 1
        scenario = self._bench.scenario(self._tried, point)
        if scenario is None:
            return None
        trial = judge(scenario)
        self.evaluations += 1
        if trial.hazard:
            self.hazards += 1
            self.hazards_above += trial.j > 1.0
            if self.worst_hazard is None or trial.j > self.worst_hazard[1].j:
                self.worst_hazard = point, trial
            return None
        self.above += trial.j > 1.0
        if self.worst is None or trial.j > self.worst[1].j:
            self.worst = point, trial
        niche = self._niches.setdefault(
            trial.ended_by, Niche(trial.ended_by, self._seed, self.stratum)
        )
        if trial.score > niche.score:
            niche.best = point, trial
        return trial

    def _next(self) -> Niche:
        """The niche with the fewest generations for its rank; the second best gets a quarter."""
        ranked = sorted(self._niches.values(), key=lambda niche: -niche.score)
        shares = {niche.name: niche.generations * rank**2 for rank, niche in enumerate(ranked, 1)}
        return min(ranked, key=lambda niche: shares[niche.name])

    def row(self, index: int) -> Row:
        """What was found."""
        worst, hazard = self.worst, self.worst_hazard
        return Row(
            series=self.stratum.name,
            index=index,
            evaluations=self.evaluations,
            above=self.above,
            j=worst[1].j if worst else None,
            peak_ratio=worst[1].peak_ratio if worst else None,
            ended_by=worst[1].ended_by if worst else "",
            phase=worst[1].phase if worst else "",
            hazard=hazard[1].hazard if hazard else "",
            hazards=self.hazards,
            hazards_above=self.hazards_above,
            hazard_j=hazard[1].j if hazard else None,
            point=worst[0] if worst else (),
            hazard_point=hazard[0] if hazard else (),
        )
