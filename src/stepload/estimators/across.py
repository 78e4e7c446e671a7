"""What the force across the pressing axis does to the travel along it.

An arm that is pressed along its tool gives way sideways as well. Where friction holds the tip, it
cannot, and is stiffer along the axis for that; the force across the axis tells by how much. Three
numbers say it all, whatever the friction (six axes, item 1)::

    δ = s − δ_s(F) − c · (F_across − t₀ F)

δ_s is the deflection as it was measured, at the shares t₀ of force across over force along. With
t₀ = 0 this is the plain δ = s − c·F. The shares of the calibration stand for t₀, since there, and
nowhere else, the errors of δ_s and of c have nothing to do with each other: together with σ(K_s)
and the 2 x 2 covariance of c they are the whole 3 x 3 covariance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray

Pair = tuple[float, float]

CROSS_COMPLIANCE = 0.6
"""Standard deviation of C_xz/C_zz along each axis across, of a serial arm of which nothing is
known. |C_xz|/C_zz over tool-down poses has a median and a 90th percentile of 0.63 and 1.3 (UR3),
0.33 and 0.86 (UR5), 0.36 and 0.88 (UR10); with two alike axes of this deviation they would be 0.71
and 1.29, so the worst of the three is covered. The joint stiffnesses behind it are assumed."""
EXTRAPOLATED = 1.5
"""Beyond so many times the shares that c was measured with, it costs width as if unknown."""


@dataclass(frozen=True, slots=True)
class Across:
    """What is known of it: c with its covariance, and the shares that K_s was measured at.

    Attributes:
        per_newton_m: c in m/N for the sensor's two axes across; None where it is not known.
        sigma_m_per_n: standard uncertainty of each.
        correlation: of the two errors.
        at_share: t₀; None where it is not known under which friction K_s was measured.
        reach: how far from t₀ the shares went that c was measured with.
    """

    per_newton_m: Pair | None = None
    sigma_m_per_n: Pair = (0.0, 0.0)
    correlation: float = 0.0
    at_share: Pair | None = None
    reach: float = 0.0

    @property
    def covariance(self) -> FloatArray:
        """Covariance (2, 2) of c in (m/N)²."""
        size = np.array(self.sigma_m_per_n)
        alike = np.array([[1.0, self.correlation], [self.correlation, 1.0]])
        return np.asarray(alike * np.outer(size, size))

    def away(self, share: FloatArray) -> FloatArray:
        """Shares (2,) less those of the calibration; a c that is stated without them is of 0."""
        return np.asarray(share - np.array(self.at_share or (0.0, 0.0)))

    def taken_m(self, force_n: FloatArray, across_n: FloatArray) -> FloatArray:
        """Travel (N,) in m that is due to forces across (N, 2) beside forces along (N,)."""
        if self.per_newton_m is None:
            return np.zeros_like(force_n)
        share = np.array(self.at_share or (0.0, 0.0))
        return np.asarray((across_n - np.outer(force_n, share)) @ np.array(self.per_newton_m))

    def errors_m_per_n(self, share: FloatArray, stiffness_n_per_m: float) -> tuple[float, ...]:
        """What is taken out per newton along is wrong by these in m, at shares (2,).

        One standard uncertainty for each independent cause, with its sign: two runs err alike as
        far as theirs point the same way. From the covariance of c; beyond `EXTRAPOLATED` times the
        calibrated shares the rest counts as if nothing were known of the arm. So does the whole
        share where it points the other way than in the calibration: a sensor that was turned since
        then shows it like that.
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

    def doubt_m_per_n(self, share: FloatArray, stiffness_n_per_m: float) -> float:
        """Standard uncertainty in m of what is taken out per newton along, at shares (2,)."""
        return math.hypot(*self.errors_m_per_n(share, stiffness_n_per_m))

    def noise_m(self, noise_n: float) -> float:
        """Noise in m that a correction adds, for a noise of the force across (rms of its size)."""
        if self.per_newton_m is None or not math.isfinite(noise_n):
            return 0.0
        return math.hypot(*self.per_newton_m) * noise_n / math.sqrt(2.0)
