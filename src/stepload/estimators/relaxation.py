"""Creep and relaxation in the holds: how the contact continues to give way at rest.

The engine holds the *arm*, so in a hold the travel stands still while the force falls and the
system springs back. Neither force nor deformation is constant; what the contact would have done at
constant force is, to first order,

    u(t) = Δδ − c ΔF,    c = dδ/dF of the law at that force,

and the relative force that it would have lost at constant deformation is n times u/δ. A record that
holds the force itself is covered by the same formula, with ΔF = 0.

The model is linear viscoelastic with one time: J(t)/J0 = 1 + a (1 − exp(−t/τ)). Then u = a z with
dz/dt = (e − z)/τ, where e is the instantaneous deformation that belongs to the force; its history
counts from the first contact on, so ramps of finite length and the recovery in the holds on the way
down are in it. A drift of the travel adds b t, with the same sign on the way up and down, where
creep turns its sign: with holds on both ways the two can be distinguished.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stepload.estimators.fit import Fit, FloatArray, Missing, law_compliance
from stepload.estimators.sources import Sources, quantum_left

BLOCK_S = 0.05
SKIP_S = 0.2
"""Time at the beginning of a hold that is skipped: the arm comes to rest and filters settle."""
SHORTEST_S = 0.4
"""Least duration of a hold after that."""
LEAST_BLOCKS = 6
LEAST_HOLDS = 4
"""Number of holds from which their scatter is used."""
RESOLVED = 3.0
"""Standard uncertainties from which a creep counts as resolved; 2 are not enough, since its time
was searched for."""
SHORTEST_TIME_S, LONGEST_TIMES = 0.5, 10.0
"""Range of the times τ that are tried: from this one, which the skipped beginning would hide, to
this multiple of the longest hold, beyond which creep is a straight line."""
_TIMES = 48
_LEAST_M = 1e-12
_MODES = 8


class HoldSamples(NamedTuple):
    """The samples of one hold: (N,) each, in the order of time."""

    time_s: FloatArray
    deformation_m: FloatArray
    force_n: FloatArray
    loading: bool


@dataclass(frozen=True, slots=True)
class HoldChange:
    """Change over one hold, from its first block to its last.

    Attributes:
        force_n: mean force of the hold.
        loading: on the way up.
        lasted_s: time between the two blocks.
        force_change_n: change of the force.
        deformation_change_m: u, change of the deformation reduced to constant force.
        sigma_m: its standard uncertainty from noise and quanta.
        relative: u over the deformation by the law at that force.
        resolved: whether it is beyond 3 σ.
    """

    force_n: float
    loading: bool
    lasted_s: float
    force_change_n: float
    deformation_change_m: float
    sigma_m: float
    relative: float
    resolved: bool


@dataclass(frozen=True, slots=True)
class Relaxation:
    """Creep compliance J(t)/J0 = 1 + a (1 − exp(−t/τ)) of the contact.

    Attributes:
        holds: each hold by itself.
        creep_share: a.
        creep_sigma: its standard uncertainty: noise, quanta, drift.
        relaxation_share: share of the force that is finally lost at constant deformation, n a/(1 +
            n a).
        time_s: τ; None where the holds do not bound it from both sides.
        time_interval_s: where the misfit rises by less than 4 of its own variances; an end that is
            not bounded by the data is None.
        drift_m_per_s: drift of the travel in the holds; None without holds on the way down: the
            creep then includes it.
        drift_sigma_m_per_s: its standard uncertainty.
        resolved: whether the creep exceeds what noise and quanta can cause.
        why: a sentence on how reliable the numbers are.
    """

    holds: tuple[HoldChange, ...]
    creep_share: float
    creep_sigma: float
    relaxation_share: float
    time_s: float | None
    time_interval_s: tuple[float | None, float | None]
    drift_m_per_s: float | None
    drift_sigma_m_per_s: float | None
    resolved: bool
    why: str


def relaxation(
    time_s: FloatArray,
    force_n: FloatArray,
    holds: Sequence[HoldSamples],
    fit: Fit,
    sources: Sources,
) -> Relaxation | Missing:
    """Creep and relaxation of a run.

    Args:
        time_s, force_n: (N,) the run from its first contact on, in the order of time: the history
            of the load. Where nothing is pressed the force counts as 0.
        holds: in the order of time; `deformation_m` of the payload, K_s taken out.
        fit: the law, for the compliance at each level.
        sources: noise and quanta; K_s for the noise of force in the deformation.
    """
    rests = [rest for hold in holds if (rest := _rest(hold, fit, sources)) is not None]
    if not rests:
        longest = max((float(np.ptp(h.time_s)) for h in holds if h.time_s.size), default=0.0)
        return Missing(
            f"no hold of at least {SKIP_S + SHORTEST_S:.1f} s (of {len(holds)}, the longest is "
            f"{longest:.3g} s)"
        )
    if not any(rest.change.loading for rest in rests):
        return Missing("no hold on the way up")
    both = any(not rest.change.loading for rest in rests)
    past_s, past_n = _blocks(time_s, force_n)[:2]
    elastic_m = np.asarray((np.maximum(past_n, 0.0) / fit.k) ** (1.0 / fit.n))
    longest_s = max(float(np.ptp(rest.time_s)) for rest in rests)
    taus = np.geomspace(SHORTEST_TIME_S, LONGEST_TIMES * longest_s, _TIMES)
    tried = [_fitted(_lagging(past_s, elastic_m, tau), past_s, rests, both) for tau in taus]
    costs = np.array([each.cost for each in tried])
    at = int(np.argmin(costs))
    best = tried[at]
    near = np.flatnonzero(costs <= best.cost + 4.0 * best.excess)
    # The time is not known: the creep of all times that fit counts as its range of 95 %.
    among = [float(tried[i].theta[0]) for i in near]
    creep = float(best.theta[0])
    sigma = math.hypot(float(best.sigma[0]), 0.25 * (max(among) - min(among)))
    # The grid is coarse: the ends are the first times that the data exclude.
    low = float(taus[near[0] - 1]) if near[0] > 0 else None
    high = float(taus[near[-1] + 1]) if near[-1] + 1 < len(taus) else None
    resolved = creep > RESOLVED * sigma
    known = resolved and low is not None and high is not None
    why = [] if known else [f"holds of {longest_s:.2g} s do not bound the time"]
    why += [] if both else ["no holds on the way down: a drift of the travel would be in it"]
    if creep < -RESOLVED * sigma:
        why = [f"{creep:+.1%} ± {sigma:.1%}: recovery under load is a drift or the system's creep"]
    elif not resolved:
        why = [
            f"not resolved: {creep:+.1%} is not beyond {RESOLVED:g} × {sigma:.1%}, what noise and "
            "quanta alone may show"
        ]
    force_share = fit.n * creep
    return Relaxation(
        holds=tuple(rest.change for rest in rests),
        creep_share=creep,
        creep_sigma=sigma,
        relaxation_share=force_share / (1.0 + force_share) if force_share > -0.5 else force_share,
        time_s=float(taus[at]) if known else None,
        time_interval_s=(low, high) if resolved else (None, None),
        drift_m_per_s=float(best.theta[1]) if both else None,
        drift_sigma_m_per_s=float(best.sigma[1]) if both else None,
        resolved=resolved,
        why="; ".join(why),
    )


def _blocks(time_s: FloatArray, *columns: FloatArray) -> list[FloatArray]:
    """Means (B,) of time and columns over blocks of `BLOCK_S` that hold a sample, and the count."""
    number = np.floor((time_s - time_s[0]) / BLOCK_S).astype(np.intp)
    count = np.bincount(number)
    used = count > 0
    # Times are taken from the first one: sums of large clock readings would lose digits.
    mean = [np.bincount(number, v)[used] / count[used] for v in (time_s - time_s[0], *columns)]
    return [mean[0] + time_s[0], *mean[1:], count[used].astype(np.float64)]


class _Rest(NamedTuple):
    """One hold as it is fitted: times (B,) of its blocks after the skip, u (B,) against the first
    of them, and what makes both unit white noise: weights (B,), modes (B, M), how much they shrink.

    The error hidden by the quanta is modelled as a random walk within the hold: it may creep or
    jump at any time. The walk's first modes are weighed down by the inverse root of I + H Hᵀ.
    """

    change: HoldChange
    time_s: FloatArray
    u_m: FloatArray
    weight: FloatArray
    walk: FloatArray
    shrink: FloatArray

    def whiten(self, values: FloatArray) -> FloatArray:
        """`values` (B,) without their weighted mean, in standard deviations."""
        made = (values - np.average(values, weights=self.weight**2)) * self.weight
        return np.asarray(made - self.walk @ (self.shrink * (self.walk.T @ made)))


def _rest(hold: HoldSamples, fit: Fit, sources: Sources) -> _Rest | None:
    """A hold without its beginning; None where it is too short."""
    keep = hold.time_s >= hold.time_s[:1] + SKIP_S
    if not keep.any() or float(np.ptp(hold.time_s[keep])) < SHORTEST_S:
        return None
    time, deformation, force, samples = _blocks(
        hold.time_s[keep], hold.deformation_m[keep], hold.force_n[keep]
    )
    mean_n = float(force.mean())
    if time.size < LEAST_BLOCKS or not mean_n > 0.0:
        return None
    compliance = float(law_compliance(fit, np.array([mean_n]))[0])
    u = (deformation - deformation[0]) - compliance * (force - force[0])
    m_per_n = compliance + sources.system_m_per_n
    # White noise of u in each block: the larger of the stated and the observed one.
    stated = math.hypot(sources.force_noise_n * m_per_n, sources.position_noise_m)
    seen = float(np.sqrt(np.mean(np.diff(u, 2) ** 2) / 6.0))
    white = np.maximum(np.maximum(stated / np.sqrt(samples), seen), _LEAST_M)
    # A constant reading may hide a motion of up to a quantum, at either end of the hold.
    of_force = quantum_left(sources.force_resolution_n, sources.force_noise_n) * m_per_n
    hidden_m = math.sqrt(2.0) * math.hypot(sources.quantum_left_m, of_force)
    # The change by a straight line through the blocks, over the whole length.
    off_s, lasted_s = time - time.mean(), float(np.ptp(time))
    line = off_s / float(off_s @ off_s) * lasted_s
    changed_m = float(line @ u)
    sigma_m = math.hypot(float(np.linalg.norm(line * white)), hidden_m)
    change = HoldChange(
        mean_n, hold.loading, lasted_s, float(line @ force), changed_m, sigma_m,
        changed_m / float((mean_n / fit.k) ** (1.0 / fit.n)), abs(changed_m) > RESOLVED * sigma_m,
    )  # fmt: skip
    weight = 1.0 / white
    half = np.pi * (np.arange(min(_MODES, white.size - 1)) + 0.5)
    share = np.linspace(0.0, 1.0, white.size)
    modes = math.sqrt(2.0) * np.sin(share[:, None] * half) / half * hidden_m
    bare = (modes - np.average(modes, axis=0, weights=weight**2)) * weight[:, None]
    walk, size, _ = np.linalg.svd(bare, full_matrices=False)
    return _Rest(change, time, u, weight, walk, 1.0 - 1.0 / np.sqrt(1.0 + size**2))


def _lagging(time_s: FloatArray, elastic_m: FloatArray, tau_s: float) -> FloatArray:
    """z (N,) of dz/dt = (e − z)/τ, z = 0 at first, e taken as straight between the times."""
    ratio = np.diff(time_s) / tau_s
    decay = np.exp(-ratio)
    # Exact for a straight e: z' = z q + e0 (g − q) + e1 (1 − g), g = (1 − q)/ratio.
    share = np.where(ratio > 1e-9, -np.expm1(-ratio) / np.maximum(ratio, 1e-9), 1.0)
    add = elastic_m[:-1] * (share - decay) + elastic_m[1:] * (1.0 - share)
    z, found = 0.0, [0.0]
    for keep, more in zip(decay.tolist(), add.tolist(), strict=True):
        z = z * keep + more
        found.append(z)
    return np.array(found)


class _Fitted(NamedTuple):
    """Creep and drift of one time τ, their σ, χ², and by what factor it exceeds its degrees of
    freedom, at least 1."""

    cost: float
    excess: float
    theta: FloatArray
    sigma: FloatArray


def _fitted(z_m: FloatArray, past_s: FloatArray, rests: Sequence[_Rest], both: bool) -> _Fitted:
    normal, moment, square, count = [], [], 0.0, 0
    for rest in rests:
        rows = [rest.whiten(np.interp(rest.time_s, past_s, z_m))]
        if both:
            rows.append(rest.whiten(rest.time_s - rest.time_s[0]))
        a, y = np.stack(rows), rest.whiten(rest.u_m)
        normal.append(a @ a.T)
        moment.append(a @ y)
        square += float(y @ y)
        count += y.size - 1
    whole, right = np.sum(normal, axis=0), np.sum(moment, axis=0)
    inverse = _inverse(whole)
    theta = inverse @ right
    cost = max(square - float(theta @ right), 0.0)
    excess = max(cost / max(count - len(theta), 1), 1.0)
    variance = excess * np.diag(inverse)
    if len(rests) >= LEAST_HOLDS:
        # Jackknife: each hold is left out in turn. An error of a whole hold, such as a reading
        # that jumps by a quantum, shows in how much the result depends on it.
        left = [_inverse(whole - n) @ (right - m) for n, m in zip(normal, moment, strict=True)]
        variance = np.maximum(variance, (len(rests) - 1) * np.var(left, axis=0))
    return _Fitted(cost, excess, theta, np.sqrt(variance))


def _inverse(matrix: FloatArray) -> FloatArray:
    """The pseudo-inverse of normal equations whose unknowns differ in size."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inner = np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-10)
    return np.asarray(inner * np.outer(scale, scale))
