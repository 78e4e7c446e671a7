"""Conditions and result of an identification as they follow from a plan, before any measurement."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stepload.contact.elastic import equivalent_modulus
from stepload.contact.rough import length_sigma, rough_sphere
from stepload.feasibility.stiffness import known_stiffness
from stepload.feasibility.theory import Theory
from stepload.identification.conditions import (
    ASSUMED_NONLINEARITY,
    ROUGH_LENGTH_SIGMA,
    UNKNOWN_OFFSET_M,
    Conditions,
    Sources,
)
from stepload.identification.expected import Expected, LoadSchedule, expect
from stepload.identification.fit import FloatArray
from stepload.identification.lateral_coupling import Across
from stepload.plan.model import (
    DisplacementSpec,
    Payload,
    Plan,
    Provenance,
    Rig,
    SecondForceSource,
    Structure,
    SystemStiffness,
)

if TYPE_CHECKING:
    from stepload.feasibility.load_times import LoadTimes

UNKNOWN_LAG_SIGMA_S = 1e-3
"""Standard uncertainty of the time lag where the ramps give no better one: a period at 1 kHz."""

ARM_MISALIGNMENT_RAD = math.radians(2.0)
"""Assumed angle between a sensor's axis and the press on a serial arm, where none is stated:
flange, adapter and tool, each of some tenths of a degree, and a tool frame that was taught by
hand."""


def conditions_of(plan: Plan, theory: Theory) -> Conditions:
    """The conditions of a plan, with the rig's figures."""
    rig, stiffness, wanted = plan.rig, plan.rig.system_stiffness, plan.identify
    gauge, payload = rig.displacement, plan.payload
    sources = _sources(plan, gauge)
    beside = gauge is not None and wanted.kind == "payload"
    return Conditions(
        sources=sources,
        secant_force_n=wanted.secant_force_n,
        touch_force_n=plan.procedure.touch_force_n,
        position_resolution_m=sources.position_resolution_m,
        elastic_limit_n=theory.elastic_limit_n,
        roughness_m=payload.roughness_m,
        rough_length_m=_rough_length(payload, theory),
        rough_length_sigma=_rough_length_sigma(payload),
        p=wanted.resolution_multiple_p,
        s=wanted.compensation_quality_s,
        t=wanted.accuracy_t,
        kind=wanted.kind,
        theory_k=None if theory.is_range else theory.law.k,
        theory_n=None if theory.is_range else theory.law.n,
        modulus_pa=(
            None if theory.is_range else equivalent_modulus(payload.material, payload.plate)
        ),
        plate_pa=payload.plate.youngs_modulus_pa / (1.0 - payload.plate.poisson_ratio**2),
        branch=wanted.branch,
        pose=rig.arm.pose,
        temperature_c=wanted.temperature_c,
        across=Across() if gauge or wanted.kind == "system" else across_of(stiffness),
        arm=rig.arm.structure is Structure.ARM,
        lever_m=rig.force.lever_m,
        misalignment_rad=misalignment_of(rig),
        yields_m_per_n=1.0 / stiffness.stiffness_n_per_m,
        gauge_offset_m=gauge_offset_of(rig),
        arm_sources=_sources(plan, None) if beside else None,
        second_share=_second_share(plan),
    )


def _second_share(plan: Plan) -> float | None:
    """How far the second channel's gain may differ: as stated, else what its newtons come to."""
    second = plan.rig.second_force
    if second.source is SecondForceSource.NONE:
        return None
    return second.tolerance_relative or second.tolerance_n / plan.procedure.top_force_n


def _sources(plan: Plan, gauge: DisplacementSpec | None) -> Sources:
    """The sources of the travel that a gauge measures, or the arm where it is None."""
    rig, payload, stiffness = plan.rig, plan.payload, plan.rig.system_stiffness
    smooth_m, crooked = stiffness.smooth_error_m, rig.force.nonlinearity
    known = known_stiffness(plan)
    table = None if gauge else known.table
    return Sources(
        system_stiffness_n_per_m=None if gauge else stiffness.stiffness_n_per_m,
        system_stiffness_sigma_n_per_m=0.0 if gauge else known.sigma_n_per_m,
        smooth_error_m=0.0 if gauge else stiffness.msde_m if smooth_m is None else smooth_m,
        smooth_degrees=None if gauge else stiffness.smooth_degrees,
        smooth_length_n=None if gauge else stiffness.smooth_length_n,
        force_noise_n=rig.force.noise_n,
        force_resolution_n=rig.force.resolution_n,
        position_noise_m=gauge.noise_m if gauge else rig.arm.position_noise_m,
        position_resolution_m=gauge.resolution_m if gauge else rig.arm.position_resolution_m,
        lag_sigma_s=UNKNOWN_LAG_SIGMA_S,
        gain_sigma=rig.force.gain_uncertainty,
        zero_drift_n_per_s=rig.force.drift_n_per_s,
        nonlinearity=ASSUMED_NONLINEARITY if crooked is None else crooked,
        temperature_sigma_k=plan.identify.temperature_uncertainty_k,
        position_m_per_k=payload.height_m * payload.thermal_expansion_per_k
        + (0.0 if gauge else rig.load_path_m * rig.thermal_expansion_per_k),
        modulus_per_k=payload.modulus_change_per_k,
        deflection_force_n=table.force_n if table else (),
        deflection_m=table.deflection_m if table else (),
        deflection_sigma_m=table.sigma_m if table else (),
    )


