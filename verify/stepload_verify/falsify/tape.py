"""Random draws that are read from a vector: what a search moves, the draws of a campaign follow."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from statistics import NormalDist
from typing import Any, TypeVar

from stepload.errors import DomainError

_T = TypeVar("_T")
_NORMAL = NormalDist()
_EDGE = 1e-9


class Tape(Random):
    """A `Random` whose draws are the numbers of a vector, each between 0 and 1, one after another.

    Every draw is monotone in its number, so that a small step of the vector is a small step of the
    figure that is drawn, and a choice goes to its neighbour.

    Args:
        point: the numbers, shape (n,).
        name: what the tape is for, in messages.
    """

    def __init__(self, point: Sequence[float], name: str = "") -> None:
        super().__init__(0)
        self._point = point
        self._name = name
        self.used = 0
        """How many numbers have been read."""

    def random(self) -> float:
        """The next number of the vector.

        Raises:
            DomainError: there is none left.
        """
        if self.used >= len(self._point):
            raise DomainError(f"tape {self._name!r}: all {len(self._point)} numbers are used")
        value = float(self._point[self.used])
        self.used += 1
        return min(max(value, 0.0), 1.0 - _EDGE)

    def choice(self, seq: Any) -> Any:
        return seq[int(self.random() * len(seq))]

    def randrange(self, start: int, stop: int | None = None, step: int = 1) -> int:
        low, high = (0, start) if stop is None else (start, stop)
        return low + step * int(self.random() * -(-(high - low) // step))

    def gauss(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        return mu + sigma * _NORMAL.inv_cdf(min(max(self.random(), _EDGE), 1.0 - _EDGE))

    def getrandbits(self, k: int, /) -> int:
        return int(self.random() * 2**k)
