"""Random rigs and payloads of both arm classes, as the runner believes them.

The template plan gives the order of the run and its times; every figure of rig, payload and force
is drawn here. `stepload_verify.campaign.truth` draws the true properties of the simulated rig.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from random import Random

from stepload.contact.elastic import equivalent_modulus, law_for, profile_constant
from stepload.contact.materials import FlatPunch, Geometry, Material, PowerProfile
from stepload.errors import RefusedError
from stepload.feasibility.preflight import Preflight, derive
from stepload.plan.model import (
    ArmSpec,
    DisplacementSpec,
    ForceSpec,
    Payload,
    Plan,
    Provenance,
    Rig,
    SecondForce,
    SecondForceSource,
    Simulation,
    Structure,
    SystemStiffness,
)

ARM_CLASSES = ("UR", "STVF")
STVF_STIFFNESS_N_PER_M = 3.49e6
SECANT_N_PER_M = (1e4, 1e8)
"""Range of the payload's secant stiffness at the top force."""
LONGEST_TRAVEL_M = 3e-3
"""Payloads softer than this at the top force are left out: their runs last too long."""
RAMP_S = (0.05, 1.0)
"""Range of the time in which a load step is applied."""
GAUGE_SHARE = 0.05
FARTHEST = 4.0
"""Largest distance of a surface over that of the template."""
RETRACT_M = 1e-4
RETRACT_OVER_TRAVEL = 1.3
"""Retract, and its share of the travel where that is more: little free air, which costs time."""
DRIFT_N_PER_S = 0.005
MOST_IN_COMMON = 0.05
"""Largest error that a plan states both force channels to have in common."""

_SIM = "sim"
_PAYLOAD = Material("payload", 70e9, 0.33)
_PLATE = Material("plate", 200e9, 0.29)
_ATTEMPTS = 200


def log_uniform(chance: Random, low: float, high: float) -> float:
    """A number between two positive ones, evenly spread over its logarithm."""
    return math.exp(chance.uniform(math.log(low), math.log(high)))


def _arm(chance: Random, ur: bool) -> ArmSpec:
    u = chance.uniform
    if ur:
        return ArmSpec(
            driver=_SIM, rate_hz=500.0, max_speed_m_s=u(0.05, 0.25),
            max_acceleration_m_s2=u(0.8, 2.0), max_push_n=u(150.0, 700.0),
            effective_mass_kg=u(2.0, 8.0), command_delay_s=u(0.002, 0.010), lag_s=u(0.010, 0.040),
            lost_motion_m=u(0.0, 10e-6),
            position_resolution_m=log_uniform(chance, 5e-6, 30e-6),
            position_noise_m=u(1e-6, 5e-6), model_tolerance_m=100e-6, pose="",
            structure=Structure.MACHINE,  # the drawn worlds have one axis
        )  # fmt: skip
    return ArmSpec(
        driver=_SIM, rate_hz=1000.0, max_speed_m_s=u(0.005, 0.05),
        max_acceleration_m_s2=u(0.5, 2.0), max_push_n=u(1000.0, 5000.0),
        effective_mass_kg=log_uniform(chance, 5.0, 60.0), command_delay_s=u(0.001, 0.003),
        lag_s=u(0.001, 0.004), lost_motion_m=u(0.0, 1e-6),
        position_resolution_m=log_uniform(chance, 0.5e-6, 2e-6), position_noise_m=u(1e-7, 3e-7),
        model_tolerance_m=50e-6, pose="", structure=Structure.MACHINE,
    )  # fmt: skip


def _force(chance: Random, ur: bool, range_n: float) -> ForceSpec:
    u = chance.uniform
    noise_n = log_uniform(chance, 0.03, 0.3) if ur else u(0.1, 0.6)
    resolution_n = u(0.0, 0.1) if ur else noise_n * u(0.05, 3.0)
    return ForceSpec(
        driver=_SIM, axis=chance.choice(("+fz", "-fz")),
        rate_hz=chance.choice((500.0, 1000.0)) if ur else 1000.0, range_n=range_n,
        resolution_n=resolution_n, noise_n=noise_n, delay_s=u(0.001, 0.004) if ur else 0.001,
        gain_uncertainty=0.01, drift_n_per_s=DRIFT_N_PER_S,
    )  # fmt: skip


