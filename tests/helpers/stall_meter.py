"""Measures how late the host wakes a thread that asked to sleep, or brings it what came by a line.

Emulated devices send through pseudo-terminals. What is written into one is handed on by a thread of
the kernel, which has to wait for its turn as well: longer than any process where the host is full.
"""

from __future__ import annotations

import math
import os
import struct
import threading
import time
import tty
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

PERIOD_S = 0.002
SHORTEST_S = 0.002
SENT = struct.Struct("dd")
LAST = -1.0


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
    """Two threads of the process whose tests they watch.

    They share the interpreter with them: whatever preempts the thread that holds it stalls the
    meter as well, and so does what stops the process. The first sleeps and sends, the second reads.
    """

    _asleep = math.inf, 0.0
    """Until when the first sleeps, and the process's CPU time before."""

    def __init__(self) -> None:
        self._stalls: deque[Stall] = deque()
        self._under_way: deque[tuple[float, float]] = deque()
        self._asleep = (time.monotonic(), time.process_time())
        self._over = threading.Event()
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        self._threads = [
            threading.Thread(target=target, name="stall meter", daemon=True)
            for target in (self._run, self._read)
        ]
        for thread in self._threads:
            thread.start()

    def _run(self) -> None:
        now_s, cpu_s = self._asleep
        while not self._over.is_set():
            due_s = now_s + PERIOD_S
            self._asleep = due_s, cpu_s
            time.sleep(PERIOD_S)
            began_cpu_s, cpu_s = cpu_s, time.process_time()
            now_s = time.monotonic()
            self._note(due_s, withheld_s(now_s - due_s, cpu_s - began_cpu_s))
            self._under_way.append((now_s, cpu_s))
            os.write(self._far, SENT.pack(now_s, cpu_s))
        self._asleep = math.inf, 0.0
        os.write(self._far, SENT.pack(LAST, LAST))

    def _read(self) -> None:
        data = b""
        while True:
            data += os.read(self._near, 64 * SENT.size)
            now_s, cpu_s = time.monotonic(), time.process_time()
            whole = len(data) - len(data) % SENT.size
            for sent_s, sent_cpu_s in SENT.iter_unpack(data[:whole]):
                if sent_s == LAST:
                    return
                self._note(sent_s, withheld_s(now_s - sent_s, cpu_s - sent_cpu_s))
                self._under_way.popleft()
            data = data[whole:]

    def _note(self, begin_s: float, length_s: float) -> None:
        if length_s > SHORTEST_S:
            self._stalls.append(Stall(begin_s, length_s))

    def between(self, begin_s: float, end_s: float) -> list[Stall]:
        """The stalls that were not over at `begin_s` and had begun by `end_s`.

        Earlier ones are forgotten.
        """
        time.sleep(2.0 * PERIOD_S)  # the meter must have seen what this thread has been through
        for sent_s, sent_cpu_s in (self._asleep, *tuple(self._under_way)[:1]):
            late_s, cpu_s = time.monotonic() - sent_s, time.process_time() - sent_cpu_s
            self._note(sent_s, withheld_s(late_s, cpu_s))
        while self._stalls and sum(self._stalls[0]) <= begin_s:
            self._stalls.popleft()
        return [s for s in tuple(self._stalls) if s.begin_s < end_s and sum(s) > begin_s]

    def close(self) -> None:
        """End the threads."""
        self._over.set()
        for thread in self._threads:
            thread.join()
        os.close(self._far)
        os.close(self._near)


def longest_s(stalls: Sequence[Stall]) -> float:
    """The length of the longest of `stalls`, 0 without any."""
    return max((stall.length_s for stall in stalls), default=0.0)
