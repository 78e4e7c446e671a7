"""Brings the contact force to a level by moving the position target: v = λ c (F_level − F).

λ = 0.25/T with the loop delay T keeps the loop free of overshoot as long as c is not above the true
tangent compliance; c is a lower confidence bound of it. F_level rises along a ramp of the plan's
load rate, so that what is measured on the way is close to static. With one force channel a travel
limit bounds the target by what the force has *proved* so far (`engine.anchor`); with two the other
channel stops the run. Nor may the target run so far ahead of an arm that does not follow that a
sudden catch-up would bring the true force above F_c.
"""

from __future__ import annotations

import math

from stepload.engine.anchor import Anchor
from stepload.engine.compliance import TangentCompliance
from stepload.engine.tracking import Lead
from stepload.envelope.command_backlog import sudden_step
from stepload.envelope.limits import RunLimits
from stepload.envelope.load_times import LOOK_AHEAD, STIFFENING
from stepload.envelope.pressing import LONGEST_STALL_S


class StepController:
    """One move from level to level, loading or unloading, never both.

    Without `leash` nothing limits the travel. `begin`, then `step` once per tick until `reached`.
    `speed_m_s` is the speed of the target, `c_m_per_n` the compliance in use.
    """

    def __init__(self, limits: RunLimits, leash: bool = True) -> None:
        self._limits = limits
        self._leash = leash and not limits.cross_check
        self._compliance = TangentCompliance(
            limits.stiffness_n_per_m, limits.noise_n, limits.position_resolution_m
        )
        self._anchor = Anchor(limits)
        self._change_n = max(self._anchor.rise_n, 0.5 * limits.band_n)
        self._band_n = limits.band_n
        self._delay = [0.0] * (
            1 + round((limits.force_delay_s + limits.period_s) / limits.period_s)
        )
        self._delay_at = 0
        self._level_n = self._start_n = self._ramp_n = 0.0
        self._sign = 1.0
        self._lead = Lead(limits.period_s)
        late_s = limits.unseen_s + limits.reaction_s
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
        self._anchor.begin(target_m, proved_n, same=given_up)
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
        elif sign * (self._anchor.mean_n - self._start_n) > self._change_n:
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
        anchor = self._anchor
        anchor.add(force_n)
        if sign > 0.0:
            if not self._started:
                self._started = True
                self._lead.begin(target_m - position_m)
            end_m = anchor.end_m() if self._leash else math.inf
            if target > end_m:
                if seen_m == target_m:
                    anchor.add_at_end(seen_m, force_n)
                target = end_m if end_m > target_m else target_m
                speed = (target - target_m) / step_s
            excess_m = self._lead.excess(target, position_m, ahead_m)
            if excess_m > 0.0:
                target -= excess_m
                speed = 0.0
        self.speed_m_s = sign * speed
        return target
