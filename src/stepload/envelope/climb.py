"""How long the arm takes from level to level, with every bound on its speed in contact.

A step is planned at the load rate of the plan. The arm may be slower: near F_lim little force is
left, and the speed there must be safe on a hidden hard stop and with a link that stalls. With one
force channel the travel limit bounds it too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from stepload.contact.power_law import ContactLaw
from stepload.envelope.bounds import step_patience_s
from stepload.envelope.catch_up import sudden_step
from stepload.envelope.leash import END_WINDOW_S
from stepload.envelope.limits import RunLimits
from stepload.envelope.press import NOISE_MULTIPLE
from stepload.envelope.pressing import LONGEST_STALL_S
from stepload.plan.model import Plan

BEGIN_TIME_CONSTANTS = 2.0
"""Time constants 1/λ by which a step is late: it begins as if the surface were rigid, and the force
follows its ramp one time constant behind."""
PARTS = 24
"""Number of parts over which the time of a step is summed."""


@dataclass(frozen=True, slots=True)
class Climbs:
    """Times in s of the load steps of one cycle.

    Attributes:
        up_s: (L,) from the level below, or the touch, until each level is reached.
        down_s: (L − 1,) from each level above the lowest down to the next.

    All times are at most what a step may last.
    """

    up_s: tuple[float, ...]
    down_s: tuple[float, ...]


def climbs_of(plan: Plan, limits: RunLimits, law: ContactLaw) -> Climbs:
    """The load steps of a plan against a payload of this law."""
    rig, procedure = plan.rig, plan.procedure
    levels = procedure.levels_n
    own = _Way(limits, law, rig.system_stiffness.stiffness_n_per_m)
    longest_s = step_patience_s(procedure)
    below = (procedure.touch_force_n, *levels[:-1])
    up = (own.up_s(low, high) for low, high in zip(below, levels, strict=True))
    down = (own.down_s(high, low) for low, high in pairwise(levels))
    return Climbs(
        tuple(min(each, longest_s) for each in up),
        tuple(min(each, longest_s) for each in down),
    )


@dataclass(frozen=True, slots=True)
class _Way:
    """The speed of a target in contact, as the step controller bounds it."""

    limits: RunLimits
    law: ContactLaw
    system_n_per_m: float

    def up_s(self, low_n: float, high_n: float) -> float:
        """Time in s to press from one force to a higher one."""
        limits = self.limits
        part_n = max(high_n - limits.band_n - low_n, 0.0) / PARTS
        total_s = BEGIN_TIME_CONSTANTS / limits.step_rate_per_s
        for i in range(PARTS):
            force_n = low_n + (i + 0.5) * part_n
            rate = self._fastest_m_s(force_n) / self._compliance(force_n)
            closing = limits.step_rate_per_s * (high_n - force_n)
            total_s += part_n / min(rate, closing, limits.load_rate_n_per_s)
        return total_s

    def down_s(self, high_n: float, low_n: float) -> float:
        """Time in s to come down from one force to a lower one."""
        limits = self.limits
        fastest = limits.force_limit_n / limits.contact_n_s_per_m
        part_n = max(high_n - low_n - limits.band_n, 0.0) / PARTS
        total_s = BEGIN_TIME_CONSTANTS / limits.step_rate_per_s
        for i in range(PARTS):
            force_n = high_n - (i + 0.5) * part_n
            closing = limits.step_rate_per_s * (force_n - low_n)
            rate = fastest / self._compliance(force_n)
            total_s += part_n / min(rate, closing, limits.load_rate_n_per_s)
        return total_s

    def _compliance(self, force_n: float) -> float:
        return 1.0 / self.law.tangent(force_n) + 1.0 / self.system_n_per_m

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
        stands_s = limits.unseen_s + limits.reaction_s + END_WINDOW_S
        return half_m / (half_m / min(rigid, stalled) + stands_s)
