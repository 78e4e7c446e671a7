"""How far an approach may go on what the force channels have told last.

A channel that repeats itself tells nothing new. While it does, another one that is dead behind
live noise would go unseen, and the arm would press until equal samples tell.
"""

from __future__ import annotations

import math
from collections import deque

from stepload.engine.supervisor import Supervisor
from stepload.envelope.limits import RunLimits
from stepload.envelope.unseen import Tells


class Listening:
    """Follows what the channels tell in an approach.

    A reading is of where the target was by its lateness ago: of that and no more it tells.

    Args:
        tells: which channels are listened to.
        main_late, second_late: ticks from a target to readings of either channel that show where it
            took the arm; no reading is later.
    """

    __slots__ = (
        "_asked", "_main_late", "_main_m", "_main_n", "_main_spoke", "_second_late", "_second_m",
        "_second_n", "_second_spoke", "_targets_m", "tells",
    )  # fmt: skip

    def __init__(self, tells: Tells, main_late: int, second_late: int) -> None:
        self.tells = tells
        self._main_late, self._second_late = main_late, second_late
        self._targets_m: deque[float] = deque(maxlen=1 + max(main_late, second_late))
        self._asked = 0
        self._main_n = self._second_n = math.nan
        self._main_m = self._second_m = math.inf
        self._main_spoke = self._second_spoke = False

    def begin(self, target_m: float) -> None:
        """The target has gone back to here. That the contact is open here is not believed of it."""
        self._targets_m.clear()
        self._targets_m.append(target_m)
        if self.tells.main and target_m < self._main_m:
            self._main_m = target_m
        if self.tells.second and target_m < self._second_m:
            self._second_m = target_m

    def ask(self) -> None:
        """From now on `answered` says whether every channel has told something of from now on."""
        self._asked = 0
        self._main_spoke, self._second_spoke = not self.tells.main, not self.tells.second

    @property
    def answered(self) -> bool:
        """Whether every channel has told something new since it was asked for."""
        return self._main_spoke and self._second_spoke

    def hear(self, sup: Supervisor, target_m: float) -> None:
        """Take in a tick: what the channels read, and where the target is."""
        self._targets_m.append(target_m)
        self._asked += 1
        main_n, second_n = sup.force.raw_n, sup.second_raw_n
        if main_n != self._main_n:
            self._main_n = main_n
            self._main_spoke = self._main_spoke or self._asked > self._main_late
            sensed_m = self._back(self._main_late)
            if self.tells.main and sensed_m > self._main_m:
                self._main_m = sensed_m
        if second_n != self._second_n:
            self._second_n = second_n
            self._second_spoke = self._second_spoke or self._asked > self._second_late
            sensed_m = self._back(self._second_late)
            if self.tells.second and sensed_m > self._second_m:
                self._second_m = sensed_m

    def _back(self, late: int) -> float:
        """The target so many ticks ago, or where it began."""
        targets_m = self._targets_m
        return targets_m[-1 - late] if late < len(targets_m) else targets_m[0]

    @property
    def heard_m(self) -> float:
        """The target up to which every one of them has told something new; inf without any."""
        return self._main_m if self._main_m < self._second_m else self._second_m

    @property
    def silent(self) -> str:
        """The channel that has been silent for longer."""
        main = self._main_m < self._second_m if self.answered else not self._main_spoke
        return "force sensor" if main else "second force channel"


def listening_of(limits: RunLimits, tells: Tells) -> Listening:
    """For channels as late as a plan says."""
    main_s, second_s = limits.reaction_s, limits.second_late_s
    main, second = (math.ceil(late_s / limits.period_s - 1e-9) for late_s in (main_s, second_s))
    return Listening(tells, main, second)
