"""Damping after Hunt and Crossley, F = K δⁿ (1 + (3/2) α δ̇): what the ramps show against the holds.

With d = (3/2) α in s/m, the dissipation that Drake takes, a slow ramp shows δ = g(F) − (δ/n) δ̇ d to
first order, g the static law. A force that comes late by τ shows δ = g(F) + τ δ̇: the two differ by
a factor of δ alone, d ≡ −n τ/δ. A run that ramps at one rate hardly tells them apart, so the
uncertainty holds a lag of 1 ms at least, whatever the alignment says of itself: it was measured on
the same ramps and would take the damping with it.

Where K_s was taken out, the damper of the system is in the chain as well (a rig of C_s = 40 kN s/m
and K_s = 3.5 MN/m answers late by 11 ms). What is found is then a bound for the payload, not its
damping. "Not determined" is the usual answer for a quasi-static press.

K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.estimators.blocks import BLOCK_S, blocks
from stepload.estimators.fit import BoolArray, Fit, FloatArray
from stepload.estimators.missing import Missing
from stepload.estimators.sensitivity import law_compliance
from stepload.estimators.smooth import NORMAL_95, propagate_smooth, smooth_lengths
from stepload.estimators.sources import Sources

NEAR_BLOCKS = 3
"""Blocks on either side over which a rate is taken; left out where the rate changes."""
LEAST_LAG_SIGMA_S = 1e-3
"""Least standard uncertainty of the time alignment that is used here."""
AT_REST, SLOW, FAST = 0.1, 0.4, 0.6
"""Shares of the fastest rate: at rest below the first; the rate varied if there are blocks below
the second and above the third."""
RATE_OF_NOISE = 10.0
"""Least ratio of the fastest rate to the rate that force noise causes at rest."""
LEAST_BLOCKS = 10
_ROUNDS = 4
LOWEST_SHARE = 0.05
"""Blocks below this share of the top force are left out: there the law is not accurate enough."""


@dataclass(frozen=True, slots=True)
class HuntCrossley:
    """Dependence of the force on the rate of deformation.

    Attributes:
        dissipation_s_per_m: d of F = K δⁿ (1 + d δ̇); None where it is not determined.
        interval_s_per_m: its 95 % interval; None where it is not determined.
        upper_bound_s_per_m: 97.5 % upper bound of the payload's d.
        sigma_s_per_m: standard uncertainty of d from all sources.
        lag_sigma_s_per_m: contribution of the lag to it.
        lag_sigma_s: standard uncertainty of the lag that was used.
        rates_m_per_s: slowest and fastest rate of deformation.
        why: a sentence: why it is not determined, or what it includes.
    """

    dissipation_s_per_m: float | None
    interval_s_per_m: tuple[float, float] | None
    upper_bound_s_per_m: float
    sigma_s_per_m: float
    lag_sigma_s_per_m: float
    lag_sigma_s: float
    rates_m_per_s: tuple[float, float]
    why: str

    @property
    def alpha_s_per_m(self) -> float | None:
        """α = 2 d/3 in s/m, as Hunt and Crossley write it."""
        d = self.dissipation_s_per_m
        return None if d is None else 2.0 * d / 3.0


def hunt_crossley(
    time_s: FloatArray,
    deformation_m: FloatArray,
    force_n: FloatArray,
    fit: Fit,
    sources: Sources,
    *,
    lag_corrected_s: float = 0.0,
) -> HuntCrossley | Missing:
    """Damping of a contact from a loading with ramps and holds.

    Args:
        time_s, deformation_m, force_n: (N,) the loading in the order of time; the payload's
            deformation, K_s taken out.
        fit: its static law.
        sources: noise, quanta, smooth error, K_s; `lag_sigma_s` where it is above 1 ms.
        lag_corrected_s: the lag that was taken out of the data; not 0: damping went with it.
    """
    if lag_corrected_s != 0.0:
        return Missing(
            f"not determined: a lag of {lag_corrected_s * 1e3:.3g} ms was measured on these ramps "
            "and taken out, and damping with it"
        )
    if time_s.size < 2:
        return Missing("not determined: there is no loading")
    data = blocks(time_s, deformation_m, force_n)
    top_n = float(data.force_n.max())
    rate_n, steady = _rates(data.time_s, data.force_n)
    keep = steady & (data.force_n > max(LOWEST_SHARE * top_n, 0.0))
    if int(keep.sum()) < 2 * LEAST_BLOCKS:
        return Missing(
            f"not determined: {int(keep.sum())} blocks of {BLOCK_S * 1e3:.0f} ms at a steady rate, "
            f"{2 * LEAST_BLOCKS} are needed"
        )
    x_m, f_n, count = data.deformation_m[keep], data.force_n[keep], data.samples[keep]
    compliance = law_compliance(fit, f_n)
    rate_m = rate_n[keep] * compliance
    fast = _tenth_largest(np.abs(rate_m))
    ramps = _tenth_largest(np.abs(rate_n[keep])) >= FAST * _tenth_largest(np.abs(rate_n))
    slow = float(np.abs(rate_m).min())
    noise_m = sources.force_noise_n * float(np.median(compliance / np.sqrt(count)))
    if not ramps or fast < RATE_OF_NOISE * math.sqrt(2.0) * noise_m / (2 * NEAR_BLOCKS * BLOCK_S):
        return Missing(
            f"not determined: no ramp of {(2 * NEAR_BLOCKS + 1) * BLOCK_S:.2g} s or more that "
            "stands out of the noise"
        )
    rest, moving = np.abs(rate_m) < SLOW * fast, np.abs(rate_m) > FAST * fast
    if min(int(rest.sum()), int(moving.sum())) < LEAST_BLOCKS:
        return Missing(
            "not determined: the rate did not vary enough "
            f"({slow * 1e6:.3g} to {fast * 1e6:.3g} µm/s)"
        )
    d, columns, row = 0.0, x_m[:, None], x_m
    for _ in range(_ROUNDS):
        static_n = f_n / np.maximum(1.0 + d * rate_m, 0.5)
        columns = _columns(fit, static_n, rate_m)
        scale = np.linalg.norm(columns, axis=0)
        if np.linalg.cond(columns / scale) > 1e8:
            return Missing("not determined: ramps and holds are not at the same forces")
        row = np.linalg.pinv(columns / scale)[-1] / scale[-1]
        d += float(row @ x_m)
    sigma, lag, lag_s = _sigmas(row, x_m, f_n, count, rate_m, compliance, columns, sources)
    sigma = math.hypot(sigma, _creep(columns, x_m, np.abs(rate_m) < AT_REST * fast))
    return _judged(d, sigma, lag, lag_s, (slow, fast), sources)


def _tenth_largest(values: FloatArray) -> float:
    """The `LEAST_BLOCKS`-th largest value, so that single outliers do not count as a ramp."""
    return float(np.sort(values)[-min(LEAST_BLOCKS, values.size)])


def _rates(time_s: FloatArray, force_n: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Force rate (B,) over the neighbours, and where it is steady: no edge of a ramp, no gap."""
    reach = NEAR_BLOCKS
    rate, steady = np.zeros_like(force_n), np.zeros(force_n.size, dtype=bool)
    if force_n.size <= 2 * reach:
        return rate, steady
    late, early, middle = slice(2 * reach, None), slice(None, -2 * reach), slice(reach, -reach)
    span_s = time_s[late] - time_s[early]
    after = (force_n[late] - force_n[middle]) / (time_s[late] - time_s[middle])
    before = (force_n[middle] - force_n[early]) / (time_s[middle] - time_s[early])
    rate[middle] = (force_n[late] - force_n[early]) / span_s
    usual = _tenth_largest(np.abs(rate[middle]))
    whole = span_s < 1.5 * 2 * reach * BLOCK_S
    steady[middle] = whole & (np.abs(after - before) < 0.2 * usual)
    return rate, steady


