"""How far an approach may go on what the force channels have told last.

A channel that repeats itself tells nothing new. While it does, another one that is dead behind
live noise would go unseen, and the arm would press until equal samples tell.
"""

from __future__ import annotations

import math

from stepload.engine.supervisor import Supervisor
from stepload.envelope.unseen import Tells


class Listening:
    """Follows what the channels tell in an approach.

    Args:
        tells: which channels are listened to.
    """

    __slots__ = (
        "_main_m", "_main_n", "_main_spoke", "_second_m", "_second_n", "_second_spoke", "tells",
    )  # fmt: skip

    def __init__(self, tells: Tells) -> None:
        self.tells = tells
        self._main_n = self._second_n = math.nan
        self._main_m = self._second_m = math.inf
        self._main_spoke = self._second_spoke = False

    def begin(self, target_m: float) -> None:
        """The target has gone back to here. That the contact is open here is not believed of it."""
        if self.tells.main and target_m < self._main_m:
            self._main_m = target_m
        if self.tells.second and target_m < self._second_m:
            self._second_m = target_m

    def ask(self) -> None:
        """From now on `answered` says whether every channel has told something new."""
        self._main_spoke, self._second_spoke = not self.tells.main, not self.tells.second

    @property
    def answered(self) -> bool:
        """Whether every channel has told something new since it was asked for."""
        return self._main_spoke and self._second_spoke

    def hear(self, sup: Supervisor, sensed_m: float) -> None:
        """Take in what the channels read now; it was true where the target was `sensed_m`."""
        main_n, second_n = sup.force.raw_n, sup.second_raw_n
        if main_n != self._main_n:
            self._main_n, self._main_spoke = main_n, True
            if self.tells.main and sensed_m > self._main_m:
                self._main_m = sensed_m
        if second_n != self._second_n:
            self._second_n, self._second_spoke = second_n, True
            if self.tells.second and sensed_m > self._second_m:
                self._second_m = sensed_m

    @property
    def heard_m(self) -> float:
        """The target up to which every one of them has told something new; inf without any."""
        return self._main_m if self._main_m < self._second_m else self._second_m

    @property
    def silent(self) -> str:
        """The channel that has been silent for longer."""
        main = self._main_m < self._second_m if self.answered else not self._main_spoke
        return "force sensor" if main else "second force channel"
