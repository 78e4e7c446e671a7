"""The contact laws of the paper's payloads, ready for arrays.

A law is the finite-element curve times factors: roughness (10), and yield (15) of the tips. What
runs in loses part of its factor from test to test.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

import numpy as np

from stepload.contact.elastic import equivalent_modulus, equivalent_radius, law_for
from stepload.contact.limit import ElasticLimit, elastic_limit
from stepload.contact.materials import Material
from stepload.contact.plastic import ElasticPlasticSphere
from stepload.contact.power_law import ContactLaw
from stepload.contact.rough import RoughSphere, roughness_number
from stepload_verify.paper import mesh, printed
from stepload_verify.paper.printed import ALUMINIUM, METAL, ROUGHNESS_M, SECANT_FORCE_N, Payload
from stepload_verify.paper.step_load import FloatArray, Law


class Test(StrEnum):
    """The paper's sequence on one payload; the run-in lies between."""

    ONE = "test 1"
    TWO = "test 2"
    INSTRON = "Instron"


YIELD_LEFT = {Test.ONE: 1.0, Test.TWO: 0.5, Test.INSTRON: 0.0}
"""Share of the yield term (15) of a tip: chosen after V-C, virgin, between, elastic again."""
ROUGHNESS_LEFT = {Test.ONE: 1.0, Test.TWO: 0.5, Test.INSTRON: 0.25}
"""Share of the roughness term (10) of the aluminium sphere, whose asperities yield: chosen."""


def smooth(payload: Payload, plate: Material = ALUMINIUM) -> ContactLaw:
    """The power law (7) of the payload on `plate`."""
    return law_for(payload.geometry, payload.material, plate)


def limit(payload: Payload) -> ElasticLimit:
    """F_c and δ_c (13) on the aluminium plate; the paper's payloads all have one."""
    found = elastic_limit(payload.geometry, payload.material, ALUMINIUM)
    assert found is not None
    return found


def rough(payload: Payload, hardness_pa: float = printed.MICRO_HARDNESS_PA) -> RoughSphere:
    """The rough sphere (10) with the σ_eq of the paper on the aluminium plate."""
    radius = equivalent_radius(payload.geometry)
    assert radius is not None
    modulus = equivalent_modulus(payload.material, ALUMINIUM)
    kappa = roughness_number(modulus, hardness_pa, radius, ROUGHNESS_M)
    return RoughSphere(smooth(payload).k, ROUGHNESS_M, kappa)


def plastic(payload: Payload) -> ElasticPlasticSphere:
    """The elastic–plastic sphere (15) of the payload."""
    found = limit(payload)
    return ElasticPlasticSphere(found.force_n, found.deformation_m)


def elements(payload: Payload, force_n: FloatArray) -> FloatArray:
    """Deformation (N,) in m by finite elements: Hertz times a ratio that is smooth in the cube root
    of force, that is in the contact radius, and 1 at no force."""
    knots_n, deformation_m = mesh.kept()[payload.name]
    law = smooth(payload)
    ratio = deformation_m / (knots_n / law.k) ** (1.0 / law.n)
    at = np.interp(np.cbrt(force_n), np.cbrt([0.0, *knots_n]), [1.0, *ratio])
    return np.asarray(at * (force_n / law.k) ** (1.0 / law.n))


def with_factors(
    payload: Payload,
    force_n: FloatArray,
    *,
    roughness: float = 0.0,
    yields: float = 0.0,
    hardness_pa: float = printed.MICRO_HARDNESS_PA,
) -> FloatArray:
    """The finite-element deformation (N,) in m times the factors (10) and (15), each with a share
    of what it adds; forces are positive."""
    smooth_m = (force_n / smooth(payload).k) ** (1.0 / smooth(payload).n)
    factor = np.ones_like(force_n)
    for share, law in (
        (roughness, rough(payload, hardness_pa).deformation),
        (yields, plastic(payload).deformation),
    ):
        if share:
            added = np.array([law(float(force)) for force in force_n]) / smooth_m - 1.0
            factor *= 1.0 + share * added
    return elements(payload, force_n) * factor


def measured(payload: Payload, test: Test) -> Law:
    """What a test to 300 N meets; on the Instron the force is that of the steel platen."""
    tip = not payload.name.endswith("sphere")
    left = ROUGHNESS_LEFT[test] if payload is METAL else 1.0
    softer = counter_body(payload) if test is Test.INSTRON else 1.0
    return tabulated(
        lambda force: with_factors(
            payload, force * softer, roughness=left, yields=tip * YIELD_LEFT[test]
        ),
        SECANT_FORCE_N,
    )


def counter_body(payload: Payload) -> float:
    """E_eq on aluminium over E_eq on steel (4): force at equal δ on the one over the other (V-A)."""
    return equivalent_modulus(payload.material, ALUMINIUM) / equivalent_modulus(
        payload.material, printed.STEEL
    )


def tabulated(deformation: Callable[[FloatArray], FloatArray], top_n: float) -> Law:
    """A law by interpolation in the logarithm; it passes through (0, 0) below a hundred thousandth
    of `top_n`."""
    knots = np.geomspace(1e-5 * top_n, 1.01 * top_n, 1000)
    values = deformation(knots)

    def law(force_n: FloatArray) -> FloatArray:
        x, y = np.log(knots), np.log(values)
        known = np.exp(np.interp(np.log(np.maximum(force_n, knots[0])), x, y))
        return np.asarray(np.where(force_n >= knots[0], known, force_n / knots[0] * values[0]))

    return law
