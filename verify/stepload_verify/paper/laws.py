"""The contact laws of the paper's payloads, ready for arrays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stepload.contact.elastic import equivalent_modulus, equivalent_radius, law_for
from stepload.contact.limit import ElasticLimit, elastic_limit
from stepload.contact.materials import Material
from stepload.contact.plastic import ElasticPlasticSphere
from stepload.contact.power_law import ContactLaw
from stepload.contact.rough import RoughSphere, roughness_number
from stepload_verify.paper import printed
from stepload_verify.paper.printed import (
    ALUMINIUM,
    ROUGHNESS_M,
    SECANT_FORCE_N,
    Payload,
)
from stepload_verify.paper.step_load import FloatArray, Law


def smooth(payload: Payload, plate: Material = ALUMINIUM) -> ContactLaw:
    """The power law (7) of the payload on `plate`."""
    return law_for(payload.geometry, payload.material, plate)


def limit(payload: Payload) -> ElasticLimit:
    """F_c and δ_c (13) on the aluminium plate; the paper's payloads all have one."""
    found = elastic_limit(payload.geometry, payload.material, ALUMINIUM)
    assert found is not None
    return found


def rough(
    payload: Payload, plate: Material = ALUMINIUM, hardness_pa: float | None = None
) -> RoughSphere:
    """The rough sphere (10) with the σ_eq of the paper; by default of the hardness chosen."""
    radius = equivalent_radius(payload.geometry)
    assert radius is not None
    modulus = equivalent_modulus(payload.material, plate)
    kappa = roughness_number(modulus, hardness_pa or printed.MICRO_HARDNESS_PA, radius, ROUGHNESS_M)
    return RoughSphere(smooth(payload, plate).k, ROUGHNESS_M, kappa)


def measured(payload: Payload, plate: Material = ALUMINIUM) -> Law:
    """What a run to 300 N meets: a rough sphere, or a tip that yields."""
    if payload.name.endswith("sphere"):
        contact = rough(payload, plate)
        return tabulated(lambda force: contact.deformation(force), SECANT_FORCE_N)
    yielding = plastic(payload)
    return tabulated(lambda force: yielding.deformation(force), SECANT_FORCE_N)


def plastic(payload: Payload) -> ElasticPlasticSphere:
    """The elastic–plastic sphere (14) of the payload."""
    found = limit(payload)
    return ElasticPlasticSphere(found.force_n, found.deformation_m)


def smooth_array(payload: Payload) -> Law:
    """Deformation of the power law for arrays of force."""
    law = smooth(payload)
    return lambda force_n: np.asarray((force_n / law.k) ** (1.0 / law.n))


def tabulated(deformation: Callable[[float], float], top_n: float) -> Law:
    """Array version of a scalar law by interpolation in the logarithm, good to 1e-5; it passes
    through (0, 0) below a hundred thousandth of `top_n`."""
    knots = np.geomspace(1e-5 * top_n, 1.01 * top_n, 2000)
    values = np.array([deformation(float(force)) for force in knots])

    def law(force_n: FloatArray) -> FloatArray:
        x, y = np.log(knots), np.log(values)
        known = np.exp(np.interp(np.log(np.maximum(force_n, knots[0])), x, y))
        return np.asarray(np.where(force_n >= knots[0], known, force_n / knots[0] * values[0]))

    return law
