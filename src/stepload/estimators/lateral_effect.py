"""Effect of the force across the pressing axis (lateral force) on the travel along it.

An arm that is pressed along its tool gives way sideways as well. Where friction holds the tip, it
cannot, and is stiffer along the axis; the lateral force shows by how much. Three numbers describe
this for any friction (six axes, item 1)::

    δ = s − δ_s(F) − c · (F_across − t₀ F)

δ_s is the deflection as it was measured, at the shares t₀ of force across over force along. With t₀
= 0 this is the plain δ = s − c·F. t₀ are the shares of the calibration, since only there the errors
of δ_s and of c are uncorrelated: σ(K_s) and the 2 x 2 covariance of c are then the whole 3 x 3
covariance. c is fitted to runs against a block under several frictions (`across_fit`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray

Pair = tuple[float, float]

CROSS_COMPLIANCE = 0.6
"""Standard deviation of C_xz/C_zz along each lateral axis, for a serial arm whose coupling is
unknown. |C_xz|/C_zz over tool-down poses has a median and a 90th percentile of 0.63 and 1.3 (UR3),
0.33 and 0.86 (UR5), 0.36 and 0.88 (UR10); two independent axes with this deviation would give 0.71
and 1.29, which covers the worst of the three. The joint stiffnesses behind it are assumed."""
EXTRAPOLATED = 1.5
"""Beyond this multiple of the calibrated shares, the error of c counts as for an unknown arm."""


@dataclass(frozen=True, slots=True)
class Across:
    """What is known of the coupling: c with its covariance, and the shares of the calibration.

    Attributes:
        per_newton_m: c in m/N for the sensor's two axes across; None where it is not known.
        sigma_m_per_n: standard uncertainty of each component of c.
        correlation: correlation of the two errors.
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

        One signed standard uncertainty for each independent cause: where the signs of two runs
        agree, their errors are correlated. From the covariance of c; the part of the share beyond
        `EXTRAPOLATED` times the calibrated shares counts as for an unknown arm. So does the whole
        share where its direction is opposite to that of the calibration, as after the sensor was
        turned.
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
        """Standard uncertainty in m of the correction per newton of axial force, at shares (2,)."""
        return math.hypot(*self.errors_m_per_n(share, stiffness_n_per_m))

    def noise_m(self, noise_n: float) -> float:
        """Noise in m that the correction adds, for an rms noise of the lateral force."""
        if self.per_newton_m is None or not math.isfinite(noise_n):
            return 0.0
        return math.hypot(*self.per_newton_m) * noise_n / math.sqrt(2.0)
