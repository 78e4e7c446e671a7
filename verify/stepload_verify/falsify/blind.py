"""The search for a force that no channel shows, on one weak rig after another.

Forces allowed by the tolerances of a rig come near F_c and score higher than the beginning of a
real hole. So where a channel freezes, the force that neither channel shows is maximised separately.
The rig is kept as drawn: a weak rig is a corner case that every step would leave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload_verify.falsify.scene import RIG
from stepload_verify.falsify.strategy import Strategy
from stepload_verify.falsify.trial import Point, Trial

PATIENCE = 4
"""Number of generations without an improvement after which a rig is abandoned."""


class Blind:
    """CMA-ES on the truth of a rig and what goes wrong, from the best points drawn at random."""

    def __init__(self, seed: int, name: str) -> None:
        self._seed, self._name = seed, name
        self._starts: list[tuple[Point, Trial]] = []
        self._begun = 0
        self._strategy: Strategy | None = None
        self._most = -math.inf
        self._in_vain = 0

    @property
    def ready(self) -> bool:
        """Whether there is a rig to continue with."""
        return self._strategy is not None or bool(self._starts)

    def drawn(self, point: Point, trial: Trial) -> None:
        """Add a random run, from which the search may continue later."""
        self._starts.append((point, trial))

    def ask(self) -> list[list[float]]:
        """The next generation; on another rig if this one is abandoned."""
        if self._strategy is None or (self._in_vain >= PATIENCE and self._starts):
            best = max(self._starts, key=lambda one: one[1].unseen)
            self._starts.remove(best)
            self._begun += 1
            name = f"{self._name} {self._begun}"
            self._strategy = Strategy(best[0].point, self._seed, name, RIG)
            self._most, self._in_vain = best[1].unseen, 0
        return self._strategy.ask()

    def tell(self, points: Sequence[Point], trials: Sequence[Trial]) -> None:
        """Record the results of a generation."""
        assert self._strategy is not None
        self._strategy.tell([point.point for point in points], [-one.unseen for one in trials])
        most = max(one.unseen for one in trials)
        self._in_vain = 0 if most > self._most else self._in_vain + 1
        self._most = max(self._most, most)
