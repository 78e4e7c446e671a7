"""RS-RTLS: the row-scaled total least squares fit (25), updated sample by sample.

The exponentially forgotten Gram matrix M ← λM + δ² z zᵀ, z = (1, ln δ, ln F), is kept as its square
root, a 3×3 triangle updated by Givens rotations: M itself would square a condition of 3e6 to 8e7.

Forgetting goes on by sample, not by force: through a hold it forgets the ramp, and the exponent is
fitted to noise. Updates are therefore frozen while the force rests, and a memory that still spans
too little force is flagged HOLD_WINDUP.
"""

from __future__ import annotations

import math

import numpy as np

from stepload.errors import DomainError
from stepload.identification.fit import (
    FEW_POINTS,
    Doubt,
    Fit,
    Flag,
    FloatArray,
    log_secant,
    unlawful,
)
from stepload.identification.ls import smallest_direction

MEMORY_SHARE = 0.25
"""A memory spanning less than this share of the force range is flagged HOLD_WINDUP."""


class RsRtls:
    """Recursive RS-BTLS with forgetting; without forgetting and rest it equals `rs_btls`.

    Args:
        forgetting: λ in 0 < λ ≤ 1; the memory is about 1/(1-λ) updates.
        secant_force_n: where the secant (28) is taken, in N.
        rest_band_n: the force rests while it is within this band of the last sample used; such
            samples are left out. About five times the force noise; 0 uses every sample that
            differs at all, a negative number every sample.

    Raises:
        DomainError: λ outside its range.

    Example:
        >>> fit = RsRtls(0.999, 300.0)
        >>> for step in range(1, 31):
        ...     _ = fit.update((10.0 * step / 6.57e8) ** (1 / 1.5), 10.0 * step)
        >>> round(fit.fit().n, 6)
        1.5
    """

    def __init__(
        self, forgetting: float, secant_force_n: float = 300.0, *, rest_band_n: float = 2.0
    ) -> None:
        if not 0.0 < forgetting <= 1.0:
            raise DomainError(
                f"forgetting factor is {forgetting:g}; it must be above 0 and at most 1",
                hint="0.999 remembers about 1000 updates, 1 remembers all",
            )
        self._root = math.sqrt(forgetting)
        self._forgetting = forgetting
        self._secant_force_n = secant_force_n
        self._rest_band_n = rest_band_n
        self._r11 = self._r12 = self._r13 = self._r22 = self._r23 = self._r33 = 0.0
        self._weight = self._mean_n = self._spread_n2 = 0.0
        self._low_n, self._high_n = math.inf, -math.inf
        self._last_n = math.nan
        self._used = self._not_positive = 0

    def update(self, deformation_m: float, force_n: float) -> bool:
        """Add one sample; False where it was left out (at rest, or δ ≤ 0 or F ≤ 0).

        Raises:
            DomainError: a number is not finite.
        """
        if not (0.0 < deformation_m < math.inf and 0.0 < force_n < math.inf):
            if not (math.isfinite(deformation_m) and math.isfinite(force_n)):
                raise DomainError(f"sample ({deformation_m} m, {force_n} N) is not finite")
            self._not_positive += 1
            return False
        if abs(force_n - self._last_n) <= self._rest_band_n:
            return False
        self._last_n = force_n
        a = deformation_m
        b, c = a * math.log(a), a * math.log(force_n)
        root = self._root
        r11, r12, r13 = root * self._r11, root * self._r12, root * self._r13
        self._r11 = h = math.sqrt(r11 * r11 + a * a)
        cos, sin = r11 / h, a / h
        self._r12, b = cos * r12 + sin * b, cos * b - sin * r12
        self._r13, c = cos * r13 + sin * c, cos * c - sin * r13
        r22, r23 = root * self._r22, root * self._r23
        self._r22 = h = math.sqrt(r22 * r22 + b * b)
        if h > 0.0:
            cos, sin = r22 / h, b / h
            self._r23, c = cos * r23 + sin * c, cos * c - sin * r23
        r33 = root * self._r33
        self._r33 = math.sqrt(r33 * r33 + c * c)

        keep = self._forgetting
        self._weight = weight = keep * self._weight + 1.0
        off = force_n - self._mean_n
        self._mean_n += off / weight
        self._spread_n2 = keep * self._spread_n2 + off * (force_n - self._mean_n)
        if force_n < self._low_n:
            self._low_n = force_n
        if force_n > self._high_n:
            self._high_n = force_n
        self._used += 1
        return True

    def triangle(self) -> FloatArray:
        """(3, 3) upper triangle of the samples in memory, of the rows δ·[1, ln δ, ln F]."""
        return np.array(
            [[self._r11, self._r12, self._r13], [0.0, self._r22, self._r23], [0.0, 0.0, self._r33]]
        )

    def fit(self) -> Fit:
        """The fit of all samples in memory, by singular value decomposition of the triangle.

        `force_rms_n` is the row-scaled rms of ln F about the law times the rms force in memory.

        Raises:
            DomainError: fewer than three samples have been used.
        """
        if self._used < 3 or self._r22 <= 1e-13 * abs(self._r12):
            raise DomainError(
                f"{self._used} samples used, {self._not_positive} not positive; a fit needs at "
                "least 3 different ones",
                hint="check the sign of the channels, and the rest band against the force range",
            )
        triangle = self.triangle()
        log_k, n, doubts = smallest_direction(triangle)
        residual = triangle @ (log_k, n, -1.0)
        relative = float(np.linalg.norm(residual)) / self._r11
        mean_square = self._mean_n**2 + self._spread_n2 / self._weight
        return Fit(
            estimator="rs_rtls",
            k=math.exp(log_k) if log_k < 709.0 else math.inf,
            n=n,
            zero_m=0.0,
            secant_n_per_m=math.exp(min(log_secant(log_k, n, self._secant_force_n), 709.0)),
            secant_force_n=self._secant_force_n,
            covariance=None,
            force_rms_n=relative * math.sqrt(mean_square),
            points=self._used,
            doubts=doubts + self._doubts() + unlawful(log_k, n),
        )

    def _doubts(self) -> tuple[Doubt, ...]:
        doubts = []
        if self._used < FEW_POINTS:
            message = f"{self._used} samples used; a fit of fewer than {FEW_POINTS} is fragile"
            doubts.append(Doubt(Flag.TOO_FEW_POINTS, message))
        if self._not_positive > 0.01 * (self._used + self._not_positive):
            message = f"{self._not_positive} samples left out: deformation or force not above 0"
            doubts.append(Doubt(Flag.NOT_POSITIVE, message))
        span = math.sqrt(12.0 * self._spread_n2 / self._weight)
        seen = self._high_n - self._low_n
        if span < MEMORY_SHARE * seen:
            message = (
                f"the memory spans about {span:.3g} N of the {seen:.3g} N seen: the ramps are "
                "forgotten"
            )
            doubts.append(Doubt(Flag.HOLD_WINDUP, message))
        return tuple(doubts)
