"""Plan sections for sideways motion: touches on a circle, and nulling of lateral force."""

from math import pi, radians
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.plan.quantities import Length, Quantity
from stepload.plan.sections import SECTION, key
from stepload.rig.device import LARGEST_SHIFT_M


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Alignment:
    """Three touches on a circle before anything is loaded tell how the plate is tilted."""

    radius_m: Annotated[
        float,
        Quantity("m", 1e-3, LARGEST_SHIFT_M),
        key("Of the circle; the plate must be flat and free as far as the tool reaches there."),
    ] = LARGEST_SHIFT_M
    max_tilt_rad: Annotated[
        float,
        Quantity("rad", radians(0.05), radians(3.0)),
        key(
            "Largest tilt at which the run goes on, the uncertainty of the touches included; above "
            "it the run ends and says by how much to turn."
        ),
    ] = radians(1.0)
    touch_error_m: Annotated[
        Length,
        key("Standard uncertainty of one touch; more where resolution and speed say so."),
    ] = 20e-6


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Nulling:
    """Before a level is held, the lateral force is taken off sideways."""

    time_constant_s: Annotated[
        Annotated[float, Quantity("s", 0.05, 5.0)] | None,
        key(
            "Time in which it falls to a third where the arm is as stiff sideways as believed; "
            "none: 0.2 s, or three delays of the control loop where that is more."
        ),
    ] = None
    largest_shift_m: Annotated[
        float,
        Quantity("m", 0.0, 3e-4, above=True),
        key("How far the tool may be shifted in all."),
    ] = 3e-4
    sensor_turn_rad: Annotated[
        float,
        Quantity("rad", -pi, pi),
        key(
            "Angle about the approach by which the force sensor's two other axes are turned "
            "against the arm's axes 1 and 2."
        ),
    ] = 0.0
