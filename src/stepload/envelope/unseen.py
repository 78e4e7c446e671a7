"""How long a frozen force channel goes unseen, and what force can build up meanwhile."""

from __future__ import annotations

import math

from stepload.envelope.limits import RunLimits
from stepload.plan.model import Plan


def frozen_main_s(plan: Plan, limits: RunLimits) -> float:
    """Time in s after which equal samples of the main sensor stop the run; inf where none do."""
    return _equal_s(limits.identical_counts, plan.rig.force.rate_hz)


def frozen_second_s(plan: Plan, limits: RunLimits) -> float:
    """The same of the second channel; inf where there is none."""
    if not limits.cross_check:
        return math.inf
    sensor = plan.rig.second_force.sensor
    rate_hz = sensor.rate_hz if sensor else plan.rig.arm.rate_hz
    return _equal_s(limits.second_identical_counts, rate_hz)


def _equal_s(counts: int, rate_hz: float) -> float:
    return counts / rate_hz if counts else math.inf
