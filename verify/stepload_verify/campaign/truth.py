"""True properties of a simulated rig: as planned, within honest tolerances, or with anomalies."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from random import Random

from stepload.engine.rehearse import world_for
from stepload.feasibility.preflight import Preflight
from stepload.plan.model import Plan
from stepload.rig.world import WorldSpec
from stepload_verify.campaign.plants import log_uniform

MISTAKES: dict[str, str] = {
    "surface_nearer": "the surface is nearer than the plan says",
    "surface_farther": "the surface is farther than the plan says",
    "payload_stiffer": "the payload is 5 to 30 times stiffer than the plan says",
    "payload_softer": "the payload is 5 to 30 times softer than the plan says",
    "stiffness_wrong": "K_s is 0.3 to 3 times that of the plan",
    "mass_wrong": "the effective mass is 0.1 to 10 times that of the plan",
    "delays_not_stated": "both force channels are 5 to 20 ms later than the plan says",
}
"""What a plan states wrongly of its rig or payload, each with one line of help."""
SIX_MISTAKES: dict[str, str] = {
    "stuck_stiffer": "a tip that sticks is 1.1 to 2 times stiffer than the plan says",
    "dragged_aside": "a load moves the tip sideways by 0.32 to 0.6 of the force",
    "plate_tilted": "the plate is tilted by 4 to 10 deg",
    "off_centre": "the plate is touched 12 to 30 mm beside the axis",
    "wrong_lever": "the sensor sits up to 60 mm nearer or farther than the plan says",
}
"""The same of a rig with six axes."""
RIGID_STOP, OTHER_PAYLOAD = "rigid_stop", "other_payload"
BESIDE_SHARE = 0.3
"""Share of the runs with each of these beside their fault: a hidden rigid stop; a payload that is
a tenth to ten times as stiff as the plan says."""
NEAREST_SHARE = 0.05
"""A surface that is too near lies between this share of its stated distance and the near edge."""
PLASTIC_SHARE = 0.3
PAYLOAD_SPREAD = 0.3
"""Standard deviation of ln K of a sound plant about its plan: a payload is not known before."""


@dataclass(frozen=True, slots=True)
class Anomaly:
    """A way in which the plant differs from its plan.

    `value` is a factor, an error or a length in m, a share of the depth, an angle in rad, or a
    delay in s.
    """

    kind: str
    value: float


def mistake_of(kind: str, chance: Random, plan: Plan) -> Anomaly:
    """A mistake of this kind; its draw reads up to two numbers."""
    procedure, u = plan.procedure, chance.uniform
    surface_m, error_m = procedure.surface_distance_m, procedure.surface_uncertainty_m
    if kind == "surface_nearer":
        return Anomaly(kind, u(NEAREST_SHARE * surface_m, surface_m - error_m) - surface_m)
    if kind == "surface_farther":
        return Anomaly(kind, u(error_m, 1.5 * procedure.search_distance_m))
    if kind == "payload_stiffer":
        return Anomaly(kind, log_uniform(chance, 5.0, 30.0))
    if kind == "payload_softer":
        return Anomaly(kind, 1.0 / log_uniform(chance, 5.0, 30.0))
    if kind == "stiffness_wrong":
        return Anomaly(kind, log_uniform(chance, 0.3, 3.0))
    if kind == "mass_wrong":
        return Anomaly(kind, log_uniform(chance, 0.1, 10.0))
    if kind == "delays_not_stated":
        return Anomaly(kind, u(0.005, 0.02))
    if kind == "stuck_stiffer":
        return Anomaly(kind, u(1.1, 2.0))
    if kind == "dragged_aside":
        return Anomaly(kind, u(0.32, 0.6))
    if kind == "plate_tilted":
        return Anomaly(kind, math.radians(u(4.0, 10.0)))
    if kind == "off_centre":
        return Anomaly(kind, u(12e-3, 30e-3))
    assert kind == "wrong_lever", kind
    return Anomaly(kind, u(-60e-3, 60e-3))


def draw_beside(chance: Random) -> tuple[Anomaly, ...]:
    """What a run may have beside its fault; reads three numbers."""
    which, share, factor = (
        chance.random(),
        chance.uniform(0.02, 1.0),
        log_uniform(chance, 0.1, 10.0),
    )
    if which < BESIDE_SHARE:
        return (Anomaly(RIGID_STOP, share),)
    if which > 1.0 - BESIDE_SHARE:
        return (Anomaly(OTHER_PAYLOAD, factor),)
    return ()


def draw_truth(
    chance: Random, preflight: Preflight, anomalies: tuple[Anomaly, ...], seed: int
) -> WorldSpec:
    """The hidden truth of a plant, without faults.

    A sound plant has its K_s within two standard uncertainties, its K within a factor of two, its
    surface within its uncertainty; and hysteresis, plastic flow below F_c, position errors, drift.
    """
    plan = preflight.plan
    arm, stiffness = plan.rig.arm, plan.rig.system_stiffness
    sigma = stiffness.sigma_n_per_m / stiffness.stiffness_n_per_m
    values = {anomaly.kind: anomaly.value for anomaly in anomalies}
    payload_factor = math.exp(_clipped(chance, PAYLOAD_SPREAD))
    for kind in ("payload_stiffer", "payload_softer", OTHER_PAYLOAD):
        payload_factor *= values.get(kind, 1.0)
    stiffness_factor = 1.0 + _clipped(chance, sigma)
    simulation = replace(
        plan.rig.simulation,
        payload_factor=payload_factor,
        stiffness_factor=values.get("stiffness_wrong", stiffness_factor),
        surface_error_m=values.get("surface_nearer", values.get("surface_farther", 0.0)),
        hysteresis=chance.uniform(0.0, 0.1),
        kinematic_error_m=chance.uniform(0.0, 0.5 * arm.position_resolution_m),
        kinematic_length_n=log_uniform(chance, 10.0, 50.0),
        force_drift_n_per_s=chance.uniform(-1.0, 1.0) * plan.rig.force.drift_n_per_s,
    )
    expected = replace(plan, rig=replace(plan.rig, simulation=simulation))
    spec = world_for(replace(preflight, plan=expected), seed=seed)
    late_s = values.get("delays_not_stated", 0.0)
    spec = replace(
        spec,
        effective_mass_kg=spec.effective_mass_kg * values.get("mass_wrong", 1.0),
        force_delay_s=spec.force_delay_s + late_s,
        second_force_delay_s=spec.second_force_delay_s + late_s,
    )
    payload = spec.payload
    if payload.n == 1.5 and chance.random() < PLASTIC_SHARE:
        onset_n = payload.elastic_limit_n * chance.uniform(0.2, 1.0)
        payload = replace(payload, law="elastic_plastic", elastic_limit_n=onset_n)
    if RIGID_STOP in values:
        top_m = (plan.procedure.top_force_n / payload.k) ** (1.0 / payload.n)
        payload = replace(payload, hard_stop_m=values[RIGID_STOP] * top_m)
    return replace(spec, payload=payload)


def _clipped(chance: Random, sigma: float) -> float:
    """A normal deviate within two standard deviations."""
    return max(-2.0, min(2.0, chance.gauss(0.0, 1.0))) * sigma
