"""The sequence of a run for which there is no plan: equal steps up and down, with holds."""

from __future__ import annotations

from dataclasses import dataclass

FREE_S = 4.0
"""Time in s in free air after each cycle."""
CYCLES = 2
"""One cycle cannot separate drift from creep, and the identification does not use a third."""


@dataclass(frozen=True, slots=True)
class Order:
    """Equal steps up to its top force, and how long ramps and holds are.

    The default is that of a map. For a plan the envelope states how long its arm really takes.

    Attributes:
        steps, hold_s, ramp_s: as they are asked for.
        up_s: (steps,) how long it takes up to each level; () as asked for.
        down_s: (steps − 1,) from each level but the lowest down to the next; () as asked for.
    """

    steps: int = 6
    hold_s: float = 3.0
    ramp_s: float = 1.0
    up_s: tuple[float, ...] = ()
    down_s: tuple[float, ...] = ()

    @property
    def ways_s(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times up and down in the order in which they are pressed."""
        up = self.up_s or (self.ramp_s,) * self.steps
        return up, self.down_s[::-1] or (self.ramp_s,) * (self.steps - 1)

    @property
    def cycle_s(self) -> float:
        """Time of one cycle of a course, from touch to touch."""
        up, down = self.ways_s
        return sum(up) + sum(down) + (2 * self.steps - 1) * self.hold_s + FREE_S


DEFAULT = Order()
