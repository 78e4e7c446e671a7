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

from stepload.estimators.blocks import Blocks, blocks, quantum_sigma
from stepload.estimators.fit import Fit, FloatArray, Missing, law_compliance
from stepload.estimators.sources import Sources

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
        per_decade: creep per decade of time since the middle of the ramp, relative to the
            deformation, from the holds on the way up.
        per_decade_sigma: its standard uncertainty.
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
    per_decade: float
    per_decade_sigma: float
    drift_m_per_s: float | None
    drift_sigma_m_per_s: float | None
    resolved: bool
    why: str


class _Rest(NamedTuple):
    """One hold as it is fitted: blocks after the skip, and u against the first of them (B,).

    `law_m` is the deformation by the law, `m_per_n` the compliance of contact and system.
    """

    data: Blocks
    change_m: FloatArray
    loading: bool
    law_m: float
    m_per_n: float


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
    rests = _rests(holds, fit, sources)
    if not rests:
        longest = max((float(np.ptp(h.time_s)) for h in holds if h.time_s.size), default=0.0)
        return Missing(
            f"no hold of at least {SKIP_S + SHORTEST_S:.1f} s (of {len(holds)}, the longest is "
            f"{longest:.3g} s)"
        )
    if not any(rest.loading for rest in rests):
        return Missing("no hold on the way up")
    changes = tuple(_change(rest, sources) for rest in rests)
    both = any(not rest.loading for rest in rests)
    past = blocks(time_s, force_n, force_n)
    elastic_m = _law(fit, past.force_n)
    longest_s = max(float(np.ptp(rest.data.time_s)) for rest in rests)
    taus = np.geomspace(SHORTEST_TIME_S, LONGEST_TIMES * longest_s, _TIMES)
    whitened = [_Whitened.of(rest, sources) for rest in rests]
    tried = [_Fitted.of(float(tau), past.time_s, elastic_m, rests, whitened, both=both)
             for tau in taus]  # fmt: skip
    costs = np.array([each.cost for each in tried])
    best = tried[int(np.argmin(costs))]
    near = np.flatnonzero(costs <= best.cost + 4.0 * best.excess)
    # The grid is coarse: the ends are the first times that the data exclude.
    # The time is not known: the creep of all times that fit counts as its range of 95 %.
    among = [tried[i].creep for i in near]
    sigma = math.hypot(best.sigma, 0.25 * (max(among) - min(among)))
    best = best._replace(sigma=sigma)
    low = float(taus[near[0] - 1]) if near[0] > 0 else None
    high = float(taus[near[-1] + 1]) if near[-1] + 1 < len(taus) else None
    resolved = best.creep > RESOLVED * best.sigma
    known = resolved and low is not None and high is not None
    slope, slope_sigma = _per_decade(rests, sources, best.drift if both else 0.0)
    force_share = fit.n * best.creep
    return Relaxation(
        holds=changes,
        creep_share=best.creep,
        creep_sigma=best.sigma,
        relaxation_share=force_share / (1.0 + force_share) if force_share > -0.5 else force_share,
        time_s=best.tau_s if known else None,
        time_interval_s=(low, high) if resolved else (None, None),
        per_decade=slope,
        per_decade_sigma=slope_sigma,
        drift_m_per_s=best.drift if both else None,
        drift_sigma_m_per_s=best.drift_sigma if both else None,
        resolved=resolved,
        why=_why(best, resolved=resolved, known=known, both=both, longest_s=longest_s),
    )


def _why(best: _Fitted, *, resolved: bool, known: bool, both: bool, longest_s: float) -> str:
    if best.creep < -RESOLVED * best.sigma:
        return (
            f"{best.creep:+.1%} ± {best.sigma:.1%}: the contact seems to recover under load, which "
            "is no creep of it; a drift or the system's own creep"
        )
    if not resolved:
        return (
            f"not resolved: {best.creep:+.1%} is not beyond {RESOLVED:g} × {best.sigma:.1%}, what "
            "noise and quanta alone may show"
        )
    said = [] if known else [f"holds of {longest_s:.2g} s do not bound the time"]
    if not both:
        said.append("no holds on the way down: a drift of the travel would be in it")
    return "; ".join(said)


