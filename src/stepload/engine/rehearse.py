"""Derives the true parameters of the simulated rig for a dry run from a plan."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable
from dataclasses import replace

from stepload.contact.power_law import secant_stiffness
from stepload.contact.rough import rough_sphere
from stepload.engine.first_loading import true_deformation
from stepload.errors import BadInputError
from stepload.feasibility.preflight import Preflight
from stepload.feasibility.theory import Theory
from stepload.plan.model import Payload, SecondForceSource, Simulation, Structure
from stepload.plan.mounting import Mounting
from stepload.rig.mount import Matrix3, Matrix6, Mount, SensorMount
from stepload.rig.world import PayloadTruth, WorldFault, WorldSpec

LEAST_DAMPING_RATIO = 0.05
"""Least simulated damping ratio: a plan's C_s is a lower bound and may be 0."""
SURFACE_SHARE = 0.9
"""Share of the surface uncertainty within which the seed puts the surface."""
START_BIAS_SHARE = 0.01
"""The force sensor's reading in free air lies within ± this share of its range."""


def world_for(
    preflight: Preflight, *, seed: int | None = None, faults: Iterable[WorldFault] = ()
) -> WorldSpec:
    """The simulated rig for a plan, as its `simulation` section says.

    Args:
        preflight: of the plan, with what is believed of rig and payload.
        seed: for all random numbers; the plan's own if None. It decides the surface within its
            uncertainty, unless the plan gives a surface error other than 0.
        faults: faults to inject.

    Raises:
        BadInputError: the simulated law needs a value that the payload does not have.
        DomainError: a number outside the domain of contact theory.
    """
    plan = preflight.plan
    rig, procedure, simulation = plan.rig, plan.procedure, plan.rig.simulation
    arm, force, gauge, second = rig.arm, rig.force, rig.displacement, rig.second_force
    seed = simulation.seed if seed is None else seed
    chance = random.Random(seed)
    surface_error_m = chance.uniform(-SURFACE_SHARE, SURFACE_SHARE) * (
        procedure.surface_uncertainty_m
    )
    bias_n = chance.uniform(-START_BIAS_SHARE, START_BIAS_SHARE) * force.range_n
    if simulation.surface_error_m != 0.0:
        surface_error_m = simulation.surface_error_m
    payload = payload_truth(plan.payload, preflight.theory, simulation)
    stiffness = rig.system_stiffness.stiffness_n_per_m * simulation.stiffness_factor
    stiffness /= _drawn_aside(simulation)
    least_damping = LEAST_DAMPING_RATIO * 2.0 * math.sqrt(stiffness * arm.effective_mass_kg)
    tangent = payload.n * secant_stiffness(payload.k, payload.n, procedure.top_force_n)
    sensor = second.sensor if second.source is SecondForceSource.SENSOR else None
    return WorldSpec(
        seed=seed,
        payload=payload,
        surface_m=procedure.surface_distance_m + surface_error_m,
        arm_rate_hz=arm.rate_hz,
        system_stiffness_n_per_m=stiffness,
        system_damping_n_s_per_m=max(rig.system_stiffness.damping_n_s_per_m, least_damping),
        effective_mass_kg=arm.effective_mass_kg,
        command_delay_s=arm.command_delay_s,
        lag_s=arm.lag_s,
        lost_motion_m=arm.lost_motion_m,
        max_speed_m_s=arm.max_speed_m_s,
        max_acceleration_m_s2=arm.max_acceleration_m_s2,
        max_push_n=arm.max_push_n,
        position_quantum_m=arm.position_resolution_m,
        position_noise_m=arm.position_noise_m,
        kinematic_error_m=simulation.kinematic_error_m,
        kinematic_length_m=simulation.kinematic_length_n * (1.0 / stiffness + 1.0 / tangent),
        arm_has_force=second.source is SecondForceSource.ARM,
        arm_force_noise_n=second.noise_n,
        force_rate_hz=force.rate_hz,
        force_axis=force.axis,
        force_noise_n=force.noise_n,
        force_quantum_n=force.resolution_n,
        force_delay_s=force.delay_s,
        force_range_n=force.range_n,
        start_force_bias_n=bias_n,
        force_drift_n_per_s=simulation.force_drift_n_per_s,
        gauge_rate_hz=gauge.rate_hz if gauge else 0.0,
        gauge_quantum_m=gauge.resolution_m if gauge else 0.0,
        gauge_noise_m=gauge.noise_m if gauge else 0.0,
        faults=tuple(faults),
        second_force_rate_hz=sensor.rate_hz if sensor else 0.0,
        second_force_axis=sensor.axis if sensor else "+fz",
        second_force_noise_n=sensor.noise_n if sensor else 0.0,
        second_force_quantum_n=sensor.resolution_n if sensor else 0.0,
        second_force_delay_s=sensor.delay_s if sensor else 0.0,
        second_force_range_n=sensor.range_n if sensor else 0.0,
        drift_m_s=simulation.drift_m_s,
        slip_m=simulation.slip_m,
        softness=simulation.softness,
        softness_force_n=simulation.softness_force_n,
        lateral=simulation.lateral,
        cross_talk=simulation.cross_talk,
        sensor_quadratic=simulation.sensor_quadratic,
        sensor_cubic=simulation.sensor_cubic,
        six_components=force.components == "six" and arm.structure is Structure.ARM,
        mount=mount_of(simulation, stiffness),
    )


