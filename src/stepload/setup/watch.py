"""Watches an open rig at rest, tick by tick as a run would."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Any

from stepload.engine.open_rig import OpenRig

SETTLE_S = 0.2
"""Wait in s before watching: what readers lost while the loop was prepared is not counted."""


@dataclass(slots=True)
class Watched:
    """What came in, by stream, with the age of the newest sample at every tick (s)."""

    samples: dict[str, list[Any]] = field(default_factory=dict)
    ages_s: dict[str, list[float]] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)
    errors: dict[str, dict[str, int]] = field(default_factory=dict)
    late_s: list[float] = field(default_factory=list)
    wall_step_s: float = 0.0
    period_s: float = math.inf

    @property
    def late_ticks(self) -> int:
        """Ticks that this computer began a period late or more."""
        return sum(late_s > self.period_s for late_s in self.late_s)


def devices(rig: OpenRig) -> dict[str, Any]:
    """The open devices by the name that the plan gives them."""
    found = {
        "force": rig.force,
        "arm": rig.arm,
        "second_force.sensor": rig.second_force,
        "displacement": rig.displacement,
    }
    return {name: device for name, device in found.items() if device is not None}


def watch(rig: OpenRig, seconds: float) -> Watched:
    """Drain every device each tick for so long, from within `undisturbed`; nothing moves."""
    open_devices = devices(rig)
    seen = Watched(period_s=rig.arm.period_s)
    if not rig.clock.virtual:
        rig.clock.sleep_until(rig.clock.now_s() + SETTLE_S)
    for name, device in open_devices.items():
        device.drain()
        seen.samples[name], seen.ages_s[name] = [], []
        seen.lost[name] = -device.health().lost
    clock, period_s = rig.clock, rig.arm.period_s
    wall_s = time.time() - time.monotonic()
    deadline_s = clock.now_s()
    end_s = deadline_s + seconds
    newest_s = dict.fromkeys(open_devices, deadline_s)
    while deadline_s < end_s:
        deadline_s += period_s
        clock.sleep_until(deadline_s)
        now_s = clock.now_s()
        seen.late_s.append(now_s - deadline_s)
        for name, device in open_devices.items():
            if batch := device.drain():
                seen.samples[name] += batch
                newest_s[name] = batch[-1].receive_time_s
            seen.ages_s[name].append(now_s - newest_s[name])
        if now_s - deadline_s > period_s:
            deadline_s = now_s
    seen.wall_step_s = time.time() - time.monotonic() - wall_s
    for name, device in open_devices.items():
        health = device.health()
        seen.lost[name] += health.lost
        seen.errors[name] = dict(health.errors)
    return seen
