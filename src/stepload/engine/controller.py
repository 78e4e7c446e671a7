"""Brings the contact force to a level by moving the position target: v = λ c (F_level − F).

λ = 0.25/T with the loop delay T keeps the loop free of overshoot as long as c is not above the true
tangent compliance; c is a lower confidence bound of it. F_level rises along a ramp of the plan's
load rate, so that what is measured on the way is close to static. With one force channel a travel
limit bounds the target by what the force has *proved* so far (`engine.travel_limit`); with two the
other channel stops the run. Nor may the target run so far ahead of an arm that does not follow that
a sudden catch-up would bring the true force above F_c.
"""

from __future__ import annotations

import math

from stepload.engine.travel_limit import TravelLimit
from stepload.feasibility.command_backlog import sudden_step
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.load_times import LOOK_AHEAD, STIFFENING
from stepload.feasibility.pressing import LONGEST_STALL_S

LEAD_FILTER_S = 0.5
"""Time constant of how far the target leads the position of an arm that follows."""


class Lead:
    """How far the target leads the measured position: servo lag, lost motion, kinematic error.

    A command link may stall, and deliver at once what it held back: the arm then catches up faster
    than was commanded. So the target does not lead an arm that stands still by more than is allowed
    for such a step. The lead is not updated while the arm does not follow.
    """

    def __init__(self, period_s: float) -> None:
        self._share = min(1.0, period_s / LEAD_FILTER_S)
        self._lead_m = 0.0

    def begin(self, lead_m: float) -> None:
        """Use this lead as that of an arm that follows."""
        self._lead_m = lead_m

    def excess(self, target_m: float, position_m: float, allowed_m: float) -> float:
        """By how much the target is more than `allowed_m` ahead; 0.0 while it is not."""
        ahead_m = target_m - position_m - self._lead_m
        if ahead_m > allowed_m:
            return ahead_m - allowed_m
        self._lead_m += self._share * ahead_m
        return 0.0


CONFIDENCE = 3.0
FORGET_SHARE = 0.2
"""Data are forgotten over the travel in which the force changes by this share of itself."""
POINTS_PER_MEMORY = 20.0
LEAST_MEMORY_QUANTA = 8.0


class TangentCompliance:
    """Lower confidence bound of the tangent compliance dx/dF, from force and position in motion.

    Recursive regression of force on position (the position is the quieter of the two, so noise does
    not pull the slope down), forgotten by travel. Readings are averaged until the arm has moved by
    a small share of the memory, so that time spent at rest carries no weight. `c_m_per_n` is never
    below 1/K_s: the arm cannot feel stiffer than itself.
    """

    def __init__(self, stiffness_n_per_m: float, noise_n: float, resolution_m: float) -> None:
        self._floor = 1.0 / stiffness_n_per_m
        self._noise_n = noise_n
        self._quantum_m = resolution_m
        self._least_bin_m = 0.5 * resolution_m
        self.restart()

    def restart(self) -> None:
        """Forget everything: a new contact, or a change of direction."""
        self.c_m_per_n = self._floor
        self._remember(0.0)
        self._bin_start_m = math.nan
        self._bin_f = self._bin_x = 0.0
        self._bin_n = 0
        self._w = self._mx = self._mf = self._sxx = self._sxf = self._sff = 0.0
        self._x_last = 0.0

    def add(self, position_m: float, force_n: float) -> None:
        """Take one pair in; force and position must be of the same moment."""
        self._bin_f += force_n
        self._bin_x += position_m
        self._bin_n = n = self._bin_n + 1
        moved_m = position_m - self._bin_start_m
        if moved_m != moved_m:
            self._bin_start_m = position_m
            return
        bin_m = self._memory_m / POINTS_PER_MEMORY
        if -bin_m < moved_m < bin_m or -self._least_bin_m < moved_m < self._least_bin_m:
            return
        self._push(self._bin_x / n, self._bin_f / n, n)
        self._bin_start_m = position_m
        self._bin_f = self._bin_x = 0.0
        self._bin_n = 0

    def _push(self, x: float, f: float, averaged: int) -> None:
        keep = max(0.2, 1.0 - abs(x - self._x_last) / self._memory_m) if self._w else 0.0
        self._x_last = x
        self._w = w = keep * self._w + 1.0
        dx, df = x - self._mx, f - self._mf
        self._mx += dx / w
        self._mf += df / w
        rest = 1.0 - 1.0 / w
        self._sxx = sxx = keep * self._sxx + rest * dx * dx
        self._sxf = sxf = keep * self._sxf + rest * dx * df
        self._sff = sff = keep * self._sff + rest * df * df
        if w < 2.5 or sxx <= 0.0:
            return
        slope = sxf / sxx
        scatter = max(sff - slope * sxf, 0.0) / (w - 2.0)
        noise = self._noise_n * self._noise_n / averaged
        quantum = slope * self._quantum_m
        variance = max(scatter, noise + quantum * quantum / (12.0 * averaged)) / sxx
        stiffest = max(slope, 0.0) + CONFIDENCE * math.sqrt(variance)
        self.c_m_per_n = max(self._floor, 1.0 / stiffest)
        self._remember(f)

    def _remember(self, force_n: float) -> None:
        travel_m = self.c_m_per_n * max(FORGET_SHARE * abs(force_n), 12.0 * self._noise_n)
        self._memory_m = max(travel_m, LEAST_MEMORY_QUANTA * self._quantum_m)


