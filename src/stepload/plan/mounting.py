"""The declaration of a simulated rig with six axes: how its tip is held and meets the plate."""

from math import pi
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.declaration import quantities as q
from stepload.declaration.sections import SECTION

_Tilt = Annotated[float, q.Quantity("rad", -pi / 6, pi / 6)]
_Torque = Annotated[float, q.Quantity("N m", 0.0, 1e4)]
_Friction = Annotated[float, q.number(0.0, 2.0)]


@dataclass(frozen=True, slots=True, config=SECTION)
class Mounting:
    """Six axes of the simulated rig; z points along the press, x and y across it.

    The defaults are the median of a UR5e with its tool down, with assumed joint stiffnesses.
    """

    coupling_x: q.ShareAcross = 0.33
    """Tip motion along x per motion along the press, under axial load."""
    lateral_compliance: Annotated[float, q.number(1e-3, 1e3)] = 0.8
    """Lateral over axial compliance of the tip."""
    turn_rad_per_n: Annotated[float, q.Quantity("rad/N", -1e-2, 1e-2)] = 23e-6
    """Rotation of the tool about y per force along the press or x."""
    friction: _Friction = 0.3
    """Static friction of payload and plate; 0: none."""
    friction_kinetic: _Friction | None = None
    """Kinetic friction; none: the static one."""
    tangential_ratio: Annotated[float, q.number(0.0, 2.0, above=True)] = 0.8
    """Tangential over normal stiffness of the sticking contact (Mindlin)."""
    tilt_x_rad: _Tilt = 0.0
    """Plate tilt about x."""
    tilt_y_rad: _Tilt = 0.0
    """Plate tilt about y."""
    sensor_turn_x_rad: _Tilt = 0.0
    """Rotation vector of the force sensor against the press, x."""
    sensor_turn_z_rad: Annotated[float, q.Quantity("rad", -pi, pi)] = 0.0
    """Rotation vector of the force sensor, z."""
    sensor_lever_m: q.LengthOrZero = 0.12
    """Distance from the sensor's origin to the contact."""
    eccentricity_x_m: q.Offset = 0.0
    """Distance of the contact from the axis of tool and sensor, x."""
    eccentricity_y_m: q.Offset = 0.0
    """Distance of the contact from that axis, y."""
    cross_talk: Annotated[float, q.Quantity("%", -0.5, 0.5)] = 0.0
    """Share of each force in the other forces, and of each torque in the other torques."""
    torque_noise_n_m: _Torque = 0.002
    """Standard deviation of the torques."""
    gauge_offset_x_m: q.Offset = 0.0
    """Lateral distance of the gauge from the contact, x."""
