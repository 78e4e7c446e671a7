"""Effect of lateral force on an arm, from runs against a block under several frictions.

    s = s₀ + F/K_s + c · (F_across − t₀ F) − (C_s/K_s) ds/dt

Each run has its own zero s₀; K_s, C_s and c are common to all. A block that is pressed dry and then
greased changes the lateral share in one direction only: the runs determine c along this direction
and not perpendicular to it. There c is taken as zero, with the standard uncertainty of an unknown
arm. The errors are those of K_s: smooth in force, of a size estimated from the misfit with few
degrees of freedom, and independent from run to run. Errors that repeat from run to run do not
affect c; its error is then smaller than stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray, IntArray
from stepload.estimators.lateral_effect import CROSS_COMPLIANCE, Across, Pair
from stepload.estimators.smooth import (
    LinearFit,
    few_degrees,
    fit_with_smooth_error,
    smooth_lengths,
)
from stepload.estimators.system import Cells, SeriesContact

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
    force = np.concatenate([each.force_n[k] for each, k in zip(runs, kept, strict=True)])
    across = np.concatenate([each.across_n[k] for each, k in zip(runs, kept, strict=True)])
    rate = np.concatenate([each.rate_m_s[k] for each, k in zip(runs, kept, strict=True)])
    travel = np.concatenate(
        [
            each.displacement_m[k]
            - (0.0 if contact is None else contact.deformation_m(each.force_n[k]))
            for each, k, contact in zip(runs, kept, contacts, strict=True)
        ]
    )
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
    return AcrossFit(
        Across(
            (float(c[0]), float(c[1])),
            (float(size[0]), float(size[1])),
            float(np.clip(covariance[0, 1] / (size[0] * size[1]), -1.0, 1.0)),
            told,
            reach,
        ),
        directions,
        sigmas,
        shares,
        stiffness,
    )


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