def _columns(fit: Fit, force_n: FloatArray, rate_m: FloatArray) -> FloatArray:
    """(B, 6): a static law free to differ from the fitted one, and the damping last."""
    shape = (force_n / float(force_n.max())) ** (1.0 / fit.n)
    deep_m = (force_n / fit.k) ** (1.0 / fit.n)
    return np.stack(
        [np.ones_like(shape), shape, shape * np.log(shape), shape**2, shape**3,
         -deep_m / fit.n * rate_m],
        axis=1,
    )  # fmt: skip


def _sigmas(
    row: FloatArray,
    deformation_m: FloatArray,
    force_n: FloatArray,
    count: FloatArray,
    rate_m: FloatArray,
    compliance: FloatArray,
    columns: FloatArray,
    sources: Sources,
) -> tuple[float, float, float]:
    """Standard uncertainty of d, the share of the lag in it, and the lag that counted in s."""
    stiffness, rigid = sources.system_stiffness_n_per_m, sources.system_m_per_n
    force_m = sources.force_noise_n * (compliance + rigid)
    white = row**2 @ ((force_m**2 + sources.position_noise_m**2) / count)
    quantum, hidden = sources.position_resolution_m, 0.0
    if quantum > 0.0:
        place = np.floor((deformation_m + force_n * rigid) / quantum)
        _, cell = np.unique(place, return_inverse=True)
        hidden = quantum**2 / 12.0 * float(np.sum(np.bincount(cell, row) ** 2))
    smooth = sources.smooth_error_m**2 * max(
        float(propagate_smooth(row[None], force_n, length_n)[0, 0])
        for length_n in smooth_lengths(sources.smooth_length_n, float(force_n.max()))
    )
    bend = 0.0
    if stiffness:
        relative = sources.system_stiffness_sigma_n_per_m / stiffness
        bend = float(row @ (force_n * rigid)) * relative
    lag_s = max(sources.lag_sigma_s, LEAST_LAG_SIGMA_S)
    lag = abs(float(row @ rate_m)) * lag_s
    # What the residuals show beyond the stated sources counts as noise between stretches.
    left = deformation_m - columns @ (np.linalg.pinv(columns) @ deformation_m)
    seen = float(np.mean(left**2)) * float(row @ row) * 2.0 * NEAR_BLOCKS
    known = float(white) + hidden + smooth
    return math.sqrt(max(known, seen) + bend**2 + lag**2), lag, lag_s