def _second(
    chance: Random, ur: bool, range_n: float, source: SecondForceSource | None
) -> SecondForce:
    u = chance.uniform
    if source is SecondForceSource.NONE:
        return SecondForce(SecondForceSource.NONE, 0.0, 0.0, 0.0, 0.0)
    relative = u(0.02, 0.05)
    from_arm = chance.random() < 0.5
    if source is not None:
        from_arm = source is SecondForceSource.ARM
    if from_arm:
        tolerance_n, noise_n = (u(8.0, 14.0), u(0.5, 1.5)) if ur else (u(3.0, 11.0), u(0.3, 1.2))
        return SecondForce(
            SecondForceSource.ARM, tolerance_n, relative, 0.02, noise_n, zero_error_n=0.0
        )
    noise_n = u(0.05, 0.3)
    sensor = ForceSpec(
        driver=_SIM, axis="+fz", rate_hz=chance.choice((500.0, 1000.0)), range_n=range_n,
        resolution_n=u(0.0, 0.3), noise_n=noise_n, delay_s=u(0.001, 0.004),
        gain_uncertainty=0.0, drift_n_per_s=DRIFT_N_PER_S,
    )  # fmt: skip
    return SecondForce(
        SecondForceSource.SENSOR, u(2.0, 5.0), relative, 0.02, noise_n, sensor, 0.0
    )  # fmt: skip


def _stiffness(chance: Random, ur: bool, mass_kg: float) -> SystemStiffness:
    value = log_uniform(chance, 4e4, 2.5e5) if ur else STVF_STIFFNESS_N_PER_M
    ratio = log_uniform(chance, 0.05, 0.5) if ur else log_uniform(chance, 0.1, 2.5)
    return SystemStiffness(
        stiffness_n_per_m=value,
        sigma_n_per_m=value * chance.uniform(0.005, 0.05),
        msde_m=1e-6,
        damping_n_s_per_m=ratio * 2.0 * math.sqrt(value * mass_kg),
        provenance=Provenance.MEASURED,
    )


def geometry_for(k: float, n: float) -> Geometry:
    """A geometry whose smooth law (3), (5) has this K and n, 1 or from 1.1 on, in our materials."""
    modulus = equivalent_modulus(_PAYLOAD, _PLATE)
    if n == 1.0:
        return FlatPunch(k / (2.0 * modulus))
    m = 1.0 / (n - 1.0)
    log_b = m * math.log(2.0 * m / (m + 1.0) * modulus / k) - math.log(profile_constant(m))
    return PowerProfile(m, math.exp(log_b))


def _payload(chance: Random, top_n: float, elastic_limit_n: float) -> Payload:
    n = chance.choice((1.0, 1.5, 2.0, round(chance.uniform(1.1, 3.0), 3)))
    softest = max(SECANT_N_PER_M[0], top_n / LONGEST_TRAVEL_M)
    secant = log_uniform(chance, softest, SECANT_N_PER_M[1])
    k = secant**n / top_n ** (n - 1.0)
    geometry = geometry_for(k, n)
    return Payload("campaign", geometry, _PAYLOAD, _PLATE, None, None, elastic_limit_n)


def travel_to(rig: Rig, payload: Payload, force_n: float) -> float:
    """Travel from the surface to a force, as the plan believes it."""
    law = law_for(payload.geometry, payload.material, payload.plate)
    stiffness = rig.system_stiffness.stiffness_n_per_m
    return force_n / stiffness + law.deformation(force_n) + rig.arm.lost_motion_m


