"""The law of a simulated payload: a power law through a depth at the top force, perhaps rough."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.contact.rough import P0_BRANCH
from stepload.estimators.fit import FloatArray


@dataclass(frozen=True, slots=True)
class Payload:
    """A payload of a map.

    Attributes:
        secant_n_per_m: of the smooth law at `at_n`, from the first touch.
        exponent: n of F = K δⁿ.
        at_n: the force of the secant.
    """

    secant_n_per_m: float
    exponent: float
    at_n: float

    def smooth_m(self, force_n: FloatArray) -> FloatArray:
        """Deformation (N,) in m of the smooth payload at forces (N,) of at least 0."""
        depth_m = self.at_n / self.secant_n_per_m
        return np.asarray(depth_m * (force_n / self.at_n) ** (1.0 / self.exponent))

    def deformation_m(self, force_n: FloatArray, rough_m: FloatArray) -> FloatArray:
        """Deformation (R, N) in m from the mean plane, with roughness lengths (R,) in m.

        (10) with p0 = δ_H/(δ_H + length), for any exponent; a length of 0 is smooth. The jump of
        (12) at p0 = 0.47 is taken out by moving the lower branch, so that the law is continuous.
        """
        smooth = np.broadcast_to(self.smooth_m(force_n), (rough_m.size, force_n.size))
        length = rough_m[:, None]
        p0 = np.divide(smooth, smooth + length, out=np.ones_like(smooth), where=length > 0.0)
        edge = 8.0 / (math.pi**2 * (4.79 - 3.17 * p0**3.13))
        radius = np.where(
            p0 <= P0_BRANCH, 1.605 / np.sqrt(np.maximum(p0, 1e-300)), 3.51 - 2.51 * p0
        )
        # δ_H a_L² without 0·∞: δ_H/p0 is δ_H + length.
        bulk = np.where(
            p0 <= P0_BRANCH, 0.5 * 1.605**2 * (smooth + length), 0.5 * radius**2 * smooth
        )
        sharp = np.where(p0 <= P0_BRANCH, 1.605 * np.sqrt(p0), p0 * radius)
        rough = (bulk + edge * sharp * smooth) / np.where(p0 <= P0_BRANCH, JUMP, 1.0)
        return np.where(length > 0.0, rough, smooth)


def _factor(radius: float) -> float:
    """δ/δ_H (10) at the p0 where the branches of (12) do not meet."""
    edge = 8.0 * P0_BRANCH * radius / (math.pi**2 * (4.79 - 3.17 * P0_BRANCH**3.13))
    return float(0.5 * radius**2 + edge)


JUMP = _factor(1.605 / math.sqrt(P0_BRANCH)) / _factor(3.51 - 2.51 * P0_BRANCH)
