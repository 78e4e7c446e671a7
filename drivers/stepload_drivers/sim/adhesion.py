"""Contacts that stick: the force is negative before they part.

A stiffness below 0 is given as 0: the mechanics take the steps there that the force allows.
"""

from __future__ import annotations

import math

from stepload_drivers.sim.laws import Around, ContactLaw

_PART_ROOT = (1.0 / 6.0) ** (1.0 / 3.0)
"""√A at which the neck of an adhesive sphere tears when it is drawn by a stiff rig."""
_CLOSE = 1e-14
_ATTEMPTS = 60


class Dmt(Around):
    """The force of `inner` less the pull-off force, as long as they touch.

    B. V. Derjaguin, V. M. Muller, Y. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314.
    """

    def __init__(self, inner: ContactLaw, pull_off_n: float) -> None:
        super().__init__(inner)
        self._pull_off_n = pull_off_n

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        if deformation_m <= self._inner.residual_m:
            return 0.0, 0.0
        force_n, tangent = self._inner.evaluate(deformation_m)
        return force_n - self._pull_off_n, tangent


class Jkr(Around):
    """An adhesive sphere: `inner` with the Hertz force K δ^1.5 replaced by that of the neck.

    δ = δ0 (A² − ⅔ √A), F = 4 P (A³ − A^1.5), δ0 = (4 P/K)^(2/3), A the contact radius over that at
    no load, P the pull-off force (K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324
    (1971) 301). The bodies join when they touch, and part at A = 6^(−2/3), where δ is least.
    """

    def __init__(self, inner: ContactLaw, k: float, pull_off_n: float) -> None:
        super().__init__(inner)
        self._k = k
        self._four_p = 4.0 * pull_off_n
        self._scale_m = (4.0 * pull_off_n / k) ** (2.0 / 3.0)
        self._part_m = self._scale_m * (_PART_ROOT**4 - 2.0 / 3.0 * _PART_ROOT)
        self._joined = False

    def _root(self, elastic_m: float) -> float:
        """√A ≥ 6^(−1/3): the upper zero of s⁴ − ⅔ s − δ/δ0."""
        ratio = elastic_m / self._scale_m
        root = 1.0 + math.sqrt(math.sqrt(max(ratio, 0.0)))
        for _ in range(_ATTEMPTS):
            step = (root**4 - 2.0 / 3.0 * root - ratio) / (4.0 * root**3 - 2.0 / 3.0)
            root -= step
            if step <= _CLOSE * root:
                break
        return max(root, _PART_ROOT)

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        elastic_m = deformation_m - self._inner.residual_m
        if elastic_m < (self._part_m if self._joined else 0.0):
            return 0.0, 0.0
        force_n, tangent = self._inner.evaluate(deformation_m)
        root = self._root(elastic_m)
        cube = root**3
        neck_n = self._four_p * cube * (cube - 1.0)
        slope = self._four_p * 1.5 * root * root * (2.0 * cube - 1.0)
        rise = self._scale_m * (2.0 * cube - 1.0 / 3.0)
        if elastic_m > 0.0:
            hertz_n = self._k * elastic_m**1.5
            force_n -= hertz_n
            tangent -= 1.5 * hertz_n / elastic_m
        if slope <= 0.0:
            return force_n + neck_n, 0.0
        return force_n + neck_n, max(0.0, tangent + slope / rise)

    def remember(self, deformation_m: float) -> None:
        self._inner.remember(deformation_m)
        elastic_m = deformation_m - self._inner.residual_m
        self._joined = elastic_m >= (self._part_m if self._joined else 0.0)
