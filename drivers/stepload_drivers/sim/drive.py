"""One driven axis of an arm: it follows its target with lag, limits and lost motion."""

from __future__ import annotations

import math
from collections import deque

from stepload.rig.world import WorldSpec

_EARLY_S = 1e-9
_THERE_M = 1e-12
"""A drive this near to its target stands."""


class Drive:
    """Advanced by fixed steps of `step_s`; position and speed in m and m/s.

    Args:
        across: a drive across the press: without play and slip between servo and axis, and its
            limited push stops it when it goes back too.
    """

    def __init__(self, spec: WorldSpec, step_s: float, *, across: bool = False) -> None:
        self.target_m = self.follower_m = self.position_m = self.speed_m_s = 0.0
        self.commands: deque[tuple[float, float]] = deque()
        self._step_s = step_s
        lag_s = spec.lag_s
        self._follow = (1.0 - math.exp(-step_s / lag_s) if lag_s > 0.0 else 1.0) / step_s
        accel = spec.max_acceleration_m_s2
        self._accel_step = accel * step_s
        self._twice_accel = 2.0 * accel
        self._brake_half = 0.5 * accel * step_s
        self._brake_gap = accel * (2.0 - self._follow * step_s) / self._follow**2
        self._max_speed = spec.max_speed_m_s
        self._max_push = spec.max_push_n
        lost_m = 0.0 if across else spec.lost_motion_m + spec.slip_m
        self._half_lost = 0.5 * lost_m
        self._slip_share = spec.slip_m / lost_m if lost_m > 0.0 else 0.0
        self._both_ways = across

    @property
    def measured_m(self) -> float:
        """Position where the arm measures it: before what slips."""
        if self._slip_share:
            return self.position_m + self._slip_share * (self.follower_m - self.position_m)
        return self.position_m

    def command(self, apply_s: float, target_m: float) -> None:
        """Follow `target_m` from `apply_s` on; commands take effect in order."""
        commands = self.commands
        if commands and commands[-1][0] > apply_s:
            apply_s = commands[-1][0]
        commands.append((apply_s, target_m))

    def take_commands(self, time_s: float) -> bool:
        """Follow the last command that is due at `time_s`; whether there is one."""
        commands = self.commands
        due = False
        while commands and commands[0][0] <= time_s + _EARLY_S:
            self.target_m = commands.popleft()[1]
            due = True
        return due

    @property
    def there(self) -> bool:
        """Whether it stands at its target."""
        gap, way = self.target_m - self.follower_m, self.speed_m_s * self._step_s
        return -_THERE_M < gap < _THERE_M and -_THERE_M < way < _THERE_M

    @property
    def stands(self) -> bool:
        """Whether its next step changes nothing."""
        return self.speed_m_s == 0.0 and self.there

    def hold(self) -> None:
        """Brake: stand here."""
        self.follower_m = self.target_m = self.position_m
        self.speed_m_s = 0.0

    def advance(self, push_n: float) -> float:
        """One step towards the target while it pushes with `push_n`; returns its speed in it."""
        gap = self.target_m - self.follower_m
        speed, h = self.speed_m_s, self._step_s
        if -_THERE_M < gap < _THERE_M and -_THERE_M < speed * h < _THERE_M:
            self.speed_m_s = 0.0
            return 0.0
        want = gap * self._follow
        most = self._brake_gap
        if not -most <= gap <= most:
            half = self._brake_half
            brake = math.sqrt(half * half + self._twice_accel * abs(gap)) - half
            want = brake if gap > 0.0 else -brake
        most = self._max_speed
        if want > most:
            want = most
        elif want < -most:
            want = -most
        change = self._accel_step
        if want > speed + change:
            want = speed + change
        elif want < speed - change:
            want = speed - change
        self.speed_m_s = want
        follower = self.follower_m + want * h
        here, half = self.position_m, self._half_lost
        if follower - here > half:
            blocked = push_n >= self._max_push
        elif here - follower > half:
            half = -half
            blocked = self._both_ways and push_n <= -self._max_push
        else:
            self.follower_m = follower
            return 0.0
        moved = follower - half
        if blocked:
            self.follower_m = here + half
            self.speed_m_s = 0.0
            return 0.0
        self.follower_m = follower
        self.position_m = moved
        return (moved - here) / h
