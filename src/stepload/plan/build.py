"""Checked values of the file's keys → the frozen model, SI units in the names."""

from __future__ import annotations

from pathlib import Path

from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.plan.model import (
    ArmSpec,
    DisplacementSpec,
    DriverChoice,
    ForceSpec,
    IdentifyPlan,
    Payload,
    Procedure,
    Provenance,
    RecordPlan,
    RecordPolicy,
    Rig,
    SecondForce,
    SecondForceSource,
    Simulation,
    SystemStiffness,
)
from stepload.plan.validate import Values


def _material(v: Values) -> Material:
    return Material(v["name"], v["youngs_modulus"], v["poisson_ratio"], v["yield_strength"])


def _geometry(v: Values) -> Geometry:
    match v["shape"]:
        case "sphere":
            return Sphere(v["radius"], v["counter_radius"])
        case "cone_tip":
            return BluntTip("cone", v["radius"])
        case "pyramid_tip":
            return BluntTip("pyramid", v["radius"])
        case "sharp_cone":
            return SharpCone(v["slope"])
        case "flat_punch":
            return FlatPunch(v["radius"])
        case _:
            return PowerProfile(v["exponent"], v["gap"] / v["at_radius"] ** v["exponent"])


def build_payload(v: Values) -> Payload:
    """The payload; KeyError, ZeroDivisionError or OverflowError where a key is missing or bad."""
    return Payload(
        name=v["name"],
        geometry=_geometry(v["geometry"]),
        material=_material(v["material"]),
        plate=_material(v["plate"]),
        roughness_m=v["roughness"],
        micro_hardness_pa=v["micro_hardness"],
        declared_force_limit_n=v["force_limit"],
    )


def _driver(v: Values) -> DriverChoice:
    return DriverChoice(v["driver"], v["options"])


def _arm(v: Values) -> ArmSpec:
    return ArmSpec(
        driver=_driver(v),
        rate_hz=v["rate"],
        max_speed_m_s=v["max_speed"],
        max_acceleration_m_s2=v["max_acceleration"],
        max_push_n=v["max_push"],
        effective_mass_kg=v["effective_mass"],
        command_delay_s=v["command_delay"],
        lag_s=v["lag"],
        lost_motion_m=v["lost_motion"],
        position_resolution_m=v["position_resolution"],
        position_noise_m=v["position_noise"],
        model_tolerance_m=v["model_tolerance"],
        pose=v["pose"],
        max_age_s=v["max_age"],
    )


def _force(v: Values) -> ForceSpec:
    return ForceSpec(
        driver=_driver(v),
        axis=v["axis"],
        rate_hz=v["rate"],
        range_n=v["range"],
        resolution_n=v["resolution"],
        noise_n=v["noise"],
        delay_s=v["delay"],
        gain_uncertainty=v["gain_uncertainty"],
        drift_n_per_s=v["drift"],
        max_age_s=v["max_age"],
    )


def _displacement(v: Values) -> DisplacementSpec:
    return DisplacementSpec(_driver(v), v["rate"], v["resolution"], v["noise"])


def _second_force(v: Values) -> SecondForce:
    return SecondForce(
        source=SecondForceSource(v["source"]),
        tolerance_n=v["tolerance"],
        tolerance_relative=v["tolerance_relative"],
        time_s=v["time"],
        noise_n=v["noise"],
        sensor=_force(v["sensor"]) if v["sensor"] else None,
    )


def _stiffness(v: Values) -> SystemStiffness:
    return SystemStiffness(
        stiffness_n_per_m=v["value"],
        sigma_n_per_m=v["sigma"],
        msde_m=v["msde"],
        damping_n_s_per_m=v["damping"],
        provenance=Provenance(v["provenance"]),
        smooth_error_m=v["smooth_error"],
        smooth_degrees=v["smooth_degrees"],
        record=v.get("record_path"),
        measured_on=v["measured_on"],
        valid_until=v["valid_until"],
        pose=v["pose"],
        direction=v["direction"],
        temperature_c=v["temperature"],
        simulated=v.get("simulated", False),
        policy=RecordPolicy(v["policy"]),
        validity_problem=v["validity_problem"],
    )


def _simulation(v: Values) -> Simulation:
    return Simulation(
        seed=v["seed"],
        law=v["law"],
        payload_factor=v["payload_factor"],
        stiffness_factor=v["stiffness_factor"],
        surface_error_m=v["surface_error"],
        hysteresis=v["hysteresis"],
        kinematic_error_m=v["kinematic_error"],
        kinematic_length_n=v["kinematic_length"],
        force_drift_n_per_s=v["force_drift"],
    )


def build_rig(v: Values) -> Rig:
    """The rig; options and system stiffness of `v` must be settled."""
    return Rig(
        name=v["name"],
        arm=_arm(v["arm"]),
        force=_force(v["force"]),
        displacement=_displacement(v["displacement"]) if v["displacement"] else None,
        second_force=_second_force(v["second_force"]),
        system_stiffness=_stiffness(v["system_stiffness"]),
        loop_delay_s=v["loop_delay"],
        mechanical_fuse_n=v["mechanical_fuse"],
        simulation=_simulation(v["simulation"]),
    )


def build_procedure(v: Values) -> Procedure:
    """The procedure; defaults of `v` must be filled in."""
    return Procedure(
        step_n=v["step"],
        top_force_n=v["top_force"],
        levels_n=tuple(v["levels"]),
        load_rate_n_per_s=v["load_rate"],
        hold_s=v["hold"],
        unload=v["unload"],
        cycles=v["cycles"],
        lift_off=v["lift_off"],
        unload_fraction=v["unload_fraction"],
        touch_force_n=v["touch_force"],
        touches=v["touches"],
        surface_distance_m=v["surface_distance"],
        surface_uncertainty_m=v["surface_uncertainty"],
        search_distance_m=v["search_distance"],
        retract_m=v["retract"],
        tare_s=v["tare"],
        warm_up_s=v["warm_up"],
        max_drift_n=v["max_drift"],
        settle_timeout_s=v["settle_timeout"],
    )


def build_identify(v: Values) -> IdentifyPlan:
    """The identification; defaults of `v` must be filled in."""
    return IdentifyPlan(
        kind=v["kind"],
        secant_force_n=v["secant_force"],
        resolution_multiple_p=v["p"],
        compensation_quality_s=v["s"],
        accuracy_t=v["t"],
        accept_unidentifiable=v["accept_unidentifiable"],
        temperature_c=v["temperature"],
    )


def build_record(v: Values) -> RecordPlan:
    """Where the record goes."""
    return RecordPlan(Path(v["directory"]), v["notes"], v["operator"])
