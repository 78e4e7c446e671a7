"""Data points as the estimators take them: checked once; a doubt states what was left out."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.estimators.fit import Doubt, Flag, FloatArray

FEW_POINTS = 10
"""Fewer than this many usable points are flagged."""
NOT_POSITIVE_SHARE = 0.01
"""A larger share of points without positive deformation or force is flagged."""


class Points(NamedTuple):
    """Usable points: two 1-D arrays of one length, in m and N, and the doubts about them."""

    deformation_m: FloatArray
    force_n: FloatArray
    doubts: tuple[Doubt, ...]


def loaded(deformation_m: ArrayLike, force_n: ArrayLike, *, at_least: int) -> Points:
    """Points with force > 0; the deformation may have any sign (its zero is to be found).

    Raises:
        DomainError: shapes differ, a number is not finite, or fewer than `at_least` are left.
    """
    deformation, force = checked(deformation_m, force_n)
    keep = None if force.min(initial=math.inf) > 0.0 else force > 0.0
    return _kept(deformation, force, keep, "force", at_least)


def positive(deformation_m: ArrayLike, force_n: ArrayLike, *, at_least: int) -> Points:
    """Points with force > 0 and deformation > 0: those that have logarithms.

    Raises:
        DomainError: shapes differ, a number is not finite, or fewer than `at_least` are left.
    """
    deformation, force = checked(deformation_m, force_n)
    least = min(deformation.min(initial=math.inf), force.min(initial=math.inf))
    keep = None if least > 0.0 else (deformation > 0.0) & (force > 0.0)
    return _kept(deformation, force, keep, "deformation or force", at_least)


def checked(deformation_m: ArrayLike, force_n: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Both as float arrays of one length, finite.

    Raises:
        DomainError: they are not 1-D of one length, or a number is not finite.
    """
    deformation, force = paired(deformation_m, force_n)
    for values, what in ((deformation, "deformations"), (force, "forces")):
        if not math.isfinite(float(values.sum())):
            bad = np.flatnonzero(~np.isfinite(values))
            raise DomainError(
                f"{bad.size} of {values.size} {what} are not finite, the first at index {bad[:1]}",
                hint="drop samples that are missing or invalid before fitting",
            )
    return deformation, force


def paired(deformation_m: ArrayLike, force_n: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Both as float arrays of one length; their values are not checked.

    Raises:
        DomainError: they are not 1-D of one length.
    """
    deformation = np.ascontiguousarray(deformation_m, dtype=np.float64)
    force = np.ascontiguousarray(force_n, dtype=np.float64)
    if deformation.ndim != 1 or deformation.shape != force.shape:
        raise DomainError(
            f"deformation has shape {deformation.shape}, force {force.shape}; "
            "both must be 1-D of one length"
        )
    return deformation, force


def _kept(
    deformation: FloatArray,
    force: FloatArray,
    keep: np.ndarray[tuple[int], np.dtype[np.bool_]] | None,
    what: str,
    at_least: int,
) -> Points:
    total = deformation.size
    if keep is not None:
        deformation, force = deformation[keep], force[keep]
    count = deformation.size
    if count < at_least:
        raise DomainError(
            f"{count} of {total} points are usable ({what} above 0); "
            f"this fit needs at least {at_least}",
            hint="check the sign of the channels and the zero of the deformation",
        )
    doubts = []
    if count < FEW_POINTS:
        message = f"{count} usable points; a fit of fewer than {FEW_POINTS} is fragile"
        doubts.append(Doubt(Flag.TOO_FEW_POINTS, message))
    if (total - count) > NOT_POSITIVE_SHARE * total:
        share = 100.0 * (total - count) / total
        message = f"{share:.1f} % of {total} points left out: {what} not above 0"
        doubts.append(Doubt(Flag.NOT_POSITIVE, message))
    return Points(deformation, force, tuple(doubts))
