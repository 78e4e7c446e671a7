"""CMA-ES over some numbers of a point; the others stay what they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

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
