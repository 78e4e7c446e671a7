"""The sequence of a run for which there is no plan: equal steps up and down, with holds."""

from __future__ import annotations

from dataclasses import dataclass

FREE_S = 4.0
"""Time in s in free air after each cycle."""
CYCLES = 2
"""One cycle cannot separate drift from creep, and the identification does not use a third."""


@dataclass(frozen=True, slots=True)
class Order:
    """Equal steps up to its top force, ramps and holds; the default is that of a map."""

    steps: int = 6
    hold_s: float = 3.0
    ramp_s: float = 1.0


DEFAULT = Order()
