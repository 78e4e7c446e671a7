"""Error of the lateral force by the arm's own wrench, where the force sensor measures none."""

from __future__ import annotations

import math

COMPONENTS = 2
"""Lateral components; each may err by what R5 allows the axial one to err by."""
_ROOT = math.sqrt(COMPONENTS)


def arm_error_n(tolerance_n: float, tolerance_relative: float, along_n: float) -> float:
    """Largest error in N of the lateral force by the wrench of a sound arm.

    Args:
        tolerance_n, tolerance_relative: of the second channel, as R5 has them.
        along_n: force along the press.
    """
    return _ROOT * (tolerance_n + tolerance_relative * abs(along_n))