def _creep(columns: FloatArray, deformation_m: FloatArray, rest: BoolArray) -> float:
    """How far d moves between the early and the late halves of the holds: creep looks like
    damping that goes on. 0 where a half has too few blocks."""
    starts = np.flatnonzero(np.diff(rest.astype(np.int8), prepend=0) == 1)
    stops = np.flatnonzero(np.diff(rest.astype(np.int8), append=0) == -1) + 1
    early = ~rest
    late = ~rest
    for start, stop in zip(starts, stops, strict=True):
        middle = (start + stop + 1) // 2
        early[start:middle] = True
        late[middle:stop] = True
    found = []
    for part in (early, late):
        if int((part & rest).sum()) < LEAST_BLOCKS // 2:
            return 0.0
        chosen = columns[part]
        scale = np.linalg.norm(chosen, axis=0)
        found.append(float((np.linalg.pinv(chosen / scale) @ deformation_m[part])[-1] / scale[-1]))
    return abs(found[1] - found[0])


def _judged(
    d: float, sigma: float, lag: float, lag_s: float, rates: tuple[float, float], sources: Sources
) -> HuntCrossley:
    half = NORMAL_95 * sigma
    value, interval = None, None
    if d <= half:
        why = (
            f"not determined: {d:.3g} s/m is not beyond ±{half:.3g} s/m, of which a lag of "
            f"{lag_s * 1e3:.3g} ms alone is {NORMAL_95 * lag:.3g} s/m"
        )
        if d < -half:
            why = (
                f"not determined: the force is smaller while it rises ({d:.3g} ± {half:.3g} s/m), "
                "as a lag or creep makes it, no damping"
            )
    elif sources.system_stiffness_n_per_m is not None:
        why = (
            f"not determined: {d:.3g} ± {half:.3g} s/m of payload and load path together; without "
            "a gauge across the contact it is a bound for the payload"
        )
    else:
        value, interval = d, (d - half, d + half)
        why = f"of the contact; a lag of {lag_s * 1e3:.3g} ms is in the interval"
    return HuntCrossley(
        dissipation_s_per_m=value,
        interval_s_per_m=interval,
        upper_bound_s_per_m=max(d, 0.0) + half,
        sigma_s_per_m=sigma,
        lag_sigma_s_per_m=lag,
        lag_sigma_s=lag_s,
        rates_m_per_s=rates,
        why=why,
    )
