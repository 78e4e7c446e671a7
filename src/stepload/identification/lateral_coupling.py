"""Effect of the force across the pressing axis (lateral force) on the travel along it.

Where friction holds the tip of an arm laterally, the arm is stiffer along the axis. Three numbers
describe this for any friction (six axes, item 1)::

    δ = s − δ_s(F) − c · (F_across − t₀ F)

δ_s is the deflection as it was measured, at the shares t₀ of force across over force along: only
there are the errors of δ_s and of c uncorrelated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray, IntArray
from stepload.identification.smooth import (
    LinearFit,
    few_degrees,
    fit_with_smooth_error,
    smooth_lengths,
)
from stepload.identification.system_stiffness import Cells, SeriesContact

Pair = tuple[float, float]

CROSS_COMPLIANCE = 0.6
"""Standard deviation of C_xz/C_zz along each lateral axis, for a serial arm whose coupling is
unknown. |C_xz|/C_zz over tool-down poses has a 90th percentile of 1.3 (UR3), 0.86 (UR5), 0.88
(UR10), joint stiffnesses assumed; two independent axes with this deviation give 1.29."""
EXTRAPOLATED = 1.5
"""Beyond this multiple of the calibrated shares, the error of c counts as for an unknown arm."""


@dataclass(frozen=True, slots=True)
class Across:
    """What is known of the coupling: c with its covariance, and the shares of the calibration.

    Attributes:
        per_newton_m: c in m/N for the sensor's two axes across; None where it is not known.
        at_share: t₀; None where it is not known under which friction K_s was measured.
        reach: largest distance from t₀ of the shares that c was measured with.
        stated: whether a person states K_s, whose σ then holds for the friction of this contact.
    """

    per_newton_m: Pair | None = None
    sigma_m_per_n: Pair = (0.0, 0.0)
    correlation: float = 0.0
    at_share: Pair | None = None
    reach: float = 0.0
    stated: bool = False

    @property
    def covariance(self) -> FloatArray:
        """Covariance (2, 2) of c in (m/N)²."""
        size = np.array(self.sigma_m_per_n)
        alike = np.array([[1.0, self.correlation], [self.correlation, 1.0]])
        return np.asarray(alike * np.outer(size, size))

    def away(self, share: FloatArray) -> FloatArray:
        """Shares (2,) less those of the calibration, which count as 0 where they are not known."""
        return np.asarray(share - np.array(self.at_share or (0.0, 0.0)))

    def taken_m(self, force_n: FloatArray, across_n: FloatArray) -> FloatArray:
        """Travel (N,) in m caused by the lateral forces (N, 2) at the axial forces (N,)."""
        if self.per_newton_m is None:
            return np.zeros_like(force_n)
        share = np.array(self.at_share or (0.0, 0.0))
        return np.asarray((across_n - np.outer(force_n, share)) @ np.array(self.per_newton_m))

    def errors_m_per_n(self, share: FloatArray, stiffness_n_per_m: float) -> tuple[float, ...]:
        """Errors in m of the correction per newton of axial force, at shares (2,).

        One signed standard uncertainty for each independent cause, from the covariance of c; the
        part of the share beyond `EXTRAPOLATED` times the calibrated shares counts as for an unknown
        arm. So does the whole share where its direction is opposite to that of the calibration, as
        after the sensor was turned.
        """
        away = self.away(share)
        size = float(np.linalg.norm(away))
        beyond = away * max(0.0, 1.0 - EXTRAPOLATED * self.reach / size) if size > 0.0 else away
        if float(share @ np.array(self.at_share or (0.0, 0.0))) < 0.0:
            beyond = max(beyond, share, key=lambda each: float(np.linalg.norm(each)))
        (one, other), alike = self.sigma_m_per_n, self.correlation
        own = (
            one * away[0] + alike * other * away[1],
            other * math.sqrt(max(1.0 - alike**2, 0.0)) * away[1],
        )
        return tuple(float(e) for e in (*own, *(CROSS_COMPLIANCE / stiffness_n_per_m * beyond)))

    def noise_m(self, noise_n: float) -> float:
        """Noise in m that the correction adds, for an rms noise of the lateral force."""
        if self.per_newton_m is None or not math.isfinite(noise_n):
            return 0.0
        return math.hypot(*self.per_newton_m) * noise_n / math.sqrt(2.0)


LEAST_GAIN = 0.5
"""A direction counts as measured where σ(c) is below this share of the value assumed for any
arm."""
MIN_FORCE = 0.4
"""Forces below this share of the largest are left out, as for K_s."""


@dataclass(frozen=True, slots=True)
class AcrossFit:
    """Result of the fit.

    Attributes:
        across: the shares at which K_s was measured; c with its covariance if a direction was
            measured.
        directions: (D, 2) unit vectors across, in which c was measured; D from 0 to 2.
        sigma_m_per_n: (D,) standard uncertainty of c along each.
        shares: (R, 2) force across over force along, run by run.
        stiffness_n_per_m: K_s from all runs, with c = 0.
    """

    across: Across
    directions: FloatArray
    sigma_m_per_n: FloatArray
    shares: FloatArray
    stiffness_n_per_m: float


def fit_across(
    runs: Sequence[Cells],
    *,
    contacts: Sequence[SeriesContact | None],
    length_n: float | None = None,
) -> AcrossFit:
    """Fit c to all runs together.

    Args:
        runs: cells of each run, `across_n` (M, 2).
        contacts: the contact in series with each; None where it is not known.
        length_n: correlation length of the smooth error; None: the worst that it may be.

    Raises:
        DomainError: there is no run, or the travel does not rise with the force.
    """
    if not runs:
        raise DomainError("there is no run")
    top_n = min(float(each.force_n.max()) for each in runs)
    kept = [each.force_n >= MIN_FORCE * top_n for each in runs]
    number = np.concatenate([np.full(int(k.sum()), i) for i, k in enumerate(kept)])
    force, across, rate = (
        np.concatenate([getattr(each, name)[k] for each, k in zip(runs, kept, strict=True)])
        for name in ("force_n", "across_n", "rate_m_s")
    )
    travel = np.concatenate([
        each.displacement_m[k]
        - (0.0 if contact is None else contact.deformation_m(each.force_n[k]))
        for each, k, contact in zip(runs, kept, contacts, strict=True)
    ])  # fmt: skip
    shares = np.stack(
        [force[number == i] @ across[number == i] / np.sum(force[number == i] ** 2)
         for i in range(len(runs))]
    )  # fmt: skip
    zeros = np.stack([(number == i).astype(float) for i in range(len(runs))], axis=1)
    base = np.column_stack([zeros, rate]) if float(np.ptp(rate)) > 0.0 else zeros
    lone = _left(force[:, None], base)[:, 0]
    at = lone @ across / float(lone @ force)
    apart = across - np.outer(force, at)
    reach = float(np.linalg.norm(shares - at, axis=1).max())
    stiffness = float(lone @ force) / float(lone @ travel)
    if not stiffness > 0.0:
        raise DomainError("the travel does not rise with the force", hint="check both signs")
    assumed = CROSS_COMPLIANCE / stiffness
    found = _directions(
        np.column_stack([base, force]), apart, travel, force, number,
        lengths=smooth_lengths(length_n, top_n), most=LEAST_GAIN * assumed,
    )  # fmt: skip
    told: Pair = (float(at[0]), float(at[1]))
    if not found:
        return AcrossFit(Across(at_share=told), np.zeros((0, 2)), np.zeros(0), shares, stiffness)
    directions = np.stack([direction for direction, _, _ in found])
    sigmas = np.array([sigma for _, _, sigma in found])
    c = np.array([value for _, value, _ in found]) @ directions
    rest = np.eye(2) - directions.T @ directions
    covariance = directions.T @ np.diag(sigmas**2) @ directions + assumed**2 * rest
    size = np.sqrt(np.diag(covariance))
    correlation = float(np.clip(covariance[0, 1] / (size[0] * size[1]), -1.0, 1.0))
    two, sigma = (float(c[0]), float(c[1])), (float(size[0]), float(size[1]))
    return AcrossFit(Across(two, sigma, correlation, told, reach), directions, sigmas, shares,
                     stiffness)  # fmt: skip


def _directions(
    base: FloatArray,
    apart: FloatArray,
    travel: FloatArray,
    force: FloatArray,
    run: IntArray,
    *,
    lengths: Sequence[float],
    most: float,
) -> list[tuple[FloatArray, float, float]]:
    """Lateral directions in which c is determined to better than `most`, with c and its σ.

    The directions are those of largest and smallest variation of the lateral force, after the other
    columns are projected out, so that neither influences the other.
    """
    left = _left(apart, base)
    _, vectors = np.linalg.eigh(left.T @ left)
    found: list[tuple[FloatArray, float, float]] = []
    for direction in vectors.T[::-1]:
        along = left @ direction
        if not float(along @ along) > 1e-12 * float(force @ force):
            break
        columns = np.column_stack(
            [base, apart @ np.stack([d for d, _, _ in found] + [direction]).T]
        )
        fits = [
            fit_with_smooth_error(columns, travel, force, length, run=run) for length in lengths
        ]
        fit = max(fits, key=_sigma)
        if not _sigma(fit) < most:
            break
        found.append((direction, float(fit.theta[-1]), _sigma(fit)))
    return found


def _sigma(fit: LinearFit) -> float:
    """Standard uncertainty of the last parameter, widened for few degrees of freedom."""
    return fit.sigma(fit.theta.size - 1) * few_degrees(fit.degrees)


def _left(values: FloatArray, columns: FloatArray) -> FloatArray:
    """Residual of `values` (N, K) after a fit of `columns` (N, P)."""
    scaled = columns / np.linalg.norm(columns, axis=0)
    return np.asarray(values - scaled @ np.linalg.lstsq(scaled, values, rcond=None)[0])
