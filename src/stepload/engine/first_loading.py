"""The true first loading of a simulated payload, with which results are compared.

Creep is left out: this is the instantaneous response. Deformations count from the surface of the
smooth body, which is the mean plane of a rough one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from stepload.contact import plastic
from stepload.contact.rough import RoughSphere
from stepload.errors import DomainError
from stepload.rig.world import PayloadTruth

_HALVINGS = 200


def true_deformation(payload: PayloadTruth, force_n: float) -> float:
    """Deformation in m at which the simulated payload first reaches `force_n`.

    At 0 N it is where the force begins to rise: 1.57 σ κ^-0.16 of a rough payload.

    Raises:
        DomainError: `force_n` is negative or outside the law.
    """
    if not 0.0 <= force_n < math.inf:
        raise DomainError(f"contact force {force_n:g} N is not from 0 N on")
    deformation_m = _with_stop(payload, force_n) if payload.hard_stop_m < math.inf else None
    if deformation_m is None:
        deformation_m = _surface(payload, force_n)
    if payload.pad_depth_m > 0.0:
        deformation_m += min(force_n / payload.pad_stiffness_n_per_m, payload.pad_depth_m)
    if payload.seating_m > 0.0:
        deformation_m += payload.seating_m * min(1.0, deformation_m / payload.seating_depth_m)
    return deformation_m


def _surface(payload: PayloadTruth, force_n: float) -> float:
    """Deformation of the body itself with its adhesion, without pad, stop and seating."""
    if payload.adhesion_n > 0.0:
        if payload.adhesion_law == "jkr":
            return _adhesive_sphere(payload.k, payload.adhesion_n, force_n)
        force_n += payload.adhesion_n
    deformation_m = _smooth(payload, force_n)
    if payload.law.startswith("rough"):
        rough = RoughSphere(payload.k, payload.roughness_m, payload.kappa)
        deformation_m = rough.deformation(payload.k * deformation_m**payload.n)
    return deformation_m


def _smooth(payload: PayloadTruth, force_n: float) -> float:
    if payload.law.endswith("elastic_plastic"):
        sphere = plastic.ElasticPlasticSphere.from_law(payload.k, payload.elastic_limit_n)
        return sphere.deformation(force_n)
    return float((force_n / payload.k) ** (1.0 / payload.n))


def _adhesive_sphere(k: float, pull_off_n: float, force_n: float) -> float:
    """JKR: K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301.

    δ = δ0 (A² − ⅔ √A), F = 4 P (A³ − A^1.5), δ0 = (4 P/K)^(2/3); A is the contact radius over that
    at no load.
    """
    root = 0.5 + 0.5 * math.sqrt(1.0 + force_n / pull_off_n)
    a = root ** (2.0 / 3.0)
    scale_m = (4.0 * pull_off_n / k) ** (2.0 / 3.0)
    return float(scale_m * (a * a - 2.0 / 3.0 * math.sqrt(a)))


def _with_stop(payload: PayloadTruth, force_n: float) -> float | None:
    """Deformation at `force_n` where the stop carries a part of it, else None."""
    stop_m, stiffness = payload.hard_stop_m, payload.stop_stiffness_n_per_m

    def beyond(body_n: float) -> float:
        depth_m = _surface(payload, body_n)
        return body_n + stiffness * (depth_m - stop_m) - force_n

    if _surface(payload, force_n) <= stop_m:
        return None
    return _surface(payload, _root(beyond, 0.0, force_n))


def _root(rising: Callable[[float], float], low: float, high: float) -> float:
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if rising(middle) > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)
