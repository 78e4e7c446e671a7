"""Guard against non-finite matrices, on which LAPACK does not return or writes to the terminal.

A decomposition of a matrix with an infinity does not end, and least squares of one with NaN put a
line onto standard output, where programs expect JSON alone.
"""

from __future__ import annotations

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray


def finite(matrix: FloatArray) -> FloatArray:
    """The matrix itself, if all its numbers are finite.

    Raises:
        DomainError: a number in it is not finite.
    """
    if not np.isfinite(matrix).all():
        raise DomainError(
            "the points lead to no law: their numbers are too large or too small to be fitted",
            hint="check the units of the columns",
        )
    return matrix
