"""Contact laws of a payload: force and tangent stiffness over deformation, with memory.

A curve or law maps a deformation in m to (force in N, tangent stiffness in N/m); 0, 0 apart.
`contact` puts them together.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError

Curve = Callable[[float], tuple[float, float]]
Points = NDArray[np.float64]

TURNING_SHARE = 0.05
"""Share of the deformation over which a reversal passes from the loading to the unloading curve."""


class ContactLaw(Protocol):
    """Force over deformation of one payload in its present state."""

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        """Force and tangent stiffness if the contact moved directly to `deformation_m`."""
        ...

    def remember(self, deformation_m: float) -> None:
        """Move the contact there; its history continues from that state."""
        ...

    @property
    def residual_m(self) -> float:
        """Deformation at which the contact parts: the permanent indentation."""
        ...


class Around:
    """A law around another one: it parts where that does, and remembers by it."""

    def __init__(self, inner: ContactLaw) -> None:
        self._inner = inner

    @property
    def residual_m(self) -> float:
        return self._inner.residual_m

    def remember(self, deformation_m: float) -> None:
        self._inner.remember(deformation_m)


def power_curve(k: float, n: float) -> Curve:
    """F = K δ^n (2)."""

    def curve(deformation_m: float) -> tuple[float, float]:
        if deformation_m <= 0.0:
            return 0.0, 0.0
        force_n: float = k * deformation_m**n
        return force_n, n * force_n / deformation_m

    return curve


def rough_curve(k: float, n: float, roughness_m: float, kappa: float) -> Curve:
    """Rough sphere (8)–(12), inverted to force over deformation."""
    log_deformation, log_hertz = _rough_points(roughness_m, kappa)
    return _log_cubic(log_deformation, math.log(k) + n * log_hertz)


def rough_layer(roughness_m: float, kappa: float) -> Curve:
    """Deformation of the smooth body over that of the rough one (8)–(12), and its slope."""
    return _log_cubic(*_rough_points(roughness_m, kappa))


def _rough_points(roughness_m: float, kappa: float) -> tuple[Points, Points]:
    """ln δ (10) and ln δ_H, rising.

    The equations leave two gaps that a simulator has to close: where the branches of (12) do not
    meet (p0 = 0.47, −0.89 %) the points pass smoothly over 0.44 ≤ p0 ≤ 0.51, and below p0 = 0.01,
    where F is of the order of millinewtons, the table goes on as a power of δ down to 0.
    """
    scale_m = 1.22 * roughness_m * kappa**-0.16
    parts = [np.geomspace(0.01, 0.44, 400), 1.0 - np.geomspace(0.49, 1e-5, 1600)]
    p0 = np.concatenate(parts)
    hertz_m = scale_m * p0 / (1.0 - p0)
    a_l = np.where(p0 <= 0.47, 1.605 / np.sqrt(p0), 3.51 - 2.51 * p0)
    bulk = 8.0 * p0 * a_l / (math.pi**2 * (4.79 - 3.17 * p0**3.13))
    return np.log(hertz_m * (0.5 * a_l**2 + bulk)), np.log(hertz_m)


def _log_cubic(log_x: Points, log_y: Points) -> Curve:
    """A cubic table over even steps of `log_x`; below it a power of x down to 0."""
    count = 2048
    start, step = float(log_x[0]), float(log_x[-1] - log_x[0]) / (count - 1)
    grid = start + step * np.arange(count)
    values = np.interp(grid, log_x, log_y)
    values_list = values.tolist()
    slopes = np.gradient(values).tolist()
    first_slope = slopes[0] / step

    def curve(x: float) -> tuple[float, float]:
        if x <= 0.0:
            return 0.0, 0.0
        place = (math.log(x) - start) / step
        if place < 0.0:
            y = math.exp(values_list[0] + slopes[0] * place)
            return y, y * first_slope / x
        i = int(place)
        if i >= count - 1:
            raise DomainError(f"rough contact beyond its table: {x:.3g} m")
        s = place - i
        y0, y1, m0, m1 = values_list[i], values_list[i + 1], slopes[i], slopes[i + 1]
        c2 = 3.0 * (y1 - y0) - 2.0 * m0 - m1
        c3 = m0 + m1 - 2.0 * (y1 - y0)
        y = math.exp(y0 + s * (m0 + s * (c2 + s * c3)))
        log_slope = (m0 + s * (2.0 * c2 + 3.0 * s * c3)) / step
        return y, y * log_slope / x

    return curve


def elastic_plastic_curve(k: float, elastic_limit_n: float) -> Curve:
    """Virgin loading by (14), made continuous by switching where the branches intersect.

    That is at x = δ/δ_c = 1.483 and 6.649 instead of 1 and 6.
    """
    critical_m = (elastic_limit_n / k) ** (2.0 / 3.0)
    first = 1.03 ** (1.0 / 0.075)
    second = (1.40 / 1.03) ** (1.0 / 0.162)

    def curve(deformation_m: float) -> tuple[float, float]:
        if deformation_m <= 0.0:
            return 0.0, 0.0
        x = deformation_m / critical_m
        if x <= first:
            factor, power = 1.0, 1.5
        elif x <= second:
            factor, power = 1.03, 1.425
        else:
            factor, power = 1.40, 1.263
        force_n: float = factor * elastic_limit_n * x**power
        return force_n, power * force_n / deformation_m

    return curve


class Elastic:
    """A curve without memory."""

    residual_m = 0.0

    def __init__(self, curve: Curve) -> None:
        self.evaluate = curve

    def remember(self, deformation_m: float) -> None:
        """Nothing to remember."""


class Plastic:
    """Loads on the virgin curve, unloads and reloads elastically to a residual indentation.

    Residual indentation after R. L. Jackson, I. Chusoipin, I. Green, J. Tribology 127 (2005):
    δ_res/δ = 1.02 (1 − ((x + 5.9)/6.9)^−0.54), x = δ_max/δ_c > 1.
    """

    def __init__(self, curve: Curve, k: float, elastic_limit_n: float) -> None:
        self._curve = curve
        self._critical_m = (elastic_limit_n / k) ** (2.0 / 3.0)
        self._deepest_m = self._critical_m
        self._unloading_k = k
        self.residual_m = 0.0

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        if deformation_m >= self._deepest_m:
            return self._curve(deformation_m)
        elastic_m = deformation_m - self.residual_m
        if elastic_m <= 0.0:
            return 0.0, 0.0
        force_n: float = self._unloading_k * elastic_m**1.5
        return force_n, 1.5 * force_n / elastic_m

    def remember(self, deformation_m: float) -> None:
        if deformation_m <= self._deepest_m:
            return
        self._deepest_m = deformation_m
        x = deformation_m / self._critical_m
        self.residual_m = deformation_m * 1.02 * (1.0 - ((x + 5.9) / 6.9) ** -0.54)
        force_n, _ = self._curve(deformation_m)
        self._unloading_k = force_n / (deformation_m - self.residual_m) ** 1.5


class Hysteresis(Around):
    """Takes a share of the loading work of `inner` in every full cycle.

    F = L(δ) (1 − η (1 − z)/2); z goes to 1 on loading and to −1 on unloading, by the power 1/c of
    the ratio of deformations, c = `TURNING_SHARE`. A full cycle on L = K δ^n then loses
    η/(1 + c (n+1)) of the loading work, from which η follows.
    """

    def __init__(self, inner: ContactLaw, share: float, n: float) -> None:
        super().__init__(inner)
        self._eta = share * (1.0 + TURNING_SHARE * (n + 1.0))
        if not 0.0 <= self._eta < 1.0:
            limit = 1.0 / (1.0 + TURNING_SHARE * (n + 1.0))
            raise DomainError(f"hysteresis {share:g} is not in 0 … {limit:.2f}")
        self._elastic_m = 0.0
        self._z = 1.0
        self._rising = True

    def _turn(self, elastic_m: float) -> tuple[float, bool]:
        last_m = self._elastic_m
        if elastic_m > last_m or (elastic_m == last_m and self._rising):
            if last_m <= 0.0:
                return 1.0, True
            return 1.0 + (self._z - 1.0) * (last_m / elastic_m) ** (1.0 / TURNING_SHARE), True
        return -1.0 + (self._z + 1.0) * (elastic_m / last_m) ** (1.0 / TURNING_SHARE), False

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        force_n, stiffness = self._inner.evaluate(deformation_m)
        elastic_m = deformation_m - self._inner.residual_m
        if force_n <= 0.0 or elastic_m <= 0.0:
            return 0.0, 0.0
        z, rising = self._turn(elastic_m)
        share = 1.0 - 0.5 * self._eta * (1.0 - z)
        turning = (1.0 - z if rising else 1.0 + z) / (TURNING_SHARE * elastic_m)
        return share * force_n, share * stiffness + 0.5 * self._eta * force_n * turning

    def remember(self, deformation_m: float) -> None:
        self._inner.remember(deformation_m)
        elastic_m = deformation_m - self._inner.residual_m
        if elastic_m <= 0.0:
            self._elastic_m, self._z, self._rising = 0.0, 1.0, True
            return
        self._z, self._rising = self._turn(elastic_m)
        self._elastic_m = elastic_m


class HardStop(Around):
    """A body of `stiffness` hidden at a deformation of `stop_m`, parallel to `inner`."""

    def __init__(self, inner: ContactLaw, stop_m: float, stiffness_n_per_m: float) -> None:
        super().__init__(inner)
        self._stop_m = stop_m
        self._stiffness = stiffness_n_per_m

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        force_n, stiffness = self._inner.evaluate(deformation_m)
        beyond_m = deformation_m - self._stop_m
        if beyond_m <= 0.0:
            return force_n, stiffness
        return force_n + self._stiffness * beyond_m, stiffness + self._stiffness
