"""Least squares in the deformation, δ = δ0 + (F/K)^(1/n), with the zero δ0 known or free.

For a given power 1/n the model is linear in δ0 and in the deformation at the highest force. So the
least squares are a function of the power alone: a grid finds its lowest place, and a root of its
slope (scipy) the minimum to all digits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.identification.fit import Doubt, Fit, Flag, FloatArray, Points, finish, usable

_POWERS = np.geomspace(0.12, 4.0, 48)
_GRID_POINTS = 300
"""So many samples find the place on the grid; all of them the minimum."""


class _Model(NamedTuple):
    """δ = zero + at_top · (F/F_top)^power."""

    zero_m: float
    at_top_m: float
    power: float


def inverse_ls(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    secant_force_n: float = 300.0,
    sigma_m: float | None = None,
) -> Fit:
    """Fit K and n by min Σ (δ - (F/K)^(1/n))²: best where the zero of δ is known exactly.

    Args:
        deformation_m: (L,) deformations in m.
        force_n: (L,) forces in N; points without force are left out.
        secant_force_n: where the secant (28) is taken, in N.
        sigma_m: standard deviation of δ for the covariance; None: that of the residuals.

    Raises:
        DomainError: unusable data, or a deformation that does not rise with force.
    """
    points = usable(deformation_m, force_n, at_least=3, known_zero=False)
    return _fit("inverse_ls", points, secant_force_n, sigma_m, free_zero=False)


def joint(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    secant_force_n: float = 300.0,
    sigma_m: float | None = None,
) -> Fit:
    """Fit K, n and the zero δ0 together by min Σ (δ - δ0 - (F/K)^(1/n))².

    Args: those of `inverse_ls`; the deformations count from any zero.

    Raises:
        DomainError: unusable data, or a deformation that does not rise with force.

    Example:
        >>> import numpy as np
        >>> force_n = np.linspace(3.0, 300.0, 100)
        >>> fit = joint(1e-6 + (force_n / 6.57e8) ** (1 / 1.5), force_n)
        >>> round(fit.n, 6), round(fit.zero_m * 1e6, 6)
        (1.5, 1.0)
    """
    points = usable(deformation_m, force_n, at_least=4, known_zero=False)
    return _fit("joint", points, secant_force_n, sigma_m, free_zero=True)


def _fit(
    estimator: str, points: Points, secant_force_n: float, sigma_m: float | None, *, free_zero: bool
) -> Fit:
    if sigma_m is not None and not 0.0 < sigma_m < math.inf:
        raise DomainError(f"sigma of the deformation is {sigma_m:g} m; it must be greater than 0 m")
    log_force = np.log(points.force_n)
    top = float(log_force.max())
    log_force -= top
    if not float(log_force.min()) < -1e-9:
        raise DomainError(
            f"all {log_force.size} forces are equal ({points.force_n[0]:g} N): "
            "an exponent needs a range of loads"
        )
    profile = _Profile(points.deformation_m, log_force, free_zero)
    power, doubts = profile.lowest()
    model, cost = profile.model(power), profile.cost(power)
    if not model.at_top_m > 1e-12 * abs(model.zero_m):
        raise DomainError(
            f"the deformation does not rise with the force (by {model.at_top_m:.3g} m to the top)",
            hint="check the sign of the channels and the system stiffness used in (27)",
        )
    if sigma_m is None:
        sigma_m = math.sqrt(cost / max(log_force.size - 3, 1))
    n = 1.0 / model.power
    return finish(
        estimator,
        points,
        top - n * math.log(model.at_top_m),
        n,
        secant_force_n=secant_force_n,
        zero_m=model.zero_m,
        covariance=_covariance(model, log_force, sigma_m, free_zero),
        doubts=doubts,
    )


class _Profile:
    """The best model of each power, and how well it fits."""

    def __init__(self, deformation: FloatArray, log_force: FloatArray, free_zero: bool) -> None:
        self._log_force = log_force
        self._free_zero = free_zero
        self._mean_d = float(deformation.mean()) if free_zero else 0.0
        self._d = deformation - self._mean_d

    def _solved(self, power: float) -> tuple[float, float, FloatArray, FloatArray]:
        """at_top, mean of the shape, the shape (F/F_top)^power about it, residuals."""
        shape = np.exp(power * self._log_force)
        mean = float(shape.mean()) if self._free_zero else 0.0
        shape -= mean
        at_top = float(shape @ self._d) / float(shape @ shape)
        return at_top, mean, shape, self._d - at_top * shape

    def model(self, power: float) -> _Model:
        """The best model of this power."""
        at_top, mean, _, _ = self._solved(power)
        return _Model(self._mean_d - at_top * mean, at_top, power)

    def cost(self, power: float) -> float:
        """Sum of the squared residuals in m²."""
        residual = self._solved(power)[3]
        return float(residual @ residual)

    def slope(self, power: float) -> float:
        """What the derivative of `cost` is proportional to: its root is the minimum."""
        at_top, mean, shape, residual = self._solved(power)
        return -at_top * float(residual @ ((shape + mean) * self._log_force))

    def lowest(self) -> tuple[float, tuple[Doubt, ...]]:
        """The power of least cost; a doubt where it lies at an end of the grid."""
        from scipy.optimize import brentq

        stride = max(1, self._log_force.size // _GRID_POINTS)
        few = _Profile(self._d[::stride], self._log_force[::stride], self._free_zero)
        for profile in (few, self):
            best = int(np.argmin([profile.cost(power) for power in _POWERS]))
            low, high = _POWERS[max(best - 1, 0)], _POWERS[min(best + 1, len(_POWERS) - 1)]
            if self.slope(low) < 0.0 < self.slope(high):
                return float(brentq(self.slope, low, high, xtol=1e-14, rtol=1e-14)), ()
        power = float(_POWERS[best])
        message = f"no convergence; the last model has n = {1.0 / power:.3g}"
        return power, (Doubt(Flag.NOT_CONVERGED, message),)


def _covariance(
    model: _Model, log_force: FloatArray, sigma_m: float, free_zero: bool
) -> FloatArray | None:
    """(3, 3) of (ln K, n, δ0); None where the data cannot tell the parameters apart."""
    power, scale = model.power, model.at_top_m
    shape = np.exp(power * log_force)
    jacobian = np.stack([np.ones_like(shape), shape, shape * log_force])[0 if free_zero else 1 :]
    inner = np.zeros((3, 3))
    free = slice(0, 3) if free_zero else slice(1, 3)
    try:
        inner[free, free] = (sigma_m / scale) ** 2 * np.linalg.inv(jacobian @ jacobian.T)
    except np.linalg.LinAlgError:
        return None
    change = np.array(
        [
            [0.0, -1.0 / power, math.log(scale) / power**2],
            [0.0, 0.0, -1.0 / power**2],
            [scale, 0.0, 0.0],
        ]
    )
    covariance: FloatArray = change @ inner @ change.T
    return covariance
