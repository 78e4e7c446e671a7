"""True properties of a simulated rig: as planned, within honest tolerances, or with anomalies."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from random import Random

from stepload.engine.rehearse import world_for
from stepload.envelope.envelope import Envelope
from stepload.plan.model import Plan
from stepload.rig.world import WorldSpec
from stepload_verify.campaign.plants import log_uniform

ANOMALIES = ("K x 10", "K / 10", "surface too near", "hidden hard stop", "K_s wrong by 30 %")
"""Ways in which a plant may differ from its plan."""
WIDER_ANOMALIES = ("mass wrong", "filters not declared")
"""Ways beyond the claim of the campaign: a tenth to ten times the mass, 5 to 20 ms more delay."""
SIX_ANOMALIES = (
    "stuck stiffer than stated", "dragged sideways", "plate tilted", "touched off centre",
)  # fmt: skip
"""Anomalies of a rig with six axes: factor of the stuck ratio, share, rad, m."""
ALL_ANOMALIES = (*ANOMALIES, *WIDER_ANOMALIES, *SIX_ANOMALIES)
NEAREST_SHARE = 0.05
"""A surface that is too near lies between this share of its stated distance and the near edge."""
PLASTIC_SHARE = 0.3
PAYLOAD_SPREAD = 0.3
"""Standard deviation of ln K of a sound plant about its plan: a payload is not known before."""


@dataclass(frozen=True, slots=True)
class Anomaly:
    """One of `ALL_ANOMALIES`.

    `value` is a factor, a surface error in m, a share of the depth, or a delay in s.
    """

    kind: str
    value: float


def draw_anomaly(chance: Random, plan: Plan, kinds: tuple[str, ...] = ANOMALIES) -> Anomaly:
    """One way in which the plant differs from the plan."""
    return anomaly_of(chance.choice(kinds), chance, plan)


def anomaly_of(kind: str, chance: Random, plan: Plan) -> Anomaly:
    """This way of differing from the plan."""
    procedure = plan.procedure
    if kind == "mass wrong":
        return Anomaly(kind, log_uniform(chance, 0.1, 10.0))
    if kind == "filters not declared":
        return Anomaly(kind, chance.uniform(0.005, 0.02))
    if kind == "K x 10":
        return Anomaly(kind, 10.0)
    if kind == "K / 10":
        return Anomaly(kind, 0.1)
    if kind == "K_s wrong by 30 %":
        return Anomaly(kind, chance.choice((0.7, 1.3)))
    if kind == "stuck stiffer than stated":
        return Anomaly(kind, chance.uniform(1.1, 2.0))
    if kind == "dragged sideways":
        return Anomaly(kind, chance.uniform(0.32, 0.6))
    if kind == "plate tilted":
        return Anomaly(kind, math.radians(chance.uniform(4.0, 10.0)))
    if kind == "touched off centre":
        return Anomaly(kind, chance.uniform(12e-3, 30e-3))
    if kind == "surface too near":
        surface_m = chance.uniform(
            NEAREST_SHARE * procedure.surface_distance_m,
            procedure.surface_distance_m - procedure.surface_uncertainty_m,
        )
        return Anomaly(kind, surface_m - procedure.surface_distance_m)
    return Anomaly(kind, chance.uniform(0.02, 1.0))


def draw_truth(
    chance: Random, envelope: Envelope, anomalies: tuple[Anomaly, ...], seed: int
) -> WorldSpec:
    """The hidden truth of a plant, without faults.

    A sound plant has its K_s within two standard uncertainties, its K within a factor of two, its
    surface within its uncertainty; and hysteresis, plastic flow below F_c, position errors, drift.
    """
    plan = envelope.plan
    arm, stiffness = plan.rig.arm, plan.rig.system_stiffness
    sigma = stiffness.sigma_n_per_m / stiffness.stiffness_n_per_m
    values = {anomaly.kind: anomaly.value for anomaly in anomalies}
    payload_factor = math.exp(_clipped(chance, PAYLOAD_SPREAD))
    stiffness_factor = 1.0 + _clipped(chance, sigma)
    simulation = replace(
        plan.rig.simulation,
        payload_factor=payload_factor * values.get("K x 10", 1.0) * values.get("K / 10", 1.0),
        stiffness_factor=values.get("K_s wrong by 30 %", stiffness_factor),
        surface_error_m=values.get("surface too near", 0.0),
        hysteresis=chance.uniform(0.0, 0.1),
        kinematic_error_m=chance.uniform(0.0, 0.5 * arm.position_resolution_m),
        kinematic_length_n=log_uniform(chance, 10.0, 50.0),
        force_drift_n_per_s=chance.uniform(-0.005, 0.005),
    )
    believed = replace(plan, rig=replace(plan.rig, simulation=simulation))
    spec = world_for(replace(envelope, plan=believed), seed=seed)
    late_s = values.get("filters not declared", 0.0)
    spec = replace(
        spec,
        effective_mass_kg=spec.effective_mass_kg * values.get("mass wrong", 1.0),
        force_delay_s=spec.force_delay_s + late_s,
        second_force_delay_s=spec.second_force_delay_s + late_s,
    )
    payload = spec.payload
    if payload.n == 1.5 and chance.random() < PLASTIC_SHARE:
        onset_n = payload.elastic_limit_n * chance.uniform(0.2, 1.0)
        payload = replace(payload, law="elastic_plastic", elastic_limit_n=onset_n)
    if "hidden hard stop" in values:
        top_m = (plan.procedure.top_force_n / payload.k) ** (1.0 / payload.n)
        payload = replace(payload, hard_stop_m=values["hidden hard stop"] * top_m)
    return replace(spec, payload=payload)


def _clipped(chance: Random, sigma: float) -> float:
    """A normal deviate within two standard deviations."""
    return max(-2.0, min(2.0, chance.gauss(0.0, 1.0))) * sigma
