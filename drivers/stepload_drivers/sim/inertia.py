"""Load on a sensor with a tool attached: contact force and inertia."""

from __future__ import annotations

from stepload_drivers.sim.channels import Pressed
from stepload_drivers.sim.mechanics import Mechanics


class Carrying:
    """A reading to which the mass on the measured side adds m ẍ, positive as pressing is."""

    def __init__(self, pressed: Pressed, plant: Mechanics, mass_kg: float) -> None:
        self._pressed = pressed
        self._plant = plant
        self._mass_kg = mass_kg

    @property
    def force_n(self) -> float:
        return self._pressed.force_n + self._mass_kg * self._plant.tip_acceleration_m_s2

    @property
    def last_force_n(self) -> float:
        return self._pressed.last_force_n + self._mass_kg * self._plant.tip_acceleration_m_s2


def carrying(pressed: Pressed, plant: Mechanics, mass_kg: float) -> Pressed:
    """`pressed` with the inertia of this mass; itself without one."""
    return Carrying(pressed, plant, mass_kg) if mass_kg else pressed
