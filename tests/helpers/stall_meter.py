"""Measures how late the host wakes a process that asked to sleep: what stalls, and for how long.

A process of its own, because a thread beside a test would also be late where the test itself holds
the interpreter, and that is no fault of the host's.
"""

from __future__ import annotations

import json
import select
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import NamedTuple

PERIOD_S = 0.005
SHORTEST_S = 0.005


class Stall(NamedTuple):
    """The host gave the meter no time from `begin_s` to `end_s` (monotonic), when it was due."""

    begin_s: float
    end_s: float

    @property
    def length_s(self) -> float:
        return self.end_s - self.begin_s


class StallMeter:
    """Sees what stops this process together with its children, and what keeps them waiting."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-S", __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._stalls: list[Stall] = []

    def between(self, begin_s: float, end_s: float) -> list[Stall]:
        """The stalls that were not over at `begin_s` and had begun by `end_s`, oldest first."""
        self._stalls = [s for s in self._stalls + self._new() if s.end_s > begin_s]
        return [s for s in self._stalls if s.begin_s < end_s]

    def _new(self) -> list[Stall]:
        """The stalls since the last call."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(file=self._process.stdin, flush=True)
        return [Stall(*pair) for pair in json.loads(self._process.stdout.readline())]

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def longest_s(stalls: Sequence[Stall]) -> float:
    """The length of the longest of `stalls`, 0 without any."""
    return max((stall.length_s for stall in stalls), default=0.0)


def main() -> None:
    """For each line on standard input, the stalls since the last as a line of JSON."""
    stalls: list[tuple[float, float]] = []
    now_s = time.monotonic()
    while True:
        due_s = now_s + PERIOD_S
        asked = bool(select.select([sys.stdin], [], [], PERIOD_S)[0])
        now_s = time.monotonic()
        if now_s - due_s > SHORTEST_S:
            stalls.append((due_s, now_s))
        if asked:
            if not sys.stdin.readline():
                return
            print(json.dumps(stalls), flush=True)
            stalls.clear()


if __name__ == "__main__":
    main()
