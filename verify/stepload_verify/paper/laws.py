"""The contact laws of the paper's payloads, ready for arrays.

A law is the finite-element curve times factors: roughness (10), and yield (15) of the tips. What
runs in loses part of its factor from test to test.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from functools import cache

import numpy as np

from stepload.contact.curve_factors import rough_factor, yield_factor
from stepload.contact.elastic import equivalent_modulus, equivalent_radius, law_for
from stepload.contact.limit import ElasticLimit, elastic_limit
from stepload.contact.materials import Material
from stepload.contact.power_law import ContactLaw
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
    radius = equivalent_radius(payload.geometry)
    assert radius is not None
    bodies = radius, payload.material, ALUMINIUM
    factor = np.ones_like(force_n)
    if roughness:
        added = rough_factor(force_n, *bodies, ROUGHNESS_M, hardness_pa) - 1.0
        factor += roughness * added
    if yields:
        factor *= 1.0 + yields * (yield_factor(force_n, *bodies) - 1.0)
    return elements(payload, force_n) * factor


@cache
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
    """E_eq on aluminium over E_eq on steel (4), and so their forces at equal δ (V-A)."""
    return equivalent_modulus(payload.material, ALUMINIUM) / equivalent_modulus(
        payload.material, printed.STEEL
    )


def tabulated(deformation: Callable[[FloatArray], FloatArray], top_n: float) -> Law:
    """A law by interpolation in the logarithm; it passes through (0, 0) below a hundred thousandth
    of `top_n`."""
    knots = np.geomspace(1e-5 * top_n, 1.01 * top_n, 500)
    values = deformation(knots)

    def law(force_n: FloatArray) -> FloatArray:
        x, y = np.log(knots), np.log(values)
        known = np.exp(np.interp(np.log(np.maximum(force_n, knots[0])), x, y))
        return np.asarray(np.where(force_n >= knots[0], known, force_n / knots[0] * values[0]))

    return law
