"""Layers over or under a contact: asperities, a pad, a soft load path, a seat that settles.

Each is a law around another one: it divides the travel between itself and what is inside.
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
