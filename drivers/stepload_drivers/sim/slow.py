"""Mechanics in which something moves by itself: creep of the contact, drift of the load path."""

from __future__ import annotations

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.contact import Contact
from stepload_drivers.sim.plant import Plant


class SlowPlant(Plant):
    """A `Plant` whose contact creeps and whose surface comes nearer, both a base step at a time."""

    __slots__ = ("_creep", "_nearer_m")

    def __init__(self, spec: WorldSpec, contact: Contact, *, step_s: float) -> None:
        self._creep = contact.creep
        self._nearer_m = spec.drift_m_s * step_s
        super().__init__(spec, step_s=step_s, contact=contact)

    def step(self) -> None:
        """Go on by `step_s`: first what moves by itself, then the mechanics."""
        self._surface -= self._nearer_m
        if self._creep is not None:
            self._creep.flow(self.step_s)
        if self.force_n != 0.0:
            self.force_n, self._tangent = self._evaluate(self.tip_m - self._surface)
            if self.force_n > self._peak_n:
                self._peak_n = self.force_n
            self._resting = False
        self._contact_m = self._surface + self._law.residual_m
        super().step()


def plant_of(spec: WorldSpec, contact: Contact, *, step_s: float) -> Plant:
    """The mechanics of `spec`; only what moves by itself costs time."""
    if contact.creep is not None or spec.drift_m_s:
        return SlowPlant(spec, contact, step_s=step_s)
    return Plant(spec, step_s=step_s, contact=contact)
