"""Mechanics with slow processes: creep, drift of the load path, a moving plate."""

from __future__ import annotations

import math

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.contact import Contact
from stepload_drivers.sim.faults import PLATE, Schedule
from stepload_drivers.sim.moving_plate import MovingPlate
from stepload_drivers.sim.plant import Plant

FINEST_M = 2e-8
"""A plate that moves in contact does so in steps of this size, between which the tip yields."""


class SlowPlant(Plant):
    """A `Plant` whose contact creeps and whose surface moves nearer, in base steps."""

    def __init__(self, spec: WorldSpec, contact: Contact, *, step_s: float) -> None:
        self._creep = contact.creep
        self._nearer_m = spec.drift_m_s * step_s
        self._plate = MovingPlate(spec, Schedule(spec.faults, kinds=PLATE), step_s)
        self._moving_m = 0.0
        super().__init__(spec, step_s=step_s, contact=contact)

    def step(self) -> None:
        """Go on by `step_s`: first what moves by itself, then the mechanics."""
        self.surface_m -= self._nearer_m
        self._moving_m = self._plate.change_m(self.time_s)
        if self._creep is not None:
            self._creep.flow(self.step_s)
        if self.force_n != 0.0:
            self.force_n, self._tangent = self._evaluate(self.tip_m - self.surface_m)
            if self.force_n > self.peak_n:
                self.peak_n = self.force_n
            self._resting = False
        self._contact_m = self.surface_m - self._moving_m + self._law.residual_m
        super().step()
        self.surface_m -= self._moving_m  # the tip is apart: nothing has been pressed on the way

    def _press(self, drive: float, speed: float, h: float) -> None:
        """Press on a plate that may move at the same time."""
        pieces = math.ceil(abs(self._moving_m) / FINEST_M) or 1
        piece_m, self._moving_m = self._moving_m / pieces, 0.0
        for _ in range(pieces):
            if piece_m != 0.0:
                self.surface_m -= piece_m
                self.force_n, self._tangent = self._evaluate(self.tip_m - self.surface_m)
                self.peak_n = max(self.peak_n, self.force_n)
            super()._press(drive, speed, h / pieces)
            drive += speed * h / pieces


def plant_of(spec: WorldSpec, contact: Contact, *, step_s: float) -> Plant:
    """The mechanics of `spec`; only slow processes that exist cost time."""
    plate = any(fault.kind == "plate_moves" for fault in spec.faults)
    if contact.creep is not None or spec.drift_m_s or plate:
        return SlowPlant(spec, contact, step_s=step_s)
    return Plant(spec, step_s=step_s, contact=contact)
