"""What the channels of a simulated rig read: its mechanics, of one axis or of six."""

from __future__ import annotations

from typing import Protocol

from stepload_drivers.sim.plant import Plant
from stepload_drivers.sim.six_plant import SixPlant

Mechanics = Plant | SixPlant
"""Both have the same names for what is along the press; `Plant` says what each means."""


class Pressed(Protocol):
    """What a force sensor feels: the force now, and a base step ago."""

    @property
    def force_n(self) -> float: ...

    @property
    def last_force_n(self) -> float: ...
