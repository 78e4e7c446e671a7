"""How long the arm takes from level to level, with every bound on its speed in contact.

A step is planned at the load rate of the plan. The arm may be slower: near F_lim little force is
left, and the speed there must be safe on a hidden hard stop and with a link that stalls. With one
force channel the travel limit bounds it too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from stepload.contact.power_law import ContactLaw
from stepload.feasibility.bounds import step_patience_s
from stepload.feasibility.command_backlog import sudden_step
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.press import END_WINDOW_S, NOISE_MULTIPLE
from stepload.feasibility.pressing import LONGEST_STALL_S
from stepload.plan.model import Plan

STIFFENING = 0.75
"""(n − 1)/n for the largest exponent that the look-ahead of the step controller covers, n = 4."""
LOOK_AHEAD = 0.3
"""Share of the remaining error that the look-ahead covers."""
PARTS = 24
"""Least number of parts over which the time of a step is summed."""


@dataclass(frozen=True, slots=True)
class LoadTimes:
    """Times in s of the load steps of one cycle, and the travel in m before them.

    Attributes:
        touch_m: from the surface until the force of a touch is there.
        up_s: (L,) from the level below, or the touch, until each level is reached.
        down_s: (L − 1,) from each level above the lowest down to the next.

    All times are at most what a step may last.
    """

    touch_m: float
    up_s: tuple[float, ...]
    down_s: tuple[float, ...]


def load_times(plan: Plan, limits: RunLimits, law: ContactLaw) -> LoadTimes:
    """The load steps of a plan against a payload of this law."""
    rig, procedure = plan.rig, plan.procedure
    levels = procedure.levels_n
    own = _Way(limits, law, rig.system_stiffness.stiffness_n_per_m)
    longest_s = step_patience_s(procedure)
    below = (procedure.touch_force_n, *levels[:-1])
    up = (
        own.time_s(low, high, longest_s, known=i > 0)
        for i, (low, high) in enumerate(zip(below, levels, strict=True))
    )
    down = (own.time_s(high, low, longest_s, known=False) for low, high in pairwise(levels))
    touch_m = law.deformation(limits.touch_force_n) + limits.touch_force_n / own.system_n_per_m
    return LoadTimes(touch_m, tuple(up), tuple(down))


@dataclass(frozen=True, slots=True)
class _Way:
    """The speed of a target in contact, as the step controller bounds it."""

    limits: RunLimits
    law: ContactLaw
    system_n_per_m: float

    def time_s(self, from_n: float, to_n: float, longest_s: float, *, known: bool) -> float:
        """Time in s from one force to another, at most `longest_s`, as the controller moves.

        Until the force has changed by half a band it presses as if the surface were rigid, unless
        the payload's compliance is known from the step before.
        """
        limits, sign = self.limits, math.copysign(1.0, to_n - from_n)
        way_n = abs(to_n - from_n)
        done_n, ramp_n, time_s = 0.0, 0.0, limits.loop_s
        floor = 1.0 / limits.stiffness_n_per_m
        while done_n < way_n - limits.band_n and time_s < longest_s:
            force_n = from_n + sign * done_n
            payload = 1.0 / self.law.tangent(max(force_n, limits.touch_force_n))
            compliance = payload + 1.0 / self.system_n_per_m
            error_n = max(ramp_n - done_n, 0.0)
            used = floor
            if known or done_n > 0.5 * limits.band_n:
                ahead = force_n / (force_n + LOOK_AHEAD * error_n) if sign > 0.0 else 1.0
                used += max(compliance - floor, 0.0) * ahead**STIFFENING
            fastest_m_s = limits.force_limit_n / limits.contact_n_s_per_m
            if sign > 0.0:
                fastest_m_s = self._fastest_m_s(force_n)
            gain = limits.step_rate_per_s * used / compliance
            fastest = fastest_m_s / compliance
            rate = min(gain * error_n, fastest)
            part_s = min(0.5 / gain, way_n / PARTS / limits.load_rate_n_per_s)
            if rate == fastest > 0.0 or rate * part_s > way_n / PARTS:
                part_s = way_n / PARTS / rate
            if fastest <= 0.0:
                return longest_s
            done_n += rate * part_s
            ramp_n = min(ramp_n + limits.load_rate_n_per_s * part_s, way_n)
            time_s += part_s
        return min(time_s, longest_s)

    def _fastest_m_s(self, force_n: float) -> float:
        limits = self.limits
        noise_n = NOISE_MULTIPLE * limits.noise_n
        rigid = (limits.force_limit_n - force_n - noise_n) / limits.contact_n_s_per_m
        ahead_m = sudden_step(
            limits.allowed_n - force_n - noise_n,
            limits.stiffness_n_per_m,
            limits.damping_n_s_per_m,
            limits.arm_acceleration_m_s2,
            limits.arm_lag_s,
        )
        stalled = ahead_m / LONGEST_STALL_S if ahead_m < limits.follow_m else rigid
        if limits.cross_check:
            return min(rigid, stalled)
        # The arm stands for each answer, until no reading is from before.
        half_m = 0.5 * limits.travel_m(force_n)
        stands_s = limits.undetected_s + limits.reaction_s + END_WINDOW_S
        return half_m / (half_m / min(rigid, stalled) + stands_s)
