"""How far an approach may go after the last new readings of the force channels.

A channel that repeats its reading gives no new information. Meanwhile another one that is dead
behind live noise would go unnoticed, and the arm would press until the rule on equal samples (R4)
trips.
"""

from __future__ import annotations

import math
from collections import deque

from stepload.engine.supervisor import Supervisor
from stepload.envelope.limits import RunLimits
from stepload.envelope.unseen import Tells


class _Channel:
    """One channel, which `must` give new readings or need not: where it did, and what it said last.

    `late` is an upper bound in ticks on the delay from a target to the channel's readings there,
    `heard_m` the target up to which it has given new readings, inf if it need not.
    """

    def __init__(self, must: bool, late: int) -> None:
        self.must, self.late = must, late
        self.heard_m = math.inf
        self.spoke = False
        self._reading_n = math.nan

    def begin(self, target_m: float) -> None:
        if self.must and target_m < self.heard_m:
            self.heard_m = target_m

    def hear(self, reading_n: float, sensed_m: float, asked: int) -> None:
        """Take in a reading of the target `sensed_m`, so many ticks after the last question."""
        if reading_n != self._reading_n:
            self._reading_n = reading_n
            self.spoke = self.spoke or asked > self.late
            if self.must and sensed_m > self.heard_m:
                self.heard_m = sensed_m


class Listening:
    """Tracks where the channels gave new readings in an approach.

    A reading shows the force at the target of one delay ago, and nothing later.

    Args:
        tells: the channels that must give new readings.
        main_late, second_late: upper bounds in ticks on the delay from a target to the channel's
            readings there.
    """

    def __init__(self, tells: Tells, main_late: int, second_late: int) -> None:
        self.tells = tells
        self._main = _Channel(tells.main, main_late)
        self._second = _Channel(tells.second, second_late)
        self._targets_m: deque[float] = deque(maxlen=1 + max(main_late, second_late))
        self._asked = 0

    def begin(self, target_m: float) -> None:
        """Restart from a target that has gone back; the contact is not assumed to be open."""
        self._targets_m.clear()
        self._targets_m.append(target_m)
        self._main.begin(target_m)
        self._second.begin(target_m)

    def ask(self) -> None:
        """From now on `answered` says whether every channel has a new reading of a later moment."""
        self._asked = 0
        self._main.spoke, self._second.spoke = not self.tells.main, not self.tells.second

    @property
    def answered(self) -> bool:
        """Whether every channel has given a new reading of a moment after `ask` was called."""
        return self._main.spoke and self._second.spoke

    def hear(self, sup: Supervisor, target_m: float) -> None:
        """Take in a tick: what the channels read, and where the target is."""
        self._targets_m.append(target_m)
        self._asked += 1
        for channel, reading_n in (
            (self._main, sup.force.raw_n),
            (self._second, sup.second_raw_n),
        ):
            channel.hear(reading_n, self._back(channel.late), self._asked)

    def _back(self, late: int) -> float:
        """The target `late` ticks ago, or the oldest one known."""
        targets_m = self._targets_m
        return targets_m[-1 - late] if late < len(targets_m) else targets_m[0]

    @property
    def heard_m(self) -> float:
        """The target up to which every channel has given new readings; inf if none has to."""
        return min(self._main.heard_m, self._second.heard_m)

    @property
    def silent(self) -> str:
        """The channel that has been silent for longer."""
        main_m, second_m = self._main.heard_m, self._second.heard_m
        main = main_m < second_m if self.answered else not self._main.spoke
        return "force sensor" if main else "second force channel"


def listening_of(limits: RunLimits, tells: Tells) -> Listening:
    """A `Listening` with the delays of these limits."""
    main_s, second_s = limits.reaction_s, limits.second_late_s
    main, second = (math.ceil(late_s / limits.period_s - 1e-9) for late_s in (main_s, second_s))
    return Listening(tells, main, second)
