"""Time course of a simulated run: steps up and down, twice, at a constant sample rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepload.envelope.order import CYCLES, DEFAULT, FREE_S, Order
from stepload.estimators.fit import BoolArray, FloatArray

RATE_HZ = 50.0
"""Samples per second. A rig is faster, but averaging of more noise is not counted on."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """One ramp or hold: samples `start` to `stop` of a run."""

    start: int
    stop: int
    cycle: int
    loading: bool
    held: bool


@dataclass(frozen=True, slots=True)
class Course:
    """The commanded force of a run over N samples.

    Attributes:
        time_s, force_n: (N,); 0 N in free air.
        stretches: ramps and holds in the order of time.
        touches: samples of the first touch and the last.
        touch_n: force at which a touch is seen.
    """

    time_s: FloatArray
    force_n: FloatArray
    stretches: tuple[Stretch, ...]
    touches: tuple[int, int]
    touch_n: float

    @property
    def top_n(self) -> float:
        """The top force."""
        return float(self.force_n.max())

    @property
    def loading(self) -> BoolArray:
        """(N,) whether a sample is on the way up or in a hold there."""
        found = np.zeros(self.force_n.size, dtype=bool)
        for each in self.stretches:
            if each.loading:
                found[each.start : each.stop] = True
        return found

    def branch(self, cycle: int, *, loading: bool) -> tuple[Stretch, ...]:
        """The ramps and holds of one branch."""
        return tuple(s for s in self.stretches if s.cycle == cycle and s.loading == loading)


def course(top_n: float, touch_n: float, order: Order = DEFAULT) -> Course:
    """Two cycles of equal steps up and down with ramps between them; then a last touch.

    Args:
        top_n: the top force, above `touch_n`.
        touch_n: the force at which a touch is seen; a loading begins there.
        order: its steps, ramps and holds.
    """
    levels = top_n * np.arange(1, order.steps + 1) / order.steps
    forces: list[FloatArray] = []
    stretches: list[Stretch] = []
    at = 0

    def add(seconds: float, low_n: float, high_n: float) -> int:
        nonlocal at
        count = round(seconds * RATE_HZ)
        forces.append(low_n + (high_n - low_n) * np.arange(1, count + 1) / count)
        at += count
        return at - count

    up, down = order.ways_s
    ways = ((True, levels.tolist(), up), (False, levels[-2::-1].tolist(), down))
    for cycle in range(1, CYCLES + 1):
        before = touch_n
        for loading, ends, times in ways:
            for end, seconds in zip(ends, times, strict=True):
                ramp, hold = add(seconds, before, end), add(order.hold_s, end, end)
                stretches.append(Stretch(ramp, hold, cycle, loading, False))
                stretches.append(Stretch(hold, at, cycle, loading, True))
                before = end
        add(FREE_S, 0.0, 0.0)
    forces.append(np.array([touch_n]))
    force_n = np.concatenate(forces)
    return Course(
        np.arange(force_n.size) / RATE_HZ, force_n, tuple(stretches), (0, force_n.size - 1), touch_n
    )
