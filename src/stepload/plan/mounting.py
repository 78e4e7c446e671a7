"""The declaration of a simulated rig with six axes: how its tip is held and meets the plate."""

from math import pi
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import LengthOrZero, Offset, Quantity, ShareAcross, number
from stepload.declaration.sections import SECTION, key

_Tilt = Annotated[float, Quantity("rad", -pi / 6, pi / 6)]
_Torque = Annotated[float, Quantity("N m", 0.0, 1e4)]
_Friction = Annotated[float, number(0.0, 2.0)]


@dataclass(frozen=True, slots=True, config=SECTION)
class Mounting:
    """Six axes of the simulated rig; z points along the press, x and y across it.

    The defaults are the median of a UR5e with its tool down, with assumed joint stiffnesses.
    """

    coupling_x: Annotated[
        ShareAcross,
        key("Tip motion along x per motion along the press, under axial load."),
    ] = 0.33
    coupling_y: Annotated[ShareAcross, key("The same along y.")] = 0.0
    lateral_compliance: Annotated[
        float,
        number(1e-3, 1e3),
        key("Lateral over axial compliance of the tip."),
    ] = 0.8
    turn_rad_per_n: Annotated[
        float,
        Quantity("rad/N", -1e-2, 1e-2),
        key("Rotation of the tool about y per force along the press or x."),
    ] = 23e-6
    friction: Annotated[_Friction, key("Static friction of payload and plate; 0: none.")] = 0.3
    friction_kinetic: Annotated[
        _Friction | None, key("Kinetic friction; none: the static one.")
    ] = None
    tangential_ratio: Annotated[
        float,
        number(0.0, 2.0, above=True),
        key("Tangential over normal stiffness of the sticking contact (Mindlin)."),
    ] = 0.8
    tilt_x_rad: Annotated[_Tilt, key("Plate tilt about x.")] = 0.0
    tilt_y_rad: Annotated[_Tilt, key("Plate tilt about y.")] = 0.0
    sensor_turn_x_rad: Annotated[
        _Tilt, key("Rotation vector of the force sensor against the press, x.")
    ] = 0.0
    sensor_turn_y_rad: Annotated[_Tilt, key("Rotation vector of the force sensor, y.")] = 0.0
    sensor_turn_z_rad: Annotated[
        float,
        Quantity("rad", -pi, pi),
        key("Rotation vector of the force sensor, z."),
    ] = 0.0
    sensor_lever_m: Annotated[
        LengthOrZero, key("Distance from the sensor's origin to the contact.")
    ] = 0.12
    eccentricity_x_m: Annotated[
        Offset,
        key("Distance of the contact from the axis of tool and sensor, x."),
    ] = 0.0
    eccentricity_y_m: Annotated[Offset, key("Distance of the contact from that axis, y.")] = 0.0
    cross_talk: Annotated[
        float,
        Quantity("%", -0.5, 0.5),
        key("Share of each force in the other forces, and of each torque in the other torques."),
    ] = 0.0
    torque_noise_n_m: Annotated[_Torque, key("Standard deviation of the torques.")] = 0.002
    torque_resolution_n_m: Annotated[_Torque, key("Resolution of the torques.")] = 0.0
    torque_range_n_m: Annotated[
        _Torque | None,
        key("Rated torque of the force sensor; none: no limit."),
    ] = None
    gauge_offset_x_m: Annotated[
        Offset, key("Lateral distance of the gauge from the contact, x.")
    ] = 0.0
    gauge_offset_y_m: Annotated[
        Offset, key("Lateral distance of the gauge from the contact, y.")
    ] = 0.0
