"""Laws around another one: asperities, pad, soft path, seat that settles, adhesion, creep.

A layer divides the travel between itself and what is inside. Contacts that stick have a negative
force before they part; a stiffness below 0 is given as 0: the mechanics take the steps there that
the force allows.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from stepload_drivers.sim.laws import Around, ContactLaw, Curve

Give = Callable[[float], tuple[float, float]]
"""Travel in m over a force in N > 0, and its slope in m/N; never falling."""

_CLOSE_M = 1e-15
_CLOSE_SHARE = 1e-13
_ATTEMPTS = 100
_HALVINGS = 60
_PART_ROOT = (1.0 / 6.0) ** (1.0 / 3.0)
"""√A at which the neck of an adhesive sphere tears when it is drawn by a stiff rig."""
_ROOT_CLOSE = 1e-14
_ROOT_ATTEMPTS = 60


def pad_give(stiffness_n_per_m: float, depth_m: float) -> Give:
    """A linear pad that is compressed by `depth_m` at the most."""
    full_n = stiffness_n_per_m * depth_m

    def give(force_n: float) -> tuple[float, float]:
        if force_n >= full_n:
            return depth_m, 0.0
        return force_n / stiffness_n_per_m, 1.0 / stiffness_n_per_m

    return give


def soft_path_give(stiffness_n_per_m: float, softness: float, force_n: float) -> Give:
    """Deflection in excess of F/K_s of a load path of compliance 1/K_s (1 + s exp(−F/F_s))."""
    most_m = softness * force_n / stiffness_n_per_m

    def give(pressed_n: float) -> tuple[float, float]:
        left = math.exp(-pressed_n / force_n)
        return most_m * (1.0 - left), most_m / force_n * left

    return give


class Series(Around):
    """Something that gives way by `give` in series with `inner`; it is never stretched."""

    def __init__(self, inner: ContactLaw, give: Give) -> None:
        super().__init__(inner)
        self._give = give
        self._at_m = self._inside_m = 0.0

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        """Newton's method within a bracket; the travel inside is at most all of it."""
        evaluate, give = self._inner.evaluate, self._give
        self._at_m = high = deformation_m
        force_n, tangent = evaluate(high)
        if force_n <= 0.0:
            self._inside_m = high
            return force_n, tangent
        close_m = _CLOSE_M + _CLOSE_SHARE * abs(high)
        given_m, slope = give(force_n)
        low = high - given_m
        inside_m = high - given_m / (1.0 + slope * tangent)
        for _ in range(_ATTEMPTS):
            force_n, tangent = evaluate(inside_m)
            given_m, slope = give(force_n) if force_n > 0.0 else (0.0, 0.0)
            error_m = inside_m + given_m - deformation_m
            if -close_m <= error_m <= close_m:
                break
            if error_m > 0.0:
                high = inside_m
            else:
                low = inside_m
            inside_m -= error_m / (1.0 + slope * tangent)
            if not low < inside_m < high:
                inside_m = 0.5 * (low + high)
        self._inside_m = inside_m
        return force_n, tangent / (1.0 + slope * tangent)

    def remember(self, deformation_m: float) -> None:
        if deformation_m != self._at_m:
            self.evaluate(deformation_m)
        self._inner.remember(self._inside_m)


class RoughLayer:
    """Asperities (8)–(12) over `inner`, a smooth body that may flow.

    They are compressed with the smooth body's own deformation, which is (10) while it is elastic.
    """

    def __init__(self, inner: ContactLaw, smooth_over_rough: Curve) -> None:
        self._inner = inner
        self._map = smooth_over_rough
        self._at_m = self._smooth_m = 0.0
        self._set_m = 0.0
        self.residual_m = 0.0

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        smooth_m, slope = self._map(deformation_m)
        self._at_m, self._smooth_m = deformation_m, smooth_m
        force_n, tangent = self._inner.evaluate(smooth_m)
        return force_n, tangent * slope

    def remember(self, deformation_m: float) -> None:
        if deformation_m != self._at_m:
            self.evaluate(deformation_m)
        self._inner.remember(self._smooth_m)
        set_m = self._inner.residual_m
        if set_m != self._set_m:
            self._set_m = set_m
            self.residual_m = self._rough_m(set_m, deformation_m)

    def _rough_m(self, smooth_m: float, high: float) -> float:
        """Deformation of the rough body at that of the smooth one."""
        low = 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if self._map(middle)[0] > smooth_m:
                high = middle
            else:
                low = middle
        return low


class Seating:
    """`inner` in a seat that gives way by `most_m` once, and never comes back.

    In proportion to the deepest deformation of `inner` so far, until that has reached `depth_m`.
    """

    def __init__(self, inner: ContactLaw, most_m: float, depth_m: float) -> None:
        self._inner = inner
        self._most_m = most_m
        self._depth_m = depth_m
        self._share = depth_m / (depth_m + most_m)
        self._deepest_m = self._seated_m = 0.0

    @property
    def residual_m(self) -> float:
        return self._inner.residual_m + self._seated_m

    def _inside(self, deformation_m: float) -> tuple[float, float]:
        """Deformation of `inner`, and its share of a further travel."""
        if deformation_m <= self._deepest_m + self._seated_m:
            return deformation_m - self._seated_m, 1.0
        if deformation_m >= self._depth_m + self._most_m:
            return deformation_m - self._most_m, 1.0
        return deformation_m * self._share, self._share

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        inside_m, share = self._inside(deformation_m)
        force_n, tangent = self._inner.evaluate(inside_m)
        return force_n, tangent * share

    def remember(self, deformation_m: float) -> None:
        inside_m, _ = self._inside(deformation_m)
        self._inner.remember(inside_m)
        if inside_m > self._deepest_m:
            self._deepest_m = inside_m
            self._seated_m = min(self._most_m, self._most_m * inside_m / self._depth_m)


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
        for _ in range(_ROOT_ATTEMPTS):
            step = (root**4 - 2.0 / 3.0 * root - ratio) / (4.0 * root**3 - 2.0 / 3.0)
            root -= step
            if step <= _ROOT_CLOSE * root:
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


class Creep:
    """`inner` in series with Kelvin elements, driven by its own elastic deformation.

    Under constant force the elastic deformation δ of `inner` grows to
    δ (1 + Σ c_i (1 − e^(−t/τ_i))) (linear viscoelasticity); the elements share the creep evenly,
    one a decade of time.
    """

    def __init__(self, inner: ContactLaw, share: float, time_s: float, decades: int) -> None:
        self._inner = inner
        self._times_s = [time_s * 10.0**i for i in range(decades + 1)]
        self._share = share / len(self._times_s)
        self._crept_m = [0.0] * len(self._times_s)
        self._elastic_m = self._sum_m = 0.0
        self._dt_s = 0.0
        self._parts: list[float] = []

    @property
    def residual_m(self) -> float:
        return self._inner.residual_m + self._sum_m

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        return self._inner.evaluate(deformation_m - self._sum_m)

    def remember(self, deformation_m: float) -> None:
        inside_m = deformation_m - self._sum_m
        self._inner.remember(inside_m)
        self._elastic_m = max(0.0, inside_m - self._inner.residual_m)

    def flow(self, dt_s: float) -> None:
        """Let `dt_s` pass at the deformation that is remembered."""
        if dt_s != self._dt_s:
            self._dt_s = dt_s
            self._parts = [-math.expm1(-dt_s / time_s) for time_s in self._times_s]
        goal_m = self._share * self._elastic_m
        crept = self._crept_m
        for i, part in enumerate(self._parts):
            crept[i] += (goal_m - crept[i]) * part
        self._sum_m = sum(crept)
