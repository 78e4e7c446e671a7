"""Derives the mount of the simulated rig in six axes from the plan's `simulation.mount`."""

from __future__ import annotations

import math
from dataclasses import replace

from stepload.errors import BadInputError
from stepload.plan.model import Simulation
from stepload.plan.mounting import Mounting
from stepload.rig.mount import Matrix3, Matrix6, Mount, SensorMount


def mount_of(simulation: Simulation, stiffness_n_per_m: float) -> Mount | None:
    """The mount of a simulated rig whose tip, without friction, has this stiffness.

    Raises:
        BadInputError: a compliance that is not positive definite, an effect that is stated twice,
            or a kinetic friction above the static one.
    """
    told = simulation.mount
    if told is None:
        return None
    if simulation.lateral or simulation.cross_talk:
        raise BadInputError(
            "simulation: lateral and cross_talk are of a rig with one axis, and this one has a "
            "mount",
            hint="leave them out; friction and coupling of the mount give the lateral force, "
            "mount.cross_talk what the sensor makes of it",
        )
    left = told.lateral_compliance - told.coupling_x**2
    if left <= 0.0:
        raise BadInputError(
            f"simulation.mount: a coupling of {told.coupling_x:.3g} with a lateral compliance of "
            f"{told.lateral_compliance:g} is a tip that gives energy away",
            hint="the square of the coupling must be below lateral_compliance",
        )
    kinetic = told.friction if told.friction_kinetic is None else told.friction_kinetic
    if kinetic > told.friction:
        raise BadInputError(
            f"simulation.mount: friction_kinetic {kinetic:g} is above friction {told.friction:g}",
            hint="what slides is held back less than what sticks",
        )
    sensor = _sensor(told)
    return Mount(
        compliance_m_per_n=_compliance(told, 1.0 / stiffness_n_per_m),
        turn_rad_per_n=(
            (0.0, 0.0, 0.0),
            (told.turn_rad_per_n, 0.0, told.turn_rad_per_n),
            (0.0, 0.0, 0.0),
        ),
        friction_static=told.friction,
        friction_kinetic=kinetic,
        tangential_ratio=told.tangential_ratio,
        plate_tilt_rad=(told.tilt_x_rad, told.tilt_y_rad),
        gauge_offset_m=(told.gauge_offset_x_m, 0.0),
        sensor=sensor,
        second_sensor=replace(sensor, rotation_rad=(0.0, 0.0, 0.0), cross_talk=None),
    )


def _compliance(told: Mounting, along: float) -> Matrix3:
    across, x = told.lateral_compliance * along, told.coupling_x * along
    return (across, 0.0, x), (0.0, across, 0.0), (x, 0.0, along)


def _sensor(told: Mounting) -> SensorMount:
    return SensorMount(
        rotation_rad=(told.sensor_turn_x_rad, 0.0, told.sensor_turn_z_rad),
        lever_m=(told.eccentricity_x_m, told.eccentricity_y_m, told.sensor_lever_m),
        cross_talk=_cross_talk(told.cross_talk) if told.cross_talk else None,
        torque_noise_nm=told.torque_noise_n_m,
        torque_quantum_nm=0.0,
        torque_range_nm=math.inf,
    )


def _cross_talk(share: float) -> Matrix6:
    """Cross-talk: each force picks up this share of the other two, each torque likewise."""

    def row(i: int) -> tuple[float, float, float, float, float, float]:
        a, b, c, d, e, f = (share if i // 3 == j // 3 and i != j else 0.0 for j in range(6))
        return a, b, c, d, e, f

    return tuple(row(i) for i in range(6))
