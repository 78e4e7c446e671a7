"""Plans built by hand: the STVF machine of the paper and a UR-class arm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from stepload.contact.materials import Material, Sphere
from stepload.feasibility.bounds import Measured
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.preflight import Preflight, derive
from stepload.plan.model import (
    ArmSpec,
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
    Structure,
    SystemStiffness,
)

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
STEEL = Material("steel", 200e9, 0.29, None)
SIM = "sim"


def preflight_for(
    plan: Plan, elastic_limit_n: float = 727.0, measured: Measured | None = None
) -> Preflight:
    """The preflight of a plan whose payload has this elastic limit, whatever theory says.

    Its remedies are not tried: that takes several preflights more, of which a run uses none.
    """
    material = replace(plan.payload.material, yield_strength_pa=None)
    payload = replace(plan.payload, material=material, declared_force_limit_n=elastic_limit_n)
    return derive(replace(plan, payload=payload), measured)


def limits_for(
    plan: Plan, elastic_limit_n: float = 727.0, measured: Measured | None = None
) -> RunLimits:
    """The thresholds of such a plan; RefusedError where it may not be pressed."""
    return preflight_for(plan, elastic_limit_n, measured).run_limits


def stvf_plan(**procedure: Any) -> Plan:
    arm = ArmSpec(
        driver=SIM, rate_hz=1000.0, max_speed_m_s=0.05, max_acceleration_m_s2=2.0,
        max_push_n=2000.0, effective_mass_kg=20.0, command_delay_s=0.003, lag_s=0.004,
        lost_motion_m=0.0, position_resolution_m=2e-6, position_noise_m=3e-7,
        model_tolerance_m=50e-6, pose="vertical", structure=Structure.MACHINE,
    )  # fmt: skip
    force = ForceSpec(
        driver=SIM, axis="-fz", rate_hz=1000.0, range_n=1000.0, resolution_n=0.05, noise_n=0.3,
        delay_s=0.001, gain_uncertainty=0.005, drift_n_per_s=0.0,
    )  # fmt: skip
    rig = Rig(
        name="stvf", arm=arm, force=force, displacement=None,
        second_force=SecondForce(SecondForceSource.ARM, 11.0, 0.05, 0.02, 1.5, zero_error_n=0.0),
        system_stiffness=SystemStiffness(
            3.49e6, 3.5e4, 5.42e-7, 3.87e4, Provenance.MEASURED, pose="vertical"
        ),
        loop_delay_s=None, mechanical_fuse_n=None,
        simulation=Simulation(1, "smooth", 1.0, 1.0, 0.0, 0.0, 0.0, 50.0, 0.0),
    )  # fmt: skip
    return _plan(rig, _procedure(**procedure))


def ur_plan(**procedure: Any) -> Plan:
    plan = stvf_plan(**procedure)
    arm = replace(
        plan.rig.arm, rate_hz=500.0, max_speed_m_s=0.25, max_acceleration_m_s2=1.2,
        max_push_n=400.0, effective_mass_kg=5.0, command_delay_s=0.010, lag_s=0.020,
        position_resolution_m=1e-5, position_noise_m=5e-6, model_tolerance_m=100e-6,
    )  # fmt: skip
    stiffness = replace(
        plan.rig.system_stiffness, stiffness_n_per_m=1e5, sigma_n_per_m=2e3,
        damping_n_s_per_m=300.0,
    )  # fmt: skip
    rig = replace(plan.rig, name="ur", arm=arm, system_stiffness=stiffness)
    return replace(plan, rig=rig)


def _procedure(**changes: Any) -> Procedure:
    values: dict[str, Any] = {
        "step_n": 50.0, "top_force_n": 300.0, "hold_s": 0.5, "unload": True, "cycles": 1,
        "lift_off": True, "unload_fraction": 0.05, "touch_force_n": 3.0, "touches": 2,
        "surface_distance_m": 0.002, "surface_uncertainty_m": 0.0002, "search_distance_m": 0.002,
        "retract_m": 0.001, "tare_s": 0.5, "warm_up_s": 0.1, "max_drift_n": 1.0,
        "settle_timeout_s": 3.0,
        "load_rate_n_per_s": 1000.0,
    }  # fmt: skip
    values.update(changes)
    if "levels_n" not in values:
        count = round(values["top_force_n"] / values["step_n"])
        step_n = values["top_force_n"] / count
        values["levels_n"] = tuple(step_n * (i + 1) for i in range(count))
    return Procedure(**values)


def _plan(rig: Rig, procedure: Procedure) -> Plan:
    payload = Payload("ball", Sphere(28.7e-3), ACETAL, STEEL, None, None, None)
    identify = IdentifyPlan(secant_force_n=300.0)
    return Plan(
        stepload=1, name="test", path=Path("plan.yaml"), payload=payload, rig=rig,
        procedure=procedure, identify=identify, record=RecordPlan(Path("runs"), "", ""),
    )  # fmt: skip
