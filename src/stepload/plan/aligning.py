"""Plan sections for sideways motion: touches on a circle, and nulling of lateral force."""

from math import pi, radians
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.declaration import quantities as q
from stepload.declaration.sections import SECTION
from stepload.rig.device import LARGEST_SHIFT_M


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Alignment:
    """Three touches on a circle before anything is loaded tell how the plate is tilted."""

    radius_m: Annotated[float, q.Quantity("m", 1e-3, LARGEST_SHIFT_M)] = LARGEST_SHIFT_M
    """Radius of the circle; the plate must be flat and free there."""
    max_tilt_rad: Annotated[float, q.Quantity("rad", radians(0.05), radians(3.0))] = radians(1.0)
    """Largest tilt, its uncertainty included, at which the run goes on."""
    touch_error_m: q.Length = 20e-6
    """Standard uncertainty of one touch; raised where resolution and speed need more."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Nulling:
    """Before a level is held, the lateral force is taken off sideways."""

    time_constant_s: Annotated[float, q.Quantity("s", 0.05, 5.0)] | None = None
    """Time in which the lateral force falls to 1/e; none: at least 0.2 s."""
    largest_shift_m: Annotated[float, q.Quantity("m", 0.0, 3e-4, above=True)] = 3e-4
    """Largest lateral shift of the tool in all."""
    sensor_turn_rad: Annotated[float, q.Quantity("rad", -pi, pi)] = 0.0
    """Rotation of the sensor's two other axes against the arm's axes 1 and 2."""
