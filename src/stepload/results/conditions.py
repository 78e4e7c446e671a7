"""Conditions of an identification from a plan or a record; in the record as conditions.json."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, replace

from stepload.contact.elastic import equivalent_modulus
from stepload.envelope.envelope import Envelope
from stepload.errors import BadInputError
from stepload.identify.conditions import Conditions
from stepload.identify.sources import Sources
from stepload.results.press_data import PressData

FILE = "conditions.json"
UNKNOWN_LAG_SIGMA_S = 1e-3
"""Standard uncertainty of the alignment where the ramps tell no better: a period at 1 kHz."""


def planned(envelope: Envelope) -> Conditions:
    """The conditions of a plan, with the rig's figures; see `measured`."""
    plan, theory = envelope.plan, envelope.theory
    rig, stiffness, wanted = plan.rig, plan.rig.system_stiffness, plan.identify
    gauge, payload = rig.displacement, plan.payload
    smooth_m = stiffness.smooth_error_m
    sources = Sources(
        system_stiffness_n_per_m=None if gauge else stiffness.stiffness_n_per_m,
        system_stiffness_sigma_n_per_m=0.0 if gauge else stiffness.sigma_n_per_m,
        smooth_error_m=0.0 if gauge else stiffness.msde_m if smooth_m is None else smooth_m,
        smooth_degrees=None if gauge else stiffness.smooth_degrees,
        force_noise_n=rig.force.noise_n,
        force_resolution_n=rig.force.resolution_n,
        position_noise_m=gauge.noise_m if gauge else rig.arm.position_noise_m,
        position_resolution_m=gauge.resolution_m if gauge else rig.arm.position_resolution_m,
        lag_sigma_s=UNKNOWN_LAG_SIGMA_S,
        gain_sigma=rig.force.gain_uncertainty,
        temperature_sigma_k=wanted.temperature_uncertainty_k,
        position_m_per_k=payload.height_m * payload.thermal_expansion_per_k
        + (0.0 if gauge else rig.load_path_m * rig.thermal_expansion_per_k),
        modulus_per_k=payload.modulus_change_per_k,
    )
    return Conditions(
        sources=sources,
        secant_force_n=wanted.secant_force_n,
        touch_force_n=plan.procedure.touch_force_n,
        position_resolution_m=sources.position_resolution_m,
        elastic_limit_n=theory.elastic_limit_n,
        roughness_m=payload.roughness_m,
        p=wanted.resolution_multiple_p,
        s=wanted.compensation_quality_s,
        t=wanted.accuracy_t,
        kind=wanted.kind,
        theory_k=theory.law.k,
        theory_n=theory.law.n,
        modulus_pa=equivalent_modulus(payload.material, payload.plate),
        plate_pa=payload.plate.youngs_modulus_pa / (1.0 - payload.plate.poisson_ratio**2),
        pose=rig.arm.pose,
        temperature_c=wanted.temperature_c,
    )


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
        found = Conditions(**{**data, "sources": Sources(**data["sources"])})
        _check(found)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return found


def _check(found: Conditions) -> None:
    if found.kind not in ("payload", "system"):
        raise ValueError(f"kind {found.kind!r}")
    if not isinstance(found.pose, str):
        raise ValueError(f"pose {found.pose!r}")
    celsius = found.temperature_c
    if celsius is not None and not (isinstance(celsius, int | float) and math.isfinite(celsius)):
        raise ValueError(f"temperature_c is {celsius!r}")
    numbers = {**asdict(found.sources), **asdict(found)}
    optional = {"system_stiffness_n_per_m", "zero_sigma_m", "elastic_limit_n", "roughness_m",
                "smooth_degrees", "theory_k", "theory_n", "modulus_pa", "plate_pa"}  # fmt: skip
    positive = {"secant_force_n", "p", "s", "t", "system_stiffness_n_per_m", "elastic_limit_n",
                "position_resolution_m", "theory_k", "theory_n", "modulus_pa",
                "plate_pa"}  # fmt: skip
    for name, value in numbers.items():
        if name in ("sources", "kind", "pose", "temperature_c"):
            continue
        if value is None and name in optional:
            continue
        if not isinstance(value, int | float) or not 0.0 <= value < math.inf:
            raise ValueError(f"{name} is {value!r}, must be finite and not negative")
        if name in positive and value == 0.0:
            raise ValueError(f"{name} is 0, must be positive")
