"""Conditions of an identification from a plan or a record; in the record as conditions.json."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from stepload.contact.deflection import table_problem
from stepload.contact.elastic import equivalent_modulus
from stepload.contact.law_names import LAW_NAMES
from stepload.contact.materials import BluntTip, Sphere
from stepload.contact.rough import RoughSphere, roughness_number
from stepload.envelope.envelope import Envelope
from stepload.envelope.stiffness import known_stiffness
from stepload.envelope.theory import Theory
from stepload.errors import BadInputError
from stepload.estimators.conditions import Conditions
from stepload.estimators.deflection import least_sigma
from stepload.estimators.linearity import ASSUMED_NONLINEARITY
from stepload.estimators.sources import Sources
from stepload.plan.model import Payload
from stepload.results.press_data import PressData

FILE = "conditions.json"
HARDNESS_PER_YIELD = 5.0
UNKNOWN_LAG_SIGMA_S = 1e-3
"""Standard uncertainty of the alignment where the ramps tell no better: a period at 1 kHz."""


def planned(envelope: Envelope) -> Conditions:
    """The conditions of a plan, with the rig's figures; see `measured`."""
    plan, theory = envelope.plan, envelope.theory
    rig, stiffness, wanted = plan.rig, plan.rig.system_stiffness, plan.identify
    gauge, payload = rig.displacement, plan.payload
    smooth_m, crooked = stiffness.smooth_error_m, rig.force.nonlinearity
    known = known_stiffness(plan)
    table = None if gauge else known.table
    sources = Sources(
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
        nonlinearity=ASSUMED_NONLINEARITY if crooked is None else crooked,
        temperature_sigma_k=wanted.temperature_uncertainty_k,
        position_m_per_k=payload.height_m * payload.thermal_expansion_per_k
        + (0.0 if gauge else rig.load_path_m * rig.thermal_expansion_per_k),
        modulus_per_k=payload.modulus_change_per_k,
        deflection_force_n=table.force_n if table else (),
        deflection_m=table.deflection_m if table else (),
        deflection_sigma_m=table.sigma_m if table else (),
        system_stiffness_note="" if gauge else known.note,
    )
    return Conditions(
        sources=sources,
        secant_force_n=wanted.secant_force_n,
        touch_force_n=plan.procedure.touch_force_n,
        position_resolution_m=sources.position_resolution_m,
        elastic_limit_n=theory.elastic_limit_n,
        roughness_m=payload.roughness_m,
        rough_length_m=_rough_length(payload, theory),
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
        laws=wanted.laws,
        pose=rig.arm.pose,
        temperature_c=wanted.temperature_c,
    )


def _rough_length(payload: Payload, theory: Theory) -> float | None:
    """1.22 σ κ^-0.16 (11) in m; 0 where the plan says smooth, None where it does not say enough.

    Where the micro-hardness is not told it is taken as five times the yield strength (of a metal or
    a plastic within a factor of two, which moves the length by 11 %).
    """
    if payload.roughness_m == 0.0:
        return 0.0
    if payload.roughness_m is None or not isinstance(payload.geometry, Sphere | BluntTip):
        return None
    if theory.is_range:
        return None
    hardness = payload.micro_hardness_pa
    if hardness is None and payload.material.yield_strength_pa is not None:
        hardness = HARDNESS_PER_YIELD * payload.material.yield_strength_pa
    if hardness is None:
        return None
    modulus = equivalent_modulus(payload.material, payload.plate)
    # K = 4/3 E_eq √R_eq (7) holds for one sphere and for two.
    k = theory.law.k
    radius = (k / (4.0 / 3.0 * modulus)) ** 2
    kappa = roughness_number(modulus, hardness, radius, payload.roughness_m)
    return RoughSphere(k, payload.roughness_m, kappa).scale_m


