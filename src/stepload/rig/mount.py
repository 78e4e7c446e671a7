"""How the tip of a simulated rig is held in six axes, and what its sensors measure of that.

The pressing frame is right-handed: axis 3 points along the press, axes 1 and 2 across it. The load
f is what the tip does to the plate, so that pressing is positive along axis 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector3 = tuple[float, float, float]
Matrix3 = tuple[Vector3, Vector3, Vector3]
Matrix6 = tuple[tuple[float, float, float, float, float, float], ...]

ZERO: Vector3 = (0.0, 0.0, 0.0)
NO_TURN: Matrix3 = (ZERO, ZERO, ZERO)
MINDLIN_RATIO = 0.8
"""2 (1 − ν)/(2 − ν), tangential over normal contact stiffness, for ν between 0.3 and 0.35."""


@dataclass(frozen=True, slots=True)
class SensorMount:
    """Mounting, cross-talk, noise and range of a six-axis force sensor.

    Its frame is the pressing frame, turned by `rotation_rad` and with the axes renamed so that the
    axis of the plan shows the press; a sensor whose axis is negative shows all six with the
    opposite sign.

    Attributes:
        rotation_rad: rotation vector of the sensor against the pressing frame, unknown to the run.
        lever_m: contact point seen from the sensor's origin, pressing frame, with what the contact
            is off the tool's axis.
        cross_talk: share of each component (columns) in the reading of each (rows), in N and N·m,
            beside the component itself; None for none.
        torque_noise_nm, torque_quantum_nm: standard deviation and resolution of the torques.
        lateral_range_n: rated force across the press; inf: as along it.
        torque_range_nm: rated torque about each axis.
    """

    rotation_rad: Vector3 = ZERO
    lever_m: Vector3 = (0.0, 0.0, 0.12)
    cross_talk: Matrix6 | None = None
    torque_noise_nm: float = 0.0
    torque_quantum_nm: float = 0.0
    lateral_range_n: float = math.inf
    torque_range_nm: float = math.inf


@dataclass(frozen=True, slots=True)
class Mount:
    """How the tip is held by the arm and how it meets the plate.

    Rotation is slaved: the tool turns by `turn_rad_per_n` · f and does not resist.

    Attributes:
        compliance_m_per_n: of the contact point without friction; its element 33 is 1/K_s.
        turn_rad_per_n: rotation of the tool over the load.
        mass_kg: mass matrix of the tip; None: the effective mass in every direction.
        friction_static, friction_kinetic: of payload and plate.
        tangential_ratio: tangential over normal stiffness of the contact while it sticks.
        plate_tilt_rad: the plate is turned about axes 1 and 2 by these angles.
        gauge_offset_m: where the gauge measures, seen from the contact along axes 1 and 2.
        sensor, second_sensor: where the force sensors sit.
    """

    compliance_m_per_n: Matrix3
    turn_rad_per_n: Matrix3 = NO_TURN
    mass_kg: Matrix3 | None = None
    friction_static: float = 0.0
    friction_kinetic: float = 0.0
    tangential_ratio: float = MINDLIN_RATIO
    plate_tilt_rad: tuple[float, float] = (0.0, 0.0)
    gauge_offset_m: tuple[float, float] = (0.0, 0.0)
    sensor: SensorMount = SensorMount()
    second_sensor: SensorMount = SensorMount()
