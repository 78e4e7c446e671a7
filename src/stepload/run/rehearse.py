"""From a plan to the hidden truth of the simulated rig on which it is rehearsed."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable

from stepload.contact import plastic, power_law
from stepload.contact.elastic import equivalent_modulus, equivalent_radius
from stepload.contact.rough import RoughSphere, roughness_number
from stepload.envelope.envelope import Envelope
from stepload.envelope.theory import Theory
from stepload.errors import BadInputError
from stepload.plan.model import Payload, SecondForceSource, Simulation
from stepload.rig.world import PayloadTruth, WorldFault, WorldSpec

LEAST_DAMPING_RATIO = 0.05
"""A plan's C_s is a lower bound and may be 0; no machine rings for ever."""
SURFACE_SHARE = 0.9
"""Share of the surface uncertainty within which the seed puts the surface."""
START_BIAS_SHARE = 0.01
"""The force sensor's reading in free air lies within ± this share of its range."""


def world_for(
    envelope: Envelope, *, seed: int | None = None, faults: Iterable[WorldFault] = ()
) -> WorldSpec:
    """The simulated rig for a plan, as its `simulation` section says.

    Args:
        envelope: what is believed.
        seed: everything random; the plan's own if None. It decides the surface within its
            uncertainty, unless the plan gives a surface error other than 0.
        faults: what goes wrong on the way.

    Raises:
        BadInputError: the simulated law needs what the payload does not tell.
        DomainError: a number outside the domain of contact theory.
    """
    plan = envelope.plan
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
    payload = payload_truth(plan.payload, envelope.theory, simulation)
    stiffness = rig.system_stiffness.stiffness_n_per_m * simulation.stiffness_factor
    least_damping = LEAST_DAMPING_RATIO * 2.0 * math.sqrt(stiffness * arm.effective_mass_kg)
    tangent = power_law.tangent_stiffness(payload.k, payload.n, procedure.top_force_n)
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
    )


def payload_truth(payload: Payload, theory: Theory, simulation: Simulation) -> PayloadTruth:
    """The payload as it really is in a dry run: the believed law with K × `payload_factor`.

    Raises:
        BadInputError: the simulated law needs what the payload does not tell.
        DomainError: a number outside the domain of contact theory.
    """
    law, limit = theory.law, theory.yield_onset
    limits_n = [limit.force_n] if limit else []
    roughness_m = kappa = 0.0
    if simulation.law == "elastic_plastic":
        if limit is None:
            raise BadInputError(
                f"simulation law elastic_plastic: theory has no elastic limit for {payload.name!r}",
                hint="give both yield strengths of a sphere or blunt tip, or use law: smooth",
            )
    elif payload.declared_force_limit_n is not None:
        limits_n.append(payload.declared_force_limit_n)
    if simulation.law == "rough":
        radius_m = equivalent_radius(payload.geometry)
        hardness_pa = payload.micro_hardness_pa
        if radius_m is None or hardness_pa is None or not payload.roughness_m:
            raise BadInputError(
                f"simulation law rough: {payload.name!r} is no sphere or blunt tip with roughness "
                "and micro-hardness",
                hint="give the payload's roughness and micro_hardness, or use law: smooth",
            )
        roughness_m = payload.roughness_m
        modulus_pa = equivalent_modulus(payload.material, payload.plate)
        kappa = roughness_number(modulus_pa, hardness_pa, radius_m, roughness_m)
    return PayloadTruth(
        law=simulation.law,
        k=law.k * simulation.payload_factor,
        n=law.n,
        elastic_limit_n=min(limits_n, default=math.inf),
        roughness_m=roughness_m,
        kappa=kappa,
        hysteresis=simulation.hysteresis,
        hard_stop_m=math.inf,
    )


def true_secant(payload: PayloadTruth, force_n: float) -> float:
    """Secant stiffness F/δ in N/m of the simulated payload at `force_n`, on first loading.

    Raises:
        DomainError: `force_n` is not positive, or outside the law.
    """
    if payload.law == "rough":
        rough = RoughSphere(payload.k, payload.roughness_m, payload.kappa)
        return force_n / rough.deformation(force_n).value
    if payload.law == "elastic_plastic":
        sphere = plastic.ElasticPlasticSphere.from_law(payload.k, payload.elastic_limit_n)
        return force_n / sphere.continuous_deformation(force_n).value
    return power_law.secant_stiffness(payload.k, payload.n, force_n)
