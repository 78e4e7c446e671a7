"""Guard of every motion back: a force that grows on the way shows that the way is wrong.

A wrong sign of the arm, or of the arm and a sensor, makes "back" a push. So the force may only fall
on the way back. Before the first zero a reading may only fall too.
"""

from __future__ import annotations

import math

from stepload.engine.supervisor import Supervisor
from stepload.engine.watch import Trip
from stepload.feasibility.limits import RunLimits

REASON = "pressed_back"
REST_S = 0.5
"""Rest after which a way back is over."""
SETTLED = 2.0
"""Multiple of T_react from which the readings belong to the way back."""


class _Channel:
    """One force channel on the way back, and the target at which its force was least."""

    def __init__(self, tolerance_n: float, alpha: float) -> None:
        self.tolerance_n = tolerance_n
        self._alpha = alpha
        self.smooth_n = math.nan
        self.begin()

    def begin(self) -> None:
        """A way back begins here."""
        self.first_n = self.least_n = math.nan
        self.least_m = self.rose_n = 0.0

    def read(self, raw_n: float) -> None:
        if raw_n - raw_n != 0.0:
            return
        if self.smooth_n != self.smooth_n:
            self.smooth_n = raw_n
        self.smooth_n += self._alpha * (raw_n - self.smooth_n)

    def go(self, zero_n: float, target_m: float) -> None:
        force_n = self.smooth_n - zero_n
        if self.first_n != self.first_n:
            self.first_n = self.least_n = force_n
            self.least_m = target_m
        elif abs(force_n) < abs(self.least_n) - 0.5 * self.tolerance_n:
            self.least_n, self.least_m = force_n, target_m
        self.rose_n = force_n - self.first_n

    def grown_n(self, zero_n: float, zeroed: bool) -> float:
        """By how much the force has grown.

        A force of the opposite sign to that at the beginning is the pull of a contact that sticks.
        """
        if not zeroed:
            return self.rose_n
        force_n = self.smooth_n - zero_n
        pulls = force_n * self.first_n < 0.0 and abs(self.first_n) > self.tolerance_n
        return 0.0 if pulls else abs(force_n) - abs(self.least_n)


class RetractGuard:
    """Watches the target; a way back lasts until the target goes forward again, or has rested.

    Every force channel must have grown: one alone may be late, and a way back that is right must
    not be turned round. Once the direction is proven nothing turns it round: `follow` rests.

    `proven` says that the arm's direction is, since a touch pushed back.
    `found` is the trip of the first force that grew, `goal_m` the target of the least force then.
    """

    def __init__(self, limits: RunLimits) -> None:
        alpha = limits.period_s / (max(0.25 * limits.reaction_s, 2.0 * limits.period_s))
        touch_n = limits.touch_force_n
        self._channels = [_Channel(touch_n, alpha)]
        if limits.cross_check:
            self._channels.append(_Channel(max(touch_n, limits.cross_tolerance_n), alpha))
        self._settled_s = SETTLED * limits.reaction_s
        self._last_m = self._from_m = math.nan
        self._forward_s, self._back_s, self._back = -math.inf, math.inf, False
        self._zeros_n = 0.0, 0.0
        self.proven = False
        self.found: Trip | None = None
        self.goal_m = math.nan

    def follow(self, now_s: float, target_m: float, sup: Supervisor, touched: bool) -> Trip | None:
        """Judge one tick; the trip in the tick in which a force has grown too far.

        `target_m` is the target in force until now, `touched` whether there has been a touch.
        """
        self.proven = self.proven or touched
        if self.proven:
            return None
        readings_n = sup.force.raw_n, sup.second_raw_n
        for channel, raw_n in zip(self._channels, readings_n, strict=False):
            channel.read(raw_n)
        way_m, self._last_m = self._last_m - target_m, target_m
        zeros_n = sup.zero_n, sup.second_zero_n
        if way_m < 0.0:
            self._forward_s, self._back = now_s, False
        elif way_m > 0.0:
            self._back_s = now_s
            if not self._back:
                self._back, self._from_m = True, target_m + way_m
                for channel in self._channels:
                    channel.begin()
        elif now_s - self._back_s > REST_S + self._settled_s or zeros_n != self._zeros_n:
            self._back = False
        self._zeros_n = zeros_n
        if not self._back or now_s - self._forward_s < self._settled_s or self.found:
            return None
        grown = []
        for channel, zero_n in zip(self._channels, zeros_n, strict=False):
            channel.go(zero_n, target_m)
            grown_n, limit_n = channel.grown_n(zero_n, sup.tared), channel.tolerance_n
            if grown_n > limit_n:
                grown.append((grown_n / limit_n, grown_n, limit_n, channel))
        if len(grown) < len(self._channels):
            return None
        _, grown_n, limit_n, channel = max(grown, key=lambda one: one[0])
        return self.turn(grown_n, limit_n, channel.least_m if sup.tared else self._from_m)

    def turn(self, grown_n: float, limit_n: float, goal_m: float = math.nan) -> Trip:
        """The trip of a wrong way back: the arm must go to `goal_m`, NaN: where it came from."""
        self.goal_m = self._from_m if goal_m != goal_m else goal_m
        along = self._channels[0]
        whose = (
            "the arm's direction (approach)"
            if along.rose_n > -0.5 * along.tolerance_n
            else "the arm's direction (approach) and the sensor's sign (force.axis)"
        )
        self.found = Trip(
            REASON, grown_n, limit_n, "N",
            f"the force grew by {grown_n:.3g} N while the arm went back by"
            f" {(self._from_m - self._last_m) * 1e3:.3g} mm. The arm stopped and goes to where the"
            f" force was least. Check {whose}",
        )  # fmt: skip
        return self.found
