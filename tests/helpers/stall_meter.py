"""Measures how late the host wakes a thread that asked to sleep: what stalls, and for how long."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

PERIOD_S = 0.002
SHORTEST_S = 0.002


class Stall(NamedTuple):
    """From `begin_s` (monotonic) on, the host gave this process no time for `length_s`."""

    begin_s: float
    length_s: float


def withheld_s(late_s: float, own_cpu_s: float) -> float:
    """How much of a thread's lateness is the host's doing, in s.

    What the process itself computed meanwhile, with the interpreter held, is not.
    """
    return late_s - own_cpu_s


class StallMeter:
    """A thread of the process whose tests it watches.

    It shares the interpreter with them: whatever preempts the thread that holds it stalls the
    meter as well, and so does what stops the process.
    """

    def __init__(self) -> None:
        self._stalls: deque[Stall] = deque()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stall meter", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        now_s, cpu_s = time.monotonic(), time.process_time()
        while not self._over.is_set():
            due_s = now_s + PERIOD_S
            time.sleep(PERIOD_S)
            began_cpu_s, cpu_s = cpu_s, time.process_time()
            now_s = time.monotonic()
            length_s = withheld_s(now_s - due_s, cpu_s - began_cpu_s)
            if length_s > SHORTEST_S:
                self._stalls.append(Stall(due_s, length_s))

    def between(self, begin_s: float, end_s: float) -> list[Stall]:
        """The stalls that were not over at `begin_s` and had begun by `end_s`, oldest first.

        Earlier ones are forgotten.
        """
        time.sleep(2.0 * PERIOD_S)  # the meter must have seen what this thread has been through
        while self._stalls and sum(self._stalls[0]) <= begin_s:
            self._stalls.popleft()
        return [s for s in tuple(self._stalls) if s.begin_s < end_s]

    def close(self) -> None:
        """End the thread."""
        self._over.set()
        self._thread.join()


def longest_s(stalls: Sequence[Stall]) -> float:
    """The length of the longest of `stalls`, 0 without any."""
    return max((stall.length_s for stall in stalls), default=0.0)
