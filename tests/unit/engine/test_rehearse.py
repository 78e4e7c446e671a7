"""What a plan's simulated rig is made of."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stepload.contact.materials import FlatPunch, Material, Sphere
from stepload.engine.first_loading import true_deformation
from stepload.engine.rehearse import payload_truth, world_for
from stepload.feasibility.preflight import derive
from stepload.feasibility.theory import theory_of
from stepload.plan.model import (
    ArmSpec,
    DisplacementSpec,
    ForceSpec,
    IdentifyPlan,
    Payload,
    Plan,
    Procedure,
    Provenance,
    RecordPlan,
    Rig,
    SecondForce,
    SecondForceSource,
    Simulation,
    SystemStiffness,
)
from stepload.rig.world import PayloadTruth, WorldFault, WorldSpec, load_world

SIM = "sim"
FORCE = ForceSpec(
    driver=SIM,
    axis="-fz",
    rate_hz=1000.0,
    range_n=1000.0,
    resolution_n=0.05,
    noise_n=0.3,
    delay_s=0.001,
    gain_uncertainty=0.005,
    drift_n_per_s=0.0,
)
SIMULATION = Simulation(7, "smooth", 1.0, 1.0, 0.0, 0.0, 0.0, 50.0, 0.0)
PLAN = Plan(
    stepload=1,
    name="sphere",
    path=Path("plan.yaml"),
    payload=Payload(
        name="sphere",
        geometry=Sphere(28.7e-3),
        material=Material("acetal", 2.75e9, 0.3, 70e6),
        plate=Material("aluminium", 70e9, 0.33, 276e6),
        roughness_m=7.5e-6,
        micro_hardness_pa=7e8,
        declared_force_limit_n=500.0,
    ),
    rig=Rig(
        name="stvf",
        arm=ArmSpec(
            driver=SIM,
            rate_hz=1000.0,
            max_speed_m_s=0.05,
            max_acceleration_m_s2=2.0,
            max_push_n=2000.0,
            effective_mass_kg=20.0,
            command_delay_s=0.003,
            lag_s=0.004,
            lost_motion_m=1e-6,
            position_resolution_m=2e-6,
            position_noise_m=3e-7,
            model_tolerance_m=50e-6,
            pose="vertical",
        ),
        force=FORCE,
        displacement=None,
        second_force=SecondForce(SecondForceSource.ARM, 11.0, 0.05, 0.02, 1.5),
        system_stiffness=SystemStiffness(3.49e6, 3.5e4, 5.42e-7, 3.87e4, Provenance.MEASURED),
        loop_delay_s=None,
        mechanical_fuse_n=None,
        simulation=SIMULATION,
    ),
    procedure=Procedure(
        step_n=50.0,
        top_force_n=300.0,
        levels_n=(50.0, 100.0, 150.0, 200.0, 250.0, 300.0),
        hold_s=0.5,
        unload=True,
        cycles=1,
        lift_off=True,
        unload_fraction=0.05,
        touch_force_n=3.0,
        touches=2,
        surface_distance_m=0.003,
        surface_uncertainty_m=0.0005,
        search_distance_m=0.002,
        retract_m=0.001,
        tare_s=0.5,
        warm_up_s=0.1,
        max_drift_n=1.0,
        settle_timeout_s=3.0,
        load_rate_n_per_s=1000.0,
    ),
    identify=IdentifyPlan(secant_force_n=300.0),
    record=RecordPlan(Path("runs"), "", ""),
    sources=(),
)


def true_secant(payload: PayloadTruth, force_n: float) -> float:
    return force_n / true_deformation(payload, force_n)


def world(plan: Plan, **wanted: Any) -> WorldSpec:
    return world_for(derive(plan), **wanted)


def truth(payload: Payload, simulation: Simulation) -> PayloadTruth:
    return payload_truth(payload, theory_of(payload), simulation)


def with_simulation(**changes: object) -> Plan:
    simulation = replace(SIMULATION, **changes)  # type: ignore[arg-type]
    return replace(PLAN, rig=replace(PLAN.rig, simulation=simulation))


def test_the_paper_s_sphere() -> None:
    spec = world(PLAN)
    assert spec.payload.k == pytest.approx(6.57e8, rel=1e-3)
    assert (spec.payload.n, spec.payload.law) == (1.5, "smooth")
    assert spec.payload.elastic_limit_n == 500.0
    assert spec.system_stiffness_n_per_m == 3.49e6
    assert spec.system_damping_n_s_per_m == 3.87e4
    assert spec.force_axis == "-fz"
    assert spec.arm_has_force
    assert spec.gauge_rate_hz == spec.second_force_rate_hz == 0.0
    assert spec.seed == 7


def test_seed_puts_the_surface_within_its_uncertainty() -> None:
    surfaces = [world(PLAN, seed=seed).surface_m for seed in range(50)]
    assert all(0.0025 < surface < 0.0035 for surface in surfaces)
    assert len(set(surfaces)) == 50
    assert max(surfaces) - min(surfaces) > 0.0007
    assert world(PLAN, seed=3) == world(PLAN, seed=3)


def test_hidden_differences() -> None:
    spec = world(
        with_simulation(
            payload_factor=2.0,
            stiffness_factor=0.7,
            hysteresis=0.1,
            kinematic_error_m=5e-7,
            force_drift_n_per_s=0.01,
        )
    )
    assert spec.payload.k == pytest.approx(2.0 * world(PLAN).payload.k)
    assert spec.system_stiffness_n_per_m == pytest.approx(0.7 * 3.49e6)
    assert spec.payload.hysteresis == 0.1
    assert spec.force_drift_n_per_s == 0.01
    tangent = 1.5 * true_secant(spec.payload, 300.0)
    assert spec.kinematic_length_m == pytest.approx(
        50.0 / (0.7 * 3.49e6) + 50.0 / tangent, rel=1e-9
    )


def test_laws_and_their_secants() -> None:
    smooth = truth(PLAN.payload, SIMULATION)
    rough = truth(PLAN.payload, replace(SIMULATION, law="rough"))
    plastic = truth(PLAN.payload, replace(SIMULATION, law="elastic_plastic"))
    assert true_secant(smooth, 300.0) == pytest.approx(5.06e6, rel=2e-3)
    assert true_secant(rough, 300.0) == pytest.approx(4.81e6, rel=0.015), "Table II, fitted"
    assert true_secant(plastic, 300.0) == pytest.approx(true_secant(smooth, 300.0))
    assert plastic.elastic_limit_n == pytest.approx(727.0, abs=0.5), "theory's, not the declared"
    assert true_secant(plastic, 2000.0) < true_secant(smooth, 2000.0)


def test_the_declared_law_presses_what_the_payload_states() -> None:
    """Rough where a roughness is stated, flowing beyond theory's limit where theory has one."""
    declared = Simulation()
    assert declared.law == "declared"
    found = truth(PLAN.payload, declared)
    assert found.law == "rough_elastic_plastic"
    assert (found.roughness_m, found.elastic_limit_n) == (7.5e-6, pytest.approx(727.0, abs=0.5))
    assert found.kappa == truth(PLAN.payload, replace(SIMULATION, law="rough")).kappa
    assert true_secant(found, 300.0) == pytest.approx(4.757e6, rel=1e-3)
    assert truth(replace(PLAN.payload, roughness_m=None), declared).law == "elastic_plastic"
    plate = replace(PLAN.payload.plate, yield_strength_pa=None, youngs_modulus_pa=1e9)
    unknown = replace(PLAN.payload, plate=plate)
    assert truth(unknown, declared).law == "rough"
    assert truth(replace(PLAN.payload, geometry=FlatPunch(1e-3)), declared).law == "smooth"


