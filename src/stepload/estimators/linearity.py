"""Error of a force sensor that is not quite linear between zero and the top force.

A certificate compares a sensor with a line; what is left is a bow to one side, or an S. The data of
a run cannot show it, since a slightly stiffer contact gives the same reading. So it is stated, or
assumed.
"""

from __future__ import annotations

import math

import numpy as np

from stepload.estimators.fit import FloatArray

ASSUMED_NONLINEARITY = 0.005
"""Nonlinearity assumed where none is stated; a common figure of data sheets."""
_S_PEAK = math.sqrt(3.0) / 36.0


def linearity_errors(force_n: FloatArray, nonlinearity: float) -> FloatArray:
    """Errors (2, N) in N of the reading at forces (N,), each with a standard normal size.

    A bow and an S, zero at no force and at the largest one (what errs there is the gain). A largest
    departure is the half width of a rectangle (GUM 4.3.7), shared evenly by the two shapes.

    Args:
        force_n: forces of at least 0.
        nonlinearity: largest departure from a line, as a share of the largest force.
    """
    top_n = float(force_n.max(initial=0.0))
    x = force_n / top_n if top_n > 0.0 else np.zeros_like(force_n)
    shapes = np.stack([4.0 * x * (1.0 - x), x * (x - 0.5) * (x - 1.0) / _S_PEAK])
    return np.asarray(nonlinearity / math.sqrt(6.0) * top_n * shapes)