def _drawn_aside(simulation: Simulation) -> float:
    """Compliance of the load path over that without a lateral force.

    Raises:
        BadInputError: the lateral force would move the tip more than the load does.
    """
    factor = 1.0 + simulation.lateral * simulation.lateral_coupling
    if factor <= 0.0:
        raise BadInputError(
            f"simulation: a lateral force of {simulation.lateral:.3g} with a coupling of "
            f"{simulation.lateral_coupling:.3g} moves the tip more than the load does",
            hint="use a smaller lateral or lateral_coupling",
        )
    return factor


def payload_truth(payload: Payload, theory: Theory, simulation: Simulation) -> PayloadTruth:
    """The payload as it really is in a dry run: the believed law with K × `payload_factor`.

    Raises:
        BadInputError: the simulated law needs a value that the payload does not have.
        DomainError: a number outside the domain of contact theory.
    """
    onset_n = _yield_force(payload, theory, simulation)
    kappa, roughness_m = _asperities(payload, theory, simulation)
    words = ("rough" if roughness_m else "", "elastic_plastic" if onset_n is not None else "")
    if simulation.adhesion_n and simulation.adhesion_law == "jkr":
        _refuse_jkr(theory, rough=bool(roughness_m))
    if onset_n is None:
        onset_n = theory.elastic_limit_n
    truth = PayloadTruth(
        law="_".join(word for word in words if word) or "smooth",
        k=theory.law.k * simulation.payload_factor,
        n=theory.law.n,
        elastic_limit_n=onset_n,
        roughness_m=roughness_m,
        kappa=kappa,
        hysteresis=simulation.hysteresis,
        hard_stop_m=math.inf if simulation.stop_depth_m is None else simulation.stop_depth_m,
        stop_stiffness_n_per_m=simulation.stop_stiffness_n_per_m,
        pad_stiffness_n_per_m=simulation.pad_stiffness_n_per_m or math.inf,
        pad_depth_m=simulation.pad_depth_m,
        adhesion_n=simulation.adhesion_n,
        adhesion_law=simulation.adhesion_law,
        creep=simulation.creep,
        creep_time_s=simulation.creep_time_s,
        creep_decades=simulation.creep_decades,
    )
    if simulation.seating_m == 0.0:
        return truth
    depth_m = true_deformation(truth, simulation.seating_force_n)
    return replace(truth, seating_m=simulation.seating_m, seating_depth_m=depth_m)


def _yield_force(payload: Payload, theory: Theory, simulation: Simulation) -> float | None:
    """Force beyond which the simulated payload yields; None where it never does."""
    onset, law = theory.yield_onset if theory.law.n == 1.5 else None, simulation.law
    if simulation.yield_force_n is not None:
        if theory.law.n != 1.5:
            raise BadInputError(
                f"simulation yield_force: {payload.name!r} is no sphere or blunt tip, and (14) "
                "holds for no other",
                hint="leave yield_force out",
            )
        return simulation.yield_force_n
    if law == "elastic_plastic" and onset is None:
        raise BadInputError(
            f"simulation law elastic_plastic: theory has no elastic limit for {payload.name!r}",
            hint="give both yield strengths of a sphere or blunt tip, or a yield_force, or use "
            "law: smooth",
        )
    return onset.force_n if onset and law in ("declared", "elastic_plastic") else None


def _asperities(payload: Payload, theory: Theory, simulation: Simulation) -> tuple[float, float]:
    """κ (9) and σ_eq of the simulated payload; 0 where it is smooth."""
    roughness_m = simulation.roughness_m
    wanted = simulation.law == "rough" or bool(roughness_m)
    if roughness_m is None:
        roughness_m = payload.roughness_m
    if simulation.law not in ("declared", "rough") or not (roughness_m or wanted):
        return 0.0, 0.0
    hardness_pa = simulation.micro_hardness_pa or payload.micro_hardness_pa
    bodies = payload.geometry, payload.material, payload.plate
    sphere = None
    if roughness_m and theory.law.n == 1.5:
        sphere = rough_sphere(*bodies, roughness_m, hardness_pa)
    if sphere is None:
        if not wanted:
            return 0.0, 0.0
        raise BadInputError(
            f"simulation law rough: {payload.name!r} is no sphere or blunt tip with roughness "
            "and micro-hardness or yield strength",
            hint="give the payload's roughness and micro_hardness, or use law: smooth",
        )
    return sphere.kappa, sphere.roughness_m


def _refuse_jkr(theory: Theory, *, rough: bool) -> None:
    """Refuse JKR adhesion for a payload that is no smooth sphere.

    Raises:
        BadInputError: it is no sphere, or rough.
    """
    if theory.law.n != 1.5 or rough:
        raise BadInputError(
            "simulation adhesion_law jkr: the simulated payload is no smooth sphere or blunt tip",
            hint="use adhesion_law: dmt, or law: smooth",
        )


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
