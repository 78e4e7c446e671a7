"""When to ask a NETCANOEM for a sample, and which answer belongs to which question.

An answer carries no number, so a late or lost one could shift all later pairs. Hence: answers are
paired by id, questions go out on their own clock (at most `MAX_WAITING` ahead), and after a
time-out nothing is asked until the bus has been silent.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from stepload_drivers.ati.codec import Op, frame_id
from stepload_drivers.framing import CanFrame, CanPairer

MAX_WAITING = 4
ANSWER_S = 0.01
SILENCE_S = 0.02
LAG_WINDOW = 32
LAG_PERIODS = 0.75


class Answer(NamedTuple):
    """Both frames of an answer, and the number of its question."""

    question: int
    first: bytes
    second: bytes


class Poller:
    """Pure bookkeeping; times are host monotonic seconds, passed in.

    `timeouts` counts questions without an answer, `late` frames that came while waiting for
    silence, `resyncs` how often the questions were stopped.
    """

    def __init__(self, base: int, period_s: float, pair_limit_s: float) -> None:
        self._base = base
        self._period_s = period_s
        ids = frame_id(base, Op.GAUGES), frame_id(base, Op.GAUGES_2)
        self._pairer = CanPairer(ids, pair_limit_s, (8, 6))
        self._answer_s = max(ANSWER_S, 2.0 * period_s)
        self._waiting: deque[tuple[int, float]] = deque()
        self._question = 0
        self._next_s = -math.inf
        self._silent_since_s = math.nan
        self._reset_lag()
        self.timeouts = self.late = self.resyncs = 0

    def _reset_lag(self) -> None:
        self._floor_s = self._window_s = math.inf
        self._in_window = 0

    @property
    def orphans(self) -> int:
        """Frames without their other half."""
        return self._pairer.orphans

    @property
    def stopped(self) -> bool:
        """Whether it waits for silence."""
        return not math.isnan(self._silent_since_s)

    def due(self, now_s: float) -> bool:
        """Whether a question has to be sent now; notes it as sent."""
        if self.stopped:
            if now_s - self._silent_since_s < SILENCE_S:
                return False
            self._silent_since_s = math.nan
            self._next_s = now_s
        elif self._waiting and now_s - self._waiting[0][1] > self._answer_s:
            self._stop(now_s)
            return False
        if now_s < self._next_s or len(self._waiting) >= MAX_WAITING:
            return False
        behind = now_s - self._next_s > self._period_s
        self._next_s = now_s + self._period_s if behind else self._next_s + self._period_s
        self._question += 1
        self._waiting.append((self._question, now_s))
        return True

    def pause_s(self, now_s: float) -> float:
        """How long to wait for frames before `due` must be asked again."""
        if self.stopped:
            return min(SILENCE_S, max(0.0, self._silent_since_s + SILENCE_S - now_s))
        if len(self._waiting) >= MAX_WAITING:
            return max(0.0, self._waiting[0][1] + self._answer_s - now_s)
        return max(0.0, self._next_s - now_s)

    def _stop(self, now_s: float) -> None:
        self.timeouts += len(self._waiting)
        self.resyncs += 1
        self._waiting.clear()
        self._pairer.forget()
        self._silent_since_s = now_s
        self._reset_lag()

    def feed(self, frame: CanFrame, now_s: float) -> Answer | None:
        """The answer that `frame` completes, if any."""
        if frame.id >> 4 != self._base or frame.id & 0xF not in (Op.GAUGES, Op.GAUGES_2):
            return None
        if self.stopped:
            self.late += 1
            self._silent_since_s = now_s
            return None
        if (both := self._pairer.feed(frame)) is None:
            return None
        if not self._waiting:
            self.late += 1
            return None
        question, sent_s = self._waiting.popleft()
        self._watch_lag(now_s - sent_s, now_s)
        return Answer(question, both[:8], both[8:])

    def _watch_lag(self, lag_s: float, now_s: float) -> None:
        """An unanswered question makes every later answer look a period late: start over."""
        self._window_s = min(self._window_s, lag_s)
        self._in_window += 1
        if self._in_window < LAG_WINDOW:
            return
        if self._window_s > self._floor_s + LAG_PERIODS * self._period_s:
            self._stop(now_s)
        else:
            self._floor_s = min(self._floor_s, self._window_s)
            self._window_s, self._in_window = math.inf, 0