def _rig(
    chance: Random, arm_class: str, source: SecondForceSource | None, elastic_limit_n: float
) -> Rig:
    ur = arm_class == "UR"
    arm = _arm(chance, ur)
    range_n = max(100.0, elastic_limit_n * chance.uniform(0.6, 3.0))
    gauge = None
    if chance.random() < GAUGE_SHARE:
        gauge = DisplacementSpec(driver=_SIM, rate_hz=100.0, resolution_m=1e-7, noise_m=2e-8)
    return Rig(
        name=arm_class,
        arm=arm,
        force=_force(chance, ur, range_n),
        displacement=gauge,
        second_force=_second(chance, ur, range_n, source),
        system_stiffness=_stiffness(chance, ur, arm.effective_mass_kg),
        loop_delay_s=None,
        common_force_error=chance.uniform(0.0, MOST_IN_COMMON),
        mechanical_fuse_n=None,
        simulation=Simulation(0, "smooth", 1.0, 1.0, 0.0, 0.0, 0.0, 50.0, 0.0),
    )


def plan_from(
    chance: Random, template: Plan, arm_class: str, source: SecondForceSource | None
) -> Plan | None:
    """The plan as the runner believes it; None where the drawn figures leave no room to press.

    Args:
        chance: random source of the figures.
        template: order, times and distances.
        arm_class: one of `ARM_CLASSES`.
        source: of the second force channel; drawn if None.
    """
    low, high = (15.0, 600.0) if arm_class == "UR" else (60.0, 3000.0)
    elastic_limit_n = log_uniform(chance, low, high)
    rig = _rig(chance, arm_class, source, elastic_limit_n)
    second, force = rig.second_force, rig.force
    drift_n = max(1.0, 3.0 * force.resolution_n)
    room_n = (elastic_limit_n - second.tolerance_n - drift_n) / (1.0 + second.tolerance_relative)
    room_n /= 1.0 + rig.common_force_error
    room_n = min(room_n, 0.95 * force.range_n, rig.arm.max_push_n) - 8.0 * force.noise_n - 0.5
    top_n = chance.uniform(0.3, 1.0) * room_n
    if top_n <= 5.0:
        return None
    drift_n = max(drift_n, 0.01 * top_n)
    count = len(template.procedure.levels_n)
    touch_n = max(0.01 * top_n, 1.0, 2.0 * force.resolution_n, 6.0 * force.noise_n)
    payload = _payload(chance, top_n, elastic_limit_n)
    travel_m, touch_m = (travel_to(rig, payload, force_n) for force_n in (top_n, touch_n))
    farther = log_uniform(chance, 1.0, FARTHEST)
    uncertainty_m = farther * template.procedure.surface_uncertainty_m
    procedure = replace(
        template.procedure,
        step_n=top_n / count,
        top_force_n=top_n,
        levels_n=tuple(top_n * (i + 1) / count for i in range(count)),
        load_rate_n_per_s=top_n / count / log_uniform(chance, *RAMP_S),
        touch_force_n=touch_n,
        surface_distance_m=farther * template.procedure.surface_distance_m,
        surface_uncertainty_m=uncertainty_m,
        search_distance_m=3.0 * uncertainty_m + 2.0 * touch_m,
        retract_m=max(RETRACT_M, RETRACT_OVER_TRAVEL * travel_m),
        max_drift_n=drift_n,
    )
    if procedure.touch_force_n >= procedure.levels_n[0]:
        return None
    identify = replace(template.identify, secant_force_n=top_n)
    return replace(template, payload=payload, rig=rig, procedure=procedure, identify=identify)


def draw_plan(
    chance: Random,
    template: Plan,
    arm_class: str,
    two_channels: bool,
    told: Callable[[Plan], Plan] = lambda plan: plan,
    fits: Callable[[Preflight], bool] = lambda _: True,
) -> Preflight:
    """The preflight of a plan that leaves room to press.

    Args:
        chance, template, arm_class: see `plan_from`.
        two_channels: whether there is a second force channel.
        told: adds further statements of the rig file to the plan.
        fits: whether a preflight is acceptable.

    Raises:
        RefusedError: none was found.
    """
    source = None if two_channels else SecondForceSource.NONE
    for _ in range(_ATTEMPTS):
        plan = plan_from(chance, template, arm_class, source)
        if plan is None:
            continue
        preflight = derive(told(plan))
        if preflight.limits is not None and fits(preflight):
            return preflight
    raise RefusedError("no plant with room to press was found", hint="look at the template plan")
