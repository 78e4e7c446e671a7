"""Smooth error estimated from the residuals of the run itself.

Residuals do not show what the fit has absorbed, so their rms underestimates the error. The share of
a smooth error that a fit of (K, n, δ0) absorbs is known, however, so the residual can be scaled up
to the whole. The estimate has very few degrees of freedom, since the fit takes three of the about
six that a smooth error has over a run: use it only where there is no K_s run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import Fit, FloatArray, law_compliance
from stepload.estimators.smooth import fit_with_smooth_error, force_cells, smooth_lengths

_LEAST_CELLS = 6


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
    """Estimate the smooth error from the residuals of a joint fit.

    Args:
        fit: fit of K, n and zero.
        deformation_m, force_n: (N,) the points it was made from, forces positive.
        white_sd_m: white noise of a point; its part in the means is not counted as smooth.
        length_n: correlation length of the smooth error; None: not known, its size is taken at the
            middle of the lengths that it may have.

    Returns:
        None where there are too few data, or their range of force is too small.
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