def _law(fit: Fit, force_n: FloatArray) -> FloatArray:
    """Deformation by the law (N,) in m; 0 without force."""
    return np.asarray((np.maximum(force_n, 0.0) / fit.k) ** (1.0 / fit.n))


def _rests(holds: Sequence[HoldSamples], fit: Fit, sources: Sources) -> list[_Rest]:
    found = []
    for hold in holds:
        if hold.time_s.size < 2:
            continue
        keep = hold.time_s >= hold.time_s[0] + SKIP_S
        if not keep.any() or float(np.ptp(hold.time_s[keep])) < SHORTEST_S:
            continue
        data = blocks(hold.time_s[keep], hold.deformation_m[keep], hold.force_n[keep])
        mean_n = float(data.force_n.mean())
        if data.time_s.size < LEAST_BLOCKS or not mean_n > 0.0:
            continue
        compliance = float(law_compliance(fit, np.array([mean_n]))[0])
        change_m = (data.deformation_m - data.deformation_m[0]) - compliance * (
            data.force_n - data.force_n[0]
        )
        law_m = float(_law(fit, np.array([mean_n]))[0])
        m_per_n = compliance + sources.system_m_per_n
        found.append(_Rest(data, change_m, hold.loading, law_m, m_per_n))
    return found


def _white_m(rest: _Rest, sources: Sources) -> FloatArray:
    """Standard deviation (B,) of u in each block: the larger of the stated and the observed one."""
    stated = np.hypot(sources.force_noise_n * rest.m_per_n, sources.position_noise_m)
    steps = np.diff(rest.change_m, 2)
    seen = float(np.sqrt(np.mean(steps**2) / 6.0)) if steps.size else 0.0
    return np.asarray(np.maximum(stated / np.sqrt(rest.data.samples), seen))


def _ramp_m(rest: _Rest, sources: Sources) -> float:
    """Standard uncertainty of u from the first block to the last that quantisation may cause.

    A constant reading may hide a motion of up to a quantum: an error of q/√12 at either end, unless
    noise carries the readings over the edges.
    """
    position = quantum_sigma(sources.position_resolution_m, sources.position_noise_m)
    force = quantum_sigma(sources.force_resolution_n, sources.force_noise_n) * rest.m_per_n
    return math.sqrt(2.0) * math.hypot(position, force)


def _change(rest: _Rest, sources: Sources) -> HoldChange:
    """The change by a straight line through the blocks of a hold, over its whole length."""
    time_s = rest.data.time_s - rest.data.time_s.mean()
    line = time_s / float(time_s @ time_s)
    lasted_s = float(np.ptp(rest.data.time_s))
    white = _white_m(rest, sources)
    change_m = float(line @ rest.change_m) * lasted_s
    sigma_m = math.hypot(
        lasted_s * float(np.sqrt(np.sum((line * white) ** 2))), _ramp_m(rest, sources)
    )
    return HoldChange(
        force_n=float(rest.data.force_n.mean()),
        loading=rest.loading,
        lasted_s=lasted_s,
        force_change_n=float(line @ rest.data.force_n) * lasted_s,
        deformation_change_m=change_m,
        sigma_m=sigma_m,
        relative=change_m / rest.law_m,
        resolved=abs(change_m) > RESOLVED * sigma_m,
    )


def _lagging(time_s: FloatArray, elastic_m: FloatArray, tau_s: float) -> FloatArray:
    """z (N,) of dz/dt = (e − z)/τ, z = 0 at first, e taken as straight between the times."""
    gap = np.diff(time_s)
    ratio = gap / tau_s
    decay = np.exp(-ratio)
    # Exact for a straight e: z' = z q + e0 (g − q) + e1 (1 − g), g = (1 − q)/ratio.
    share = np.where(ratio > 1e-9, -np.expm1(-ratio) / np.maximum(ratio, 1e-9), 1.0)
    add = elastic_m[:-1] * (share - decay) + elastic_m[1:] * (1.0 - share)
    z, found = 0.0, [0.0]
    for keep, more in zip(decay.tolist(), add.tolist(), strict=True):
        z = z * keep + more
        found.append(z)
    return np.array(found)


