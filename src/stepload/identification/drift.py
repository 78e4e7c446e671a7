"""Drift, from the top of one cycle to the top of the next, and its subtraction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stepload.identification.conditions import Sources
from stepload.identification.inelastic_signs import Compliance, signs_of
from stepload.identification.loops import BETWEEN, Branch, Hold, Loop

SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Drift:
    """A steady drift of the travel in m/s and its standard uncertainty."""

    rate_m_per_s: float
    sigma_m_per_s: float


def drift_of(loops: Sequence[Loop], compliance: Compliance, sources: Sources) -> Drift | None:
    """Drift between the tops of the first two cycles; None where there is only one.

    Both tops are held in the same way, so both contain the payload's creep. Where the holds show
    another drift, the contact has set between the cycles, and theirs is used.
    """
    shift = next((s for s in signs_of(loops, compliance) if s.name == "top_shift"), None)
    if shift is None:
        return None
    later, earlier = (
        float(np.abs(weights) @ branch.path.time_s / np.abs(weights).sum())
        for branch, weights in shift.terms
    )
    period_s = later - earlier
    if not period_s > 0.0:
        return None
    quantum = math.sqrt(2.0) * sources.quantum_left_m
    samples = max(float(loops[0].loading.path.count.max()), 1.0)
    noise = math.sqrt(2.0 / samples) * sources.position_noise_m
    tops = Drift(shift.value_m / period_s, math.hypot(quantum, noise) / period_s)
    held = _held(loops, compliance, sources)
    if held is None:
        return tops
    apart = abs(held.rate_m_per_s - tops.rate_m_per_s)
    return held if apart > SIGMAS * math.hypot(held.sigma_m_per_s, tops.sigma_m_per_s) else tops


def _held(loops: Sequence[Loop], compliance: Compliance, sources: Sources) -> Drift | None:
    """Drift within the holds of loading and unloading; None without both.

    A payload that creeps goes one way while loading and the other way while unloading.
    """
    both = _rates(loops[:2], compliance, sources)
    if len(both) < 2:
        return None
    rate_m_per_s = 0.5 * sum(each.rate_m_per_s for each in both)
    return Drift(rate_m_per_s, 0.5 * math.hypot(*(each.sigma_m_per_s for each in both)))


def stated_drift(
    loops: Sequence[Loop], found: Drift | None, compliance: Compliance, sources: Sources
) -> float | None:
    """The stated standard uncertainty of a drift in m/s; None where nobody states one, or where the
    cycles, or the holds of one cycle, show more."""
    stated = sources.travel_drift_m_per_s
    shown = found or _held(loops, compliance, sources)
    if stated is None or shown is None:
        return stated
    most = SIGMAS * math.hypot(stated, shown.sigma_m_per_s)
    return stated if abs(shown.rate_m_per_s) <= most else None


def largest_in_holds(loops: Sequence[Loop], compliance: Compliance, sources: Sources) -> float:
    """Bound of a drift in the first cycle in m/s; inf without holds.

    Creep and drift that cancel in the holds of one way add in those of the other.
    """
    found = _rates(loops[:1], compliance, sources)
    return max((math.hypot(each.rate_m_per_s, each.sigma_m_per_s) for each in found),
               default=math.inf)  # fmt: skip


def _rates(loops: Sequence[Loop], compliance: Compliance, sources: Sources) -> list[Drift]:
    """What goes on in the holds of the loadings, and in those of the unloadings, where there are
    such."""
    found = []
    for unloading in (False, True):
        branches = [loop.unloading if unloading else loop.loading for loop in loops]
        holds = [hold for branch in branches if branch is not None for hold in branch.holds]
        if (rate := _rate(holds, compliance, sources)) is not None:
            found.append(rate)
    return found


def _rate(holds: Sequence[Hold], compliance: Compliance, sources: Sources) -> Drift | None:
    lasted_s = BETWEEN * sum(hold.lasted_s for hold in holds)
    if not lasted_s > 0.0:
        return None
    soft = [compliance(hold.force_n) for hold in holds]
    creeps = [hold.creep(each) for hold, each in zip(holds, soft, strict=True)]
    rate = sum(creeps) / lasted_s
    noise = sum(
        2.0 * (sources.position_noise_m**2
               + (each * sources.force_noise_n) ** 2) / max(hold.samples, 1)
        + 2.0 * sources.quantum_left_m**2 for hold, each in zip(holds, soft, strict=True)
    )  # fmt: skip
    # Where the holds differ by more, one of them may hold a slip: what they scatter by counts.
    pace = np.array(creeps)
    apart = pace - BETWEEN * rate * np.array([hold.lasted_s for hold in holds])
    scatter = float(apart @ apart) * len(holds) / max(len(holds) - 1, 1)
    return Drift(rate, math.sqrt(max(noise, scatter)) / lasted_s)


def without_drift(loop: Loop, rate_m_per_s: float, start_s: float) -> Loop:
    """A cycle whose travel, deformation and holds have the drift since `start_s` subtracted."""

    def corrected(branch: Branch) -> Branch:
        gone = rate_m_per_s * (branch.path.time_s - start_s)
        path = replace(branch.path, travel_m=branch.path.travel_m - gone)
        holds = tuple(
            replace(hold, crept_m=hold.crept_m - BETWEEN * rate_m_per_s * hold.lasted_s)
            for hold in branch.holds
        )
        return Branch(path, branch.deformation_m - gone, holds)

    unloading = corrected(loop.unloading) if loop.unloading is not None else None
    return replace(loop, loading=corrected(loop.loading), unloading=unloading)