SWITCHES = {
    "drift_m_s": 1e-7, "slip_m": 2e-6, "softness": 0.3, "softness_force_n": 50.0, "lateral": 0.2,
    "cross_talk": 0.02, "sensor_quadratic": 0.01, "sensor_cubic": -0.01,
}  # fmt: skip
PAYLOAD_SWITCHES = {
    "creep": 0.1, "creep_time_s": 2.0, "creep_decades": 3, "adhesion_n": 1.0,
    "pad_stiffness_n_per_m": 2e6, "pad_depth_m": 3e-6, "stop_stiffness_n_per_m": 5e6,
}  # fmt: skip


def test_every_switch_reaches_the_world() -> None:
    spec = world(with_simulation(**SWITCHES, **PAYLOAD_SWITCHES, stop_depth_m=50e-6))
    assert {name: getattr(spec, name) for name in SWITCHES} == SWITCHES
    assert {name: getattr(spec.payload, name) for name in PAYLOAD_SWITCHES} == PAYLOAD_SWITCHES
    assert spec.payload.hard_stop_m == 50e-6
    plain = world(PLAN)
    assert plain.payload.hard_stop_m == math.inf
    off = {"softness_force_n", "creep_time_s", "pad_stiffness_n_per_m", "stop_stiffness_n_per_m"}
    for name in {*SWITCHES, *PAYLOAD_SWITCHES} - off:
        assert not getattr(plain if name in SWITCHES else plain.payload, name), name


def test_every_law_and_every_device_opens() -> None:
    second = SecondForce(SecondForceSource.SENSOR, 2.0, 0.02, 0.02, 0.3, replace(FORCE, axis="+fx"))
    gauge = DisplacementSpec(driver=SIM, rate_hz=100.0, resolution_m=1e-7, noise_m=1e-8)
    for law in ("smooth", "rough", "elastic_plastic"):
        plan = with_simulation(law=law, hysteresis=0.05)
        plan = replace(plan, rig=replace(plan.rig, second_force=second, displacement=gauge))
        spec = world(plan, faults=[WorldFault("force_nan", 1.0, 1.0, 0.0)])
        rig = load_world()(spec)
        assert not spec.arm_has_force
        for device in (rig.arm, rig.force, rig.second_force, rig.displacement):
            assert device is not None
            assert device.open(1.0).driver == "sim"