def misalignment_of(rig: Rig) -> float:
    """Largest angle in rad between the sensor's axis and the press: stated, assumed, or 0."""
    if rig.force.misalignment_rad is not None:
        return rig.force.misalignment_rad
    return ARM_MISALIGNMENT_RAD if rig.arm.structure is Structure.ARM else 0.0


def gauge_offset_of(rig: Rig) -> float:
    """Distance in m of a serial arm's gauge from the contact, stated or assumed; else 0."""
    if rig.displacement is None or rig.arm.structure is not Structure.ARM:
        return 0.0
    stated = rig.displacement.offset_m
    return UNKNOWN_OFFSET_M if stated is None else stated


def across_of(stiffness: SystemStiffness) -> Across:
    """The calibrated effect of lateral force; empty where the calibration record is not valid.

    A K_s that a person states is for a press without lateral force.
    """
    if stiffness.record is None:
        if stiffness.provenance is Provenance.INDICATIVE:
            return Across()
        return Across(at_share=(0.0, 0.0), stated=True)
    if stiffness.validity_problem:
        return Across()
    return Across(
        _pair(stiffness.across_m_per_n),
        _pair(stiffness.across_sigma_m_per_n) or (0.0, 0.0),
        stiffness.across_correlation,
        _pair(stiffness.at_share),
        stiffness.share_reach,
    )


def _pair(values: tuple[float, ...]) -> tuple[float, float] | None:
    return values if len(values) == 2 else None


def _rough_length(payload: Payload, theory: Theory) -> float | None:
    """1.22 σ κ^-0.16 (11) in m; 0 where the plan says smooth, None where it does not say enough."""
    if payload.roughness_m == 0.0:
        return 0.0
    if payload.roughness_m is None or theory.is_range:
        return None
    sphere = rough_sphere(
        payload.geometry, payload.material, payload.plate, payload.roughness_m,
        payload.micro_hardness_pa,
    )  # fmt: skip
    return None if sphere is None else sphere.scale_m


def _rough_length_sigma(payload: Payload) -> float:
    """Its relative uncertainty: what the stated ± of roughness and micro-hardness come to, or the
    least that such a length counts to be known within."""
    stated = length_sigma(
        _share(payload.roughness_sigma_m, payload.roughness_m),
        _share(payload.micro_hardness_sigma_pa, payload.micro_hardness_pa),
    )
    return max(stated, ROUGH_LENGTH_SIGMA)


def _share(sigma: float | None, value: float | None) -> float:
    return sigma / value if sigma and value else 0.0


def expected_result(plan: Plan, theory: Theory, loading_times: LoadTimes | None) -> Expected:
    """The run of a plan by theory's stiffest law, and its chord with the interval to be expected.

    Args:
        loading_times: times of its ramps; None: at the load rate.

    Raises:
        DomainError: there is no contact law, or no loading, to predict from.
    """
    schedule = schedule_of(plan, plan.procedure.levels_n)
    if loading_times is not None:
        schedule = replace(schedule, up_s=loading_times.up_s, down_s=loading_times.down_s)
    return expect(conditions_of(plan, theory), schedule, each_of(theory.stiffest.deformation))


def schedule_of(plan: Plan, levels_n: tuple[float, ...]) -> LoadSchedule:
    """A plan's loading through these levels."""
    procedure = plan.procedure
    from_n = min(procedure.touch_force_n, 0.5 * levels_n[0])
    ramps_s = np.diff([from_n, *levels_n]) / procedure.load_rate_n_per_s
    return LoadSchedule(
        np.array(levels_n), from_n, ramps_s.tolist(), ramps_s[1:].tolist(), procedure.hold_s,
        procedure.cycles,
    )  # fmt: skip


def each_of(deformation: Callable[[float], float]) -> Callable[[FloatArray], FloatArray]:
    """A law of one force as a law of forces (N,), each different one computed once."""

    def at(force_n: FloatArray) -> FloatArray:
        forces_n, places = np.unique(force_n, return_inverse=True)
        return np.array([deformation(each) for each in forces_n])[places]

    return at