class _Whitened(NamedTuple):
    """One hold as unit white noise: (B, B) maps that remove its zero and weight the rest.

    The error hidden by the quanta is modelled as a random walk within the hold: it may creep or
    jump at any time. The walk's first modes, `walk` (B, M) orthonormal with `shrink` (M,), are
    weighed down by the inverse root of I + H Hᵀ.
    """

    weight: FloatArray
    walk: FloatArray
    shrink: FloatArray

    @classmethod
    def of(cls, rest: _Rest, sources: Sources) -> _Whitened:
        white = np.maximum(_white_m(rest, sources), _LEAST_M)
        weight = 1.0 / white
        share = np.linspace(0.0, 1.0, white.size)
        half = np.pi * (np.arange(min(_MODES, white.size - 1)) + 0.5)
        modes = np.sqrt(2.0) * np.sin(share[:, None] * half) / half * _ramp_m(rest, sources)
        bare = (modes - np.average(modes, axis=0, weights=weight**2)) * weight[:, None]
        walk, size, _ = np.linalg.svd(bare, full_matrices=False)
        return cls(weight, walk, 1.0 - 1.0 / np.sqrt(1.0 + size**2))

    def apply(self, values: FloatArray) -> FloatArray:
        """`values` (B,) without their weighted mean, in standard deviations."""
        made = (values - np.average(values, weights=self.weight**2)) * self.weight
        return np.asarray(made - self.walk @ (self.shrink * (self.walk.T @ made)))


class _Fitted(NamedTuple):
    """The best creep and drift for one time τ; `cost` is χ², `excess` what it exceeds its degrees
    of freedom by, at least 1."""

    tau_s: float
    cost: float
    excess: float
    creep: float
    sigma: float
    drift: float
    drift_sigma: float

    @classmethod
    def of(
        cls, tau_s: float, past_s: FloatArray, elastic_m: FloatArray, rests: Sequence[_Rest],
        whitened: Sequence[_Whitened], *, both: bool,
    ) -> _Fitted:  # fmt: skip
        z_m = _lagging(past_s, elastic_m, tau_s)
        # Normal equations per hold: (H, P, P) and (H, P).
        normal, moment, square, count = [], [], 0.0, 0
        for rest, white in zip(rests, whitened, strict=True):
            rows = [white.apply(np.interp(rest.data.time_s, past_s, z_m))]
            if both:
                rows.append(white.apply(rest.data.time_s - rest.data.time_s[0]))
            a, y = np.stack(rows), white.apply(rest.change_m)
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
        sigma = np.sqrt(variance)
        drift, drift_sigma = (float(theta[1]), float(sigma[1])) if both else (0.0, 0.0)
        return cls(tau_s, cost, excess, float(theta[0]), float(sigma[0]), drift, drift_sigma)


def _inverse(matrix: FloatArray) -> FloatArray:
    """The pseudo-inverse of normal equations whose unknowns differ in size."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inner = np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-10)
    return np.asarray(inner * np.outer(scale, scale))


def _per_decade(
    rests: Sequence[_Rest], sources: Sources, drift_m_per_s: float
) -> tuple[float, float]:
    """Creep per decade of time and its sigma, pooled over the holds on the way up."""
    top = bottom = hidden = noise = 0.0
    for rest in rests:
        if not rest.loading:
            continue
        since_s = rest.data.time_s - rest.data.time_s[0] + SKIP_S
        decades = np.log10(since_s)
        decades = decades - decades.mean()
        weight = rest.law_m
        drifted = rest.change_m - drift_m_per_s * (rest.data.time_s - rest.data.time_s[0])
        top += weight * float(decades @ drifted)
        bottom += weight**2 * float(decades @ decades)
        share = np.linspace(-0.5, 0.5, decades.size)
        hidden += (weight * float(decades @ share) * _ramp_m(rest, sources)) ** 2
        noise += weight**2 * float(np.sum((decades * _white_m(rest, sources)) ** 2))
    return top / bottom, math.sqrt(hidden + noise) / bottom
