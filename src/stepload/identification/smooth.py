"""Errors that vary slowly with force, which a fit absorbs and no residual shows.

The position error of an arm (kinematics, gear ripple, an unmodelled bend of K_s) changes smoothly
along the stroke. Taken as a stationary random function of force with the squared-exponential
correlation exp(−½ (ΔF/length)²), it has a covariance, and a linear estimator a sensitivity to it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepload.errors import DomainError
from stepload.identification.fit import Fit, FloatArray, IntArray, finite, law_compliance

SHORTEST, LONGEST = 1.0 / 12.0, 1.0 / 1.5
"""Range of an unknown correlation length, as shares of the peak force. A shorter error averages
out, a longer one is a slope that the uncertainty of K_s covers."""
_LENGTHS = 5

NORMAL_95, CHI2_95 = 1.959964, 3.841459
"""Half width of the central 95 % of a normal distribution, in standard deviations; its square."""


_CELLS_PER_LENGTH = 20.0
_LEAST_CELLS = 6


def smooth_correlation(force_n: FloatArray, length_n: float) -> FloatArray:
    """Return the (N, N) correlation of a smooth error at forces (N,) in N."""
    if not (np.isfinite(length_n) and length_n > 0):
        raise DomainError(f"correlation length is {length_n} N; it must be positive and finite")
    distance = np.subtract.outer(force_n, force_n) / length_n
    return np.asarray(np.exp(-0.5 * distance**2))


def smooth_lengths(length_n: float | None, peak_force_n: float) -> tuple[float, ...]:
    """Correlation lengths in N to be tried: the known one, or a range (5,) in shares of the peak.

    Raises:
        DomainError: a length, or the peak that stands in for it, that is not positive and finite.
    """
    size = peak_force_n if length_n is None else length_n
    if not (np.isfinite(size) and size > 0):
        what = "peak force" if length_n is None else "correlation length"
        raise DomainError(f"{what} is {size} N; it must be positive and finite")
    if length_n is not None:
        return (length_n,)
    return tuple(float(x) for x in np.geomspace(SHORTEST, LONGEST, _LENGTHS) * peak_force_n)


class ForceCells(NamedTuple):
    """Points gathered into narrow cells of force within which a smooth error is one number.

    `cell` (N,) gives each point's cell, `force_n` (M,) the cell centres.
    """

    cell: IntArray
    force_n: FloatArray


def force_cells(force_n: FloatArray, length_n: float) -> ForceCells:
    """Gather points into cells of a twentieth of `length_n` (at most a few hundred cells)."""
    width = max(length_n / _CELLS_PER_LENGTH, float(np.ptp(force_n)) / 400.0)
    keys, index = np.unique(np.round(force_n / width), return_inverse=True)
    return ForceCells(index, keys * width)


class LinearFit(NamedTuple):
    """Least squares with a smooth error in `y`.

    `theta` (P,), `unit_covariance` (P, P) for a smooth error of unit variance, `rms` the plain rms
    residual, `smooth_sd` the size of the error that leaves such a residual once the part that
    the fit absorbs is counted, `degrees` its effective degrees of freedom (Satterthwaite).
    """

    theta: FloatArray
    unit_covariance: FloatArray
    rms: float
    smooth_sd: float
    degrees: float

    def sigma(self, parameter: int, smooth_sd: float | None = None) -> float:
        """Standard uncertainty of a parameter for a smooth error of `smooth_sd` (None: its own)."""
        size = self.smooth_sd if smooth_sd is None else smooth_sd
        return size * float(np.sqrt(max(self.unit_covariance[parameter, parameter], 0.0)))


def fit_with_smooth_error(
    columns: FloatArray,
    y: FloatArray,
    force_n: FloatArray,
    length_n: float,
    *,
    run: IntArray | None = None,
    white_sd: float = 0.0,
) -> LinearFit:
    """Fit y (N,) = columns (N, P) @ theta where y carries an error that is smooth in force.

    Points of different `run` have independent errors. `white_sd` is the known error of a point that
    is not smooth; up to three quarters of the misfit count as that. The cost is N³.

    Raises:
        DomainError: columns that do not span P dimensions, or fewer than P + 2 points.
    """
    count, parameters = columns.shape
    if count < parameters + 2:
        raise DomainError(
            f"{count} points for {parameters} parameters; at least {parameters + 2} are needed",
            hint="use more of the stroke or finer load steps",
        )
    scale = np.linalg.norm(columns, axis=0)
    if not np.all(np.isfinite(scale)) or np.any(scale == 0):
        raise DomainError("a regressor is zero or not finite everywhere")
    sensitivity = np.linalg.pinv(finite(columns / scale)) / scale[:, None]
    if np.linalg.matrix_rank(columns / scale, tol=1e-8) < parameters:
        raise DomainError(
            "the data cannot tell the parameters apart",
            hint="cover more force range; for damping, hold and move at the same forces",
        )
    theta = sensitivity @ y
    residual = y - columns @ theta
    correlation = smooth_correlation(force_n, length_n)
    if run is not None:
        correlation = np.where(run[:, None] == run, correlation, 0.0)
    visible = correlation - columns @ (sensitivity @ correlation)
    trace = float(np.trace(visible))
    square = float(residual @ residual)
    white = min(white_sd**2 * (count - parameters), 0.75 * square)
    variance = (square - white) / trace
    return LinearFit(
        theta=theta,
        unit_covariance=sensitivity @ correlation @ sensitivity.T,
        rms=float(np.sqrt(np.mean(residual**2))),
        smooth_sd=float(np.sqrt(variance)),
        degrees=trace**2 / float(np.sum(visible * visible.T)),
    )


def few_degrees(degrees: float | None) -> float:
    """Factor on σ by which ± 1.96 σ covers 95 % when σ itself is estimated (GUM G.4).

    1 where `degrees` is None: σ is known.
    """
    if degrees is None:
        return 1.0
    from scipy.special import stdtrit

    return float(stdtrit(max(degrees, 1.0), 0.975)) / NORMAL_95


class Leftover(NamedTuple):
    """Size in m (sd) of a smooth error, estimated with `degrees` degrees of freedom."""

    smooth_error_m: float
    degrees: float


def smooth_leftover(
    fit: Fit,
    deformation_m: FloatArray,
    force_n: FloatArray,
    *,
    white_sd_m: float = 0.0,
    length_n: float | None = None,
) -> Leftover | None:
    """Estimate the smooth error from the residuals of a joint fit; None for too few data.

    Args:
        deformation_m, force_n: (N,) the points it was made from, forces positive.
        white_sd_m: white noise of a point; its part in the means is not counted as smooth.
        length_n: correlation length of the smooth error; None: the middle of those it may have.
    """
    lengths = smooth_lengths(length_n, float(force_n.max()))
    length_n = lengths[len(lengths) // 2]
    cells = force_cells(force_n, length_n)
    count = np.bincount(cells.cell)
    if count.size < _LEAST_CELLS:
        return None
    shape = (force_n / fit.k) ** (1.0 / fit.n)
    residual = np.bincount(cells.cell, deformation_m - fit.zero_m - shape) / count
    force = np.bincount(cells.cell, force_n) / count
    compliance = law_compliance(fit, force)
    columns = np.stack(
        [np.ones_like(force), force * compliance, force * compliance * np.log(force / fit.k)],
        axis=1,
    )
    try:
        found = fit_with_smooth_error(
            columns, residual, force, length_n, white_sd=white_sd_m / float(np.sqrt(count.mean()))
        )
    except DomainError:
        return None
    return Leftover(found.smooth_sd, max(found.degrees, 1.0))
