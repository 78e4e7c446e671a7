"""Guard of every motion back: a force that grows on the way shows that the way is wrong.

A wrong sign of the arm, of a sensor, or of both makes "back" a push. So the force may only fall on
the way back. Before the first zero a reading may only fall too; a reading that falls because sensor
and arm are both wrong falls later and faster, as a force does that builds up.
"""

from __future__ import annotations

import math

from stepload.engine.supervisor import Supervisor
from stepload.engine.watch import Breach
from stepload.envelope.limits import RunLimits

REASON = "pressed_back"
BUILDS_UP, FALLS = 0.45, 0.6
"""Ratio of the mean change on the way to the whole one: below the first the force builds up, above
the second it falls. For F ~ x^n it is 1/(n + 1) from the first touch on, and less after free air.
"""
UNZEROED_SHARE = 0.5
"""Share of F_lim by which a reading that falls may change before the first zero."""
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
        self.least_m = 0.0
        self.mean_n = self.rose_n = self._way_m = 0.0

    def read(self, raw_n: float) -> None:
        if not math.isfinite(raw_n):
            return
        if self.smooth_n != self.smooth_n:
            self.smooth_n = raw_n
        self.smooth_n += self._alpha * (raw_n - self.smooth_n)

    def go(self, zero_n: float, target_m: float, way_m: float) -> None:
        """Follow `way_m` further back than ever before."""
        force_n = self.smooth_n - zero_n
        if self.first_n != self.first_n:
            self.first_n = self.least_n = force_n
            self.least_m = target_m
        elif abs(force_n) < abs(self.least_n) - 0.5 * self.tolerance_n:
            self.least_n, self.least_m = force_n, target_m
        self.rose_n = force_n - self.first_n
        if way_m > 0.0:
            self._way_m += way_m
            self.mean_n += way_m / self._way_m * (self.change_n - self.mean_n)

    def grown_n(self, zero_n: float, zeroed: bool, largest_n: float) -> tuple[float, float]:
        """By how much the force has grown, and the allowed growth.

        A force of the opposite sign to that at the beginning is the pull of a contact that sticks.
        """
        force_n = self.smooth_n - zero_n
        if zeroed:
            pulls = force_n * self.first_n < 0.0 and abs(self.first_n) > self.tolerance_n
            return 0.0 if pulls else abs(force_n) - abs(self.least_n), self.tolerance_n
        change_n = force_n - self.first_n
        if change_n > 0.0:
            return change_n, self.tolerance_n
        return -change_n if self.share < FALLS else 0.0, largest_n

    @property
    def change_n(self) -> float:
        """Size of the change since the way back began."""
        return abs(self.rose_n)

    @property
    def share(self) -> float:
        """Mean change on the way over the whole one; small where the change came late."""
        return self.mean_n / self.change_n if self.change_n > 0.0 else 1.0


class RetractGuard:
    """Watches the target; a way back lasts until the target goes forward again, or has rested.

    Every force channel must have grown: one alone may be late, and a way back that is right must
    not be turned round. Once the direction is proven nothing turns it round.

    `proven` says that the arm's direction is: a touch pushed back, or a contact was left.
    `found` is the breach of the first force that grew, `goal_m` the target of the least force then.
    """

    def __init__(self, limits: RunLimits) -> None:
        alpha = limits.period_s / (max(0.25 * limits.reaction_s, 2.0 * limits.period_s))
        touch_n = limits.touch_force_n
        self._channels = [_Channel(touch_n, alpha)]
        if limits.cross_check:
            self._channels.append(_Channel(max(touch_n, limits.cross_tolerance_n), alpha))
        self._largest_n = UNZEROED_SHARE * limits.force_limit_n
        self._settled_s = SETTLED * limits.reaction_s
        self._alpha = alpha
        self._last_m = self._from_m = self._at_m = self._farthest_m = math.nan
        self._forward_s, self._back_s, self._back = -math.inf, math.inf, False
        self._zeros_n = 0.0, 0.0
        self.proven = False
        self.found: Breach | None = None
        self.goal_m = math.nan

    @property
    def share(self) -> float:
        """`BUILDS_UP` and `FALLS` of the channel that has changed most, in tolerances."""
        return max(self._channels, key=lambda one: one.change_n / one.tolerance_n).share

    @property
    def from_m(self) -> float:
        """Target at which the way back began."""
        return self._from_m

    def follow(
        self, now_s: float, target_m: float, sup: Supervisor, touched: bool
    ) -> Breach | None:
        """Judge one tick; the breach in the tick in which a force has grown too far.

        `target_m` is the target in force until now, `touched` whether there has been a touch.
        """
        self.proven = self.proven or touched
        readings_n = sup.force.raw_n, sup.second_raw_n
        for channel, raw_n in zip(self._channels, readings_n, strict=False):
            channel.read(raw_n)
        at_m = sup.arm.position_m
        if not abs(at_m - self._at_m) < math.inf:
            self._at_m = at_m
        self._at_m += self._alpha * (at_m - self._at_m)  # as late as the forces
        way_m, self._last_m = self._last_m - target_m, target_m
        zeros_n = sup.zero_n, sup.second_zero_n
        if way_m < 0.0:
            self._forward_s, self._back = now_s, False
        elif way_m > 0.0:
            self._back_s = now_s
            if not self._back:
                self._back, self._from_m = True, target_m + way_m
                self._farthest_m = self._at_m
                for channel in self._channels:
                    channel.begin()
        elif now_s - self._back_s > REST_S + self._settled_s or zeros_n != self._zeros_n:
            self._back = False
        self._zeros_n = zeros_n
        if not self._back or now_s - self._forward_s < self._settled_s or self.found:
            return None
        at_m, grown = self._at_m, []
        way_m = max(0.0, self._farthest_m - at_m)
        self._farthest_m = min(self._farthest_m, at_m)
        for channel, zero_n in zip(self._channels, zeros_n, strict=False):
            channel.go(zero_n, target_m, way_m)
            grown_n, limit_n = channel.grown_n(zero_n, sup.tared, self._largest_n)
            if grown_n > limit_n:
                grown.append((grown_n / limit_n, grown_n, limit_n, channel))
        if self.proven or len(grown) < len(self._channels):
            return None
        _, grown_n, limit_n, channel = max(grown, key=lambda one: one[0])
        return self.turn(grown_n, limit_n, channel.least_m if sup.tared else self._from_m)

    def turn(self, grown_n: float, limit_n: float, goal_m: float) -> Breach:
        """The breach of a wrong way back: the arm must go to `goal_m`."""
        self.goal_m = goal_m
        along = self._channels[0]
        whose = (
            "the arm's direction (approach)"
            if along.rose_n > -0.5 * along.tolerance_n
            else "the arm's direction (approach) and the sensor's sign (force.axis)"
        )
        self.found = Breach(
            REASON, grown_n, limit_n, "N",
            f"the force grew by {grown_n:.3g} N while the arm went back by"
            f" {(self._from_m - self._last_m) * 1e3:.3g} mm. The arm stopped and goes to where the"
            f" force was least. Check {whose}",
        )  # fmt: skip
        return self.found
