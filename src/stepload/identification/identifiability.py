"""Can this rig tell this payload's stiffness? Equations (29)–(36) of the paper.

Everything is a *secant* stiffness at the top force, so the exponent n does not enter (34).
p counts how many position resolutions the zero and the reading may be off, s says how well the
system's deflection is compensated (its relative error is 1/s), t is the accuracy asked for (1/t).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from stepload.errors import DomainError
from stepload.identification.conditions import Conditions


class Binding(StrEnum):
    """What limits the largest stiffness a rig can identify."""

    RESOLUTION = "position resolution"
    SYSTEM_STIFFNESS = "system stiffness"


@dataclass(frozen=True, slots=True)
class Identifiability:
    """The largest secant stiffness that can be identified, and why not more.

    Attributes:
        k_max_n_per_m: (34); without K_s in the chain (a gauge across the contact) K_r/(2 p t).
        resolution_stiffness_n_per_m: K_r = F_max/δ_Δ.
        limit_stiff_resolution_n_per_m: (35), K_r ≫ K_s: s K_s/t; inf without K_s in the chain.
        limit_stiff_system_n_per_m: (36), K_s ≫ K_r: K_r/(2 p t).
        binding: which of the two rules.
    """

    k_max_n_per_m: float
    resolution_stiffness_n_per_m: float
    limit_stiff_resolution_n_per_m: float
    limit_stiff_system_n_per_m: float
    binding: Binding


def _positive(**numbers: float) -> None:
    for name, number in numbers.items():
        if not (math.isfinite(number) and number > 0.0):
            raise DomainError(f"{name} is {number!r}, must be finite and above 0")


def identifiability(
    top_force_n: float,
    resolution_m: float,
    system_stiffness_n_per_m: float | None,
    *,
    p: float = 2.0,
    s: float = 20.0,
    t: float = 5.0,
) -> Identifiability:
    """K_max of a rig (34) with its limit cases (35), (36).

    Args:
        top_force_n: largest force of the run, F_max.
        system_stiffness_n_per_m: K_s; None where a gauge across the contact takes it out.

    Raises:
        DomainError: a number that is not finite and positive.

    >>> print(f"{identifiability(300.0, 2e-6, 3.49e6).k_max_n_per_m:.2e}")
    7.23e+06
    """
    _positive(top_force_n=top_force_n, resolution_m=resolution_m, p=p, s=s, t=t)
    k_r = top_force_n / resolution_m
    limit_system = k_r / (2.0 * p * t)
    if system_stiffness_n_per_m is None:
        return Identifiability(limit_system, k_r, math.inf, limit_system, Binding.RESOLUTION)
    k_s = system_stiffness_n_per_m
    _positive(system_stiffness_n_per_m=k_s)
    k_max = s * k_r * k_s / max(2.0 * p * s * t * k_s, p * s * t * k_s + t * k_r)
    binding = Binding.SYSTEM_STIFFNESS if k_r > p * s * k_s else Binding.RESOLUTION
    return Identifiability(k_max, k_r, s * k_s / t, limit_system, binding)


def k_max(told: Conditions, top_force_n: float) -> float:
    """K_max in N/m under the conditions of an identification: (34), or (36) with a gauge."""
    return identifiability(
        top_force_n, told.position_resolution_m, told.sources.system_stiffness_n_per_m,
        p=told.p, s=told.s, t=told.t,
    ).k_max_n_per_m  # fmt: skip


def gauge_resolution_for(
    secant_n_per_m: float, top_force_n: float, *, p: float = 2.0, t: float = 5.0
) -> float:
    """Resolution a gauge across the contact needs for this payload: (36) solved for δ_Δ, in m."""
    _positive(secant_n_per_m=secant_n_per_m, top_force_n=top_force_n)
    return top_force_n / (2.0 * p * t * secant_n_per_m)