def measured(conditions: Conditions, data: PressData) -> Conditions:
    """The same with noise and lag as the run itself found them."""
    sources = conditions.sources
    lag_sigma_s = data.lag.sigma_s
    if data.lag_corrected_s == 0.0:
        lag_sigma_s = min(lag_sigma_s, sources.lag_sigma_s)
    return replace(
        conditions,
        sources=replace(
            sources,
            force_noise_n=max(data.noise_n, sources.force_noise_n),
            lag_sigma_s=lag_sigma_s,
        ),
    )


def to_bytes(conditions: Conditions) -> bytes:
    """As a file of the record."""
    return json.dumps(asdict(conditions)).encode()


def from_attachments(attachments: Mapping[str, bytes]) -> Conditions:
    """Read a record's conditions; the record may be anybody's.

    Raises:
        BadInputError: not there, or not what it should be.
    """
    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        data = json.loads(raw)
        laws = tuple(data.get("laws", ()))
        found = Conditions(**{**data, "sources": _sources(data["sources"]), "laws": laws})
        _check(found)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return found


_NO_NUMBERS = ("sources", "kind", "laws", "pose", "temperature_c", "system_stiffness_note")
_TABLE = ("deflection_force_n", "deflection_m", "deflection_sigma_m")


def _sources(data: dict[str, Any]) -> Sources:
    """The sources of a record; one that knows no table has a K_s without one, and one that does not
    speak of the force sensor's linearity is of a time before it was asked.

    Its 50 N of smooth length was nobody's measurement either, but the constant of that version.
    """
    rows = {name: tuple(map(float, data.get(name, ()))) for name in _TABLE}
    sources = Sources(**{"nonlinearity": ASSUMED_NONLINEARITY, **data, **rows})
    stiffness = sources.system_stiffness_n_per_m
    if _TABLE[0] in data:
        return sources
    sources = replace(sources, smooth_length_n=None)
    if stiffness is None:
        return sources
    sigma, note = least_sigma(stiffness, sources.system_stiffness_sigma_n_per_m)
    return replace(sources, system_stiffness_sigma_n_per_m=sigma, system_stiffness_note=note)


def _check(found: Conditions) -> None:
    if found.kind not in ("payload", "system"):
        raise ValueError(f"kind {found.kind!r}")
    if not isinstance(found.pose, str):
        raise ValueError(f"pose {found.pose!r}")
    if unknown := [word for word in found.laws if word not in LAW_NAMES]:
        raise ValueError(f"laws {unknown!r}")
    celsius = found.temperature_c
    if celsius is not None and not (isinstance(celsius, int | float) and math.isfinite(celsius)):
        raise ValueError(f"temperature_c is {celsius!r}")
    if not isinstance(found.sources.system_stiffness_note, str):
        raise ValueError(f"system_stiffness_note {found.sources.system_stiffness_note!r}")
    rows = [getattr(found.sources, name) for name in _TABLE]
    if any(rows) and (problem := table_problem(rows[0], rows[1], rows[2])):
        raise ValueError(problem)
    numbers = {**asdict(found.sources), **asdict(found)}
    optional = {"system_stiffness_n_per_m", "zero_sigma_m", "elastic_limit_n", "roughness_m",
                "rough_length_m", "smooth_length_n", "smooth_degrees", "theory_k", "theory_n",
                "modulus_pa", "plate_pa"}  # fmt: skip
    positive = {"secant_force_n", "p", "s", "t", "system_stiffness_n_per_m", "elastic_limit_n",
                "position_resolution_m", "smooth_length_n", "theory_k", "theory_n", "modulus_pa",
                "plate_pa"}  # fmt: skip
    for name, value in numbers.items():
        if name in _NO_NUMBERS or name in _TABLE:
            continue
        if value is None and name in optional:
            continue
        if not isinstance(value, int | float) or not 0.0 <= value < math.inf:
            raise ValueError(f"{name} is {value!r}, must be finite and not negative")
        if name in positive and value == 0.0:
            raise ValueError(f"{name} is 0, must be positive")
