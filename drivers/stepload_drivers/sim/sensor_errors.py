"""What a force sensor feels besides the contact, and its errors besides noise."""

from __future__ import annotations

from collections.abc import Callable

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.channels import WRENCHES, Wrench
from stepload_drivers.sim.mechanics import Pressed


class Bent:
    """Reading along the axis of a sensor with a nonlinear characteristic.

    F + cross-talk of the lateral force + q2 F²/F_max + q3 F³/F_max², F_max its rated force.
    """

    def __init__(self, pressed: Pressed, spec: WorldSpec) -> None:
        self._pressed = pressed
        self._linear = 1.0 + spec.cross_talk * spec.lateral
        self._quadratic = spec.sensor_quadratic / spec.force_range_n
        self._cubic = spec.sensor_cubic / spec.force_range_n**2

    def _felt(self, force_n: float) -> float:
        return force_n * (self._linear + force_n * (self._quadratic + force_n * self._cubic))

    @property
    def force_n(self) -> float:
        return self._felt(self._pressed.force_n)

    @property
    def last_force_n(self) -> float:
        return self._felt(self._pressed.last_force_n)


def sideways(
    pressed: Pressed, axis: str, *, share: float, noise: Callable[[], float], six: bool
) -> Callable[[float], Wrench] | None:
    """The wrench of a sensor on which a share of the contact force also acts sideways.

    It acts along the component after the pressing one (x after z). A sensor of `six` components has
    its noise across the axis too. None without either: a load cell.
    """
    if share == 0.0 and not six:
        return None
    along = WRENCHES[axis]
    index = "xyz".index(axis[-1])
    across, other = (index + 1) % 3, (index + 2) % 3

    def felt(value: float) -> Wrench:
        wrench = list(along(value))
        wrench[across] = share * pressed.force_n + noise()
        if six:
            wrench[other] = noise()
        return wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]

    return felt