class StepController:
    """One move from level to level, loading or unloading, never both.

    Without `travel_limit` nothing limits the travel. `begin`, then `step` once per tick until
    `reached`.
    `speed_m_s` is the speed of the target, `c_m_per_n` the compliance in use.
    """

    def __init__(self, limits: RunLimits, travel_limit: bool = True) -> None:
        self._limits = limits
        self._travel_limit = travel_limit and not limits.cross_check
        self._compliance = TangentCompliance(
            limits.stiffness_n_per_m, limits.noise_n, limits.position_resolution_m
        )
        self._travel = TravelLimit(limits)
        self._change_n = max(self._travel.rise_n, 0.5 * limits.band_n)
        self._band_n = limits.band_n
        self._delay = [0.0] * (
            1 + round((limits.force_delay_s + limits.period_s) / limits.period_s)
        )
        self._delay_at = 0
        self._level_n = self._start_n = self._ramp_n = 0.0
        self._sign = 1.0
        self._lead = Lead(limits.period_s)
        late_s = limits.undetected_s + limits.reaction_s
        self._targets_m = [0.0] * (1 + math.ceil(late_s / limits.period_s))
        self._targets_at = 0
        self._trusted = self._started = False
        self.c_m_per_n = 1.0 / limits.stiffness_n_per_m
        self.speed_m_s = 0.0
        self.reached = True

    def begin(
        self, level_n: float, force_n: float, position_m: float, sign: float, same_contact: bool,
        rested_n: float = math.nan, target_m: float = math.nan,
    ) -> None:  # fmt: skip
        """Aim at `level_n` from rest at this settled force, position and target; `sign` −1 unloads.

        `rested_n` is the mean force at rest, NaN where it is unknown: the force that triggered a
        touch is biased upwards by noise, and a soft payload would have to rise above it.

        Without a target it is where the arm is. A change of direction or a new contact discards the
        measured compliance. After a level that
        was given up the travel limit stays where it was: the force has proved nothing since.
        """
        given_up = same_contact and not self.reached and sign == self._sign > 0.0
        self._trusted = self._trusted and sign == self._sign > 0.0 and same_contact
        if not self._trusted:
            self._compliance.restart()
        self._level_n, self._sign = level_n, sign
        self._start_n = self._ramp_n = force_n
        proved_n = rested_n if rested_n == rested_n else force_n
        if target_m != target_m:
            target_m = position_m
        self._travel.begin(target_m, proved_n, same=given_up)
        self._started = False
        self._delay = [position_m] * len(self._delay)
        self._targets_m = [target_m] * len(self._targets_m)
        self.c_m_per_n = 1.0 / self._limits.stiffness_n_per_m
        self.speed_m_s = 0.0
        self.reached = False

    def step(
        self, force_n: float, smooth_n: float, position_m: float, target_m: float, step_s: float
    ) -> float:
        """The next target in m; the same one once the level is reached."""
        sign = self._sign
        if self.reached or sign * (self._level_n - smooth_n) <= self._band_n:
            self.reached = True
            self.speed_m_s = 0.0
            return target_m
        limits = self._limits
        delay, at = self._delay, self._delay_at
        then_m = delay[at]
        delay[at] = position_m
        at += 1
        self._delay_at = at if at < len(delay) else 0

        compliance = self._compliance
        compliance.add(then_m, force_n)
        ramp_n = self._ramp_n + sign * limits.load_rate_n_per_s * step_s
        if sign * (self._level_n - ramp_n) < 0.0:
            ramp_n = self._level_n
        self._ramp_n = ramp_n
        error_n = sign * (ramp_n - force_n)
        if error_n < 0.0:
            error_n = 0.0
        floor = 1.0 / limits.stiffness_n_per_m
        c = floor
        if self._trusted:
            present_n = smooth_n if smooth_n > limits.touch_force_n else limits.touch_force_n
            payload = compliance.c_m_per_n - floor
            if sign > 0.0:
                payload *= (present_n / (present_n + LOOK_AHEAD * error_n)) ** STIFFENING
            c += payload
        elif sign * (self._travel.mean_n - self._start_n) > self._change_n:
            self._trusted = True
        self.c_m_per_n = c

        room_n = limits.force_limit_n - smooth_n - 6.0 * limits.noise_n
        cap = room_n / limits.contact_n_s_per_m if room_n > 0.0 else 0.0
        if sign < 0.0:
            cap = limits.force_limit_n / limits.contact_n_s_per_m
        speed = limits.step_rate_per_s * c * error_n
        ahead_m = math.inf
        if sign > 0.0:
            ahead_m = sudden_step(
                limits.allowed_n - smooth_n - 6.0 * limits.noise_n,
                limits.stiffness_n_per_m,
                limits.damping_n_s_per_m,
                limits.arm_acceleration_m_s2,
                limits.arm_lag_s,
            )
            if ahead_m < limits.follow_m:
                cap = min(cap, ahead_m / LONGEST_STALL_S)
                ahead_m = limits.follow_m
        if speed > cap:
            speed = cap
        fastest = abs(self.speed_m_s) + limits.acceleration_m_s2 * step_s
        if speed > fastest:
            speed = fastest
        target = target_m + sign * speed * step_s

        targets_m, at = self._targets_m, self._targets_at
        seen_m = targets_m[at]
        targets_m[at] = target_m
        at += 1
        self._targets_at = at if at < len(targets_m) else 0
        travel = self._travel
        travel.add(force_n)
        if sign > 0.0:
            if not self._started:
                self._started = True
                self._lead.begin(target_m - position_m)
            end_m = travel.end_m() if self._travel_limit else math.inf
            if target > end_m:
                if seen_m == target_m:
                    travel.add_at_end(seen_m, force_n)
                target = end_m if end_m > target_m else target_m
                speed = (target - target_m) / step_s
            excess_m = self._lead.excess(target, position_m, ahead_m)
            if excess_m > 0.0:
                target -= excess_m
                speed = 0.0
        self.speed_m_s = sign * speed
        return target
