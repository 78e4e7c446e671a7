"""Plan sections for sideways motion: touches on a circle, and nulling of lateral force."""

from math import pi, radians
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Length, Quantity
from stepload.declaration.sections import SECTION, key
from stepload.rig.device import LARGEST_SHIFT_M


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Alignment:
    """Three touches on a circle before anything is loaded tell how the plate is tilted."""

    radius_m: Annotated[
        float,
        Quantity("m", 1e-3, LARGEST_SHIFT_M),
        key("Radius of the circle; the plate must be flat and free there."),
    ] = LARGEST_SHIFT_M
    max_tilt_rad: Annotated[
        float,
        Quantity("rad", radians(0.05), radians(3.0)),
        key("Largest tilt, its uncertainty included, at which the run goes on."),
    ] = radians(1.0)
    touch_error_m: Annotated[
        Length,
        key("Standard uncertainty of one touch; raised where resolution and speed need more."),
    ] = 20e-6


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Nulling:
    """Before a level is held, the lateral force is taken off sideways."""

    time_constant_s: Annotated[
        Annotated[float, Quantity("s", 0.05, 5.0)] | None,
        key("Time in which the lateral force falls to 1/e; none: at least 0.2 s."),
    ] = None
    largest_shift_m: Annotated[
        float,
        Quantity("m", 0.0, 3e-4, above=True),
        key("Largest lateral shift of the tool in all."),
    ] = 3e-4
    sensor_turn_rad: Annotated[
        float,
        Quantity("rad", -pi, pi),
        key("Rotation of the sensor's two other axes against the arm's axes 1 and 2."),
    ] = 0.0
