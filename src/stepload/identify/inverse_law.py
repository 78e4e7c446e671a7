"""Least squares in the deformation, δ = δ0 + (F/K)^(1/n), with δ0 known, free, or in between.

For a given 1/n the model is linear in δ0 and in the deformation c at the highest force. That gives
a start by search over 1/n alone; Gauss–Newton steps in (δ0, c, 1/n) from sums over the data then
converge quadratically.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepload.errors import DomainError
from stepload.identify.finish import finish
from stepload.identify.fit import Doubt, Fit, Flag, FloatArray
from stepload.identify.gram import gram
from stepload.identify.points import Points, loaded

_BLOCK = 8192
_START_POINTS = 2000
_POWERS = np.geomspace(0.12, 4.0, 48)
_MAX_STEPS = 60
_SMALL = 1e-6
"""Relative size of a step whose gain in cost drowns in rounding: taken unchecked."""
_TOLERANCE = 1e-7
"""Relative size of the last step; what is left after it is smaller by another factor 1e-3."""


class ZeroPrior(NamedTuple):
    """What is known of δ0 beforehand: Gaussian, mean and standard deviation in m."""

    mean_m: float
    sigma_m: float


class _Model(NamedTuple):
    """δ = zero + at_top · (F/F_top)^power."""

    zero_m: float
    at_top_m: float
    power: float


class _Sums(NamedTuple):
    """At one `_Model`: JᵀJ, Jᵀr of (zero, at_top, at_top·power) and the cost, prior included."""

    normal: FloatArray
    gradient: FloatArray
    cost: float


def inverse_ls(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    secant_force_n: float = 300.0,
    sigma_m: float | None = None,
) -> Fit:
    """min Σ (δ - (F/K)^(1/n))²: best where the zero of δ is known exactly.

    Args:
        deformation_m: (L,) deformations in m.
        force_n: (L,) forces in N; points without force are left out.
        secant_force_n: where the secant (28) is taken, in N.
        sigma_m: standard deviation of δ for the covariance; None: that of the residuals.

    Raises:
        DomainError: unusable data, or a deformation that does not rise with force.
    """
    points = loaded(deformation_m, force_n, at_least=3)
    return _fit("inverse_ls", points, secant_force_n, sigma_m, None, free_zero=False)


def joint(
    deformation_m: ArrayLike,
    force_n: ArrayLike,
    *,
    secant_force_n: float = 300.0,
    sigma_m: float | None = None,
    zero_prior: tuple[float, float] | None = None,
) -> Fit:
    """min Σ (δ - δ0 - (F/K)^(1/n))² over K, n and the zero δ0.

    Args:
        deformation_m: (L,) deformations in m from any zero.
        force_n: (L,) forces in N; points without force are left out.
        secant_force_n: where the secant (28) is taken, in N.
        sigma_m: standard deviation of δ, for the covariance and against the prior; None: that of
            the residuals of the fit without prior.
        zero_prior: `ZeroPrior` or (mean, standard deviation) of δ0 in m; adds (δ0-mean)²/sd².

    Returns:
        The fit "joint", or "joint_prior" with a prior.

    Raises:
        DomainError: unusable data, or a deformation that does not rise with force.

    Example:
        >>> import numpy as np
        >>> force_n = np.linspace(3.0, 300.0, 100)
        >>> fit = joint(1e-6 + (force_n / 6.57e8) ** (1 / 1.5), force_n)
        >>> round(fit.n, 6), round(fit.zero_m * 1e6, 6)
        (1.5, 1.0)
    """
    points = loaded(deformation_m, force_n, at_least=4)
    if zero_prior is None:
        return _fit("joint", points, secant_force_n, sigma_m, None, free_zero=True)
    prior = ZeroPrior(*zero_prior)
    if not (math.isfinite(prior.mean_m) and 0.0 < prior.sigma_m < math.inf):
        raise DomainError(
            f"prior of the zero is {prior.mean_m:g} ± {prior.sigma_m:g} m; the mean must be finite "
            "and the standard deviation finite and greater than 0 m"
        )
    return _fit("joint_prior", points, secant_force_n, sigma_m, prior, free_zero=True)


def _fit(
    estimator: str,
    points: Points,
    secant_force_n: float,
    sigma_m: float | None,
    prior: ZeroPrior | None,
    *,
    free_zero: bool,
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
    columns = slice(0, 3) if free_zero else slice(1, 3)
    stride = max(1, log_force.size // _START_POINTS)
    few = points.deformation_m[::stride], log_force[::stride]
    model = _rising(_search(*few, free_zero=free_zero))
    if stride > 1:
        model, _, _ = _descend(model, *few, columns, None, 0.0)
    whole = points.deformation_m, log_force
    if prior is not None and sigma_m is None:
        model, sums, _ = _descend(model, *whole, columns, None, 0.0)
        sigma_m = _residual_sigma(sums.cost, log_force.size)
    weight = 0.0 if prior is None or sigma_m is None else (sigma_m / prior.sigma_m) ** 2
    model, sums, doubts = _descend(model, *whole, columns, prior, weight)
    _rising(model)
    if sigma_m is None:
        sigma_m = _residual_sigma(sums.cost, log_force.size)
    n = 1.0 / model.power
    log_k = top - n * math.log(model.at_top_m)
    return finish(
        estimator,
        points,
        log_k,
        n,
        secant_force_n=secant_force_n,
        zero_m=model.zero_m,
        covariance=_covariance(model, sums.normal, columns, sigma_m),
        doubts=doubts,
    )


def _rising(model: _Model) -> _Model:
    if not model.at_top_m > 1e-12 * abs(model.zero_m):
        raise DomainError(
            f"the deformation does not rise with the force (by {model.at_top_m:.3g} m to the top)",
            hint="check the sign of the channels and the system stiffness used in (27)",
        )
    return model


def _search(deformation: FloatArray, log_force: FloatArray, *, free_zero: bool) -> _Model:
    """Best model on a grid of powers; for each the other two parameters in closed form."""
    best, least = _Model(0.0, 1.0, 1.0), math.inf
    mean_d = float(deformation.mean()) if free_zero else 0.0
    d = deformation - mean_d
    for power in _POWERS:
        u = np.exp(power * log_force)
        mean_u = float(u.mean()) if free_zero else 0.0
        u -= mean_u
        at_top = float(u @ d) / float(u @ u)
        residual = d - at_top * u
        cost = float(residual @ residual)
        if cost < least:
            best, least = _Model(mean_d - at_top * mean_u, at_top, float(power)), cost
    return best


def _descend(
    model: _Model,
    deformation: FloatArray,
    log_force: FloatArray,
    columns: slice,
    prior: ZeroPrior | None,
    weight: float,
) -> tuple[_Model, _Sums, tuple[Doubt, ...]]:
    """Damped Gauss–Newton from `model`; the sums are those before the last, tiny step."""
    sums = _sums(model, deformation, log_force, prior, weight)
    for _ in range(_MAX_STEPS):
        step = np.zeros(3)
        try:
            step[columns] = np.linalg.solve(sums.normal[columns, columns], sums.gradient[columns])
        except np.linalg.LinAlgError:
            break
        step[2] /= model.at_top_m
        scale = abs(model.at_top_m)
        size = max(abs(step[0]) / scale, abs(step[1]) / scale, abs(step[2]) / model.power)
        if size < _TOLERANCE:
            return _stepped(model, step), sums, ()
        for halvings in range(30):
            trial = _stepped(model, step * 0.5**halvings)
            if not 0.02 < trial.power < 50.0:
                continue
            trial_sums = _sums(trial, deformation, log_force, prior, weight)
            if size < _SMALL or trial_sums.cost <= sums.cost:
                break
        else:
            break
        model, sums = trial, trial_sums
    message = f"no convergence; the last model has n = {1.0 / model.power:.3g}"
    return model, sums, (Doubt(Flag.NOT_CONVERGED, message),)


def _stepped(model: _Model, step: FloatArray) -> _Model:
    return _Model(*(float(value) for value in np.add(model, step)))


def _sums(
    model: _Model,
    deformation: FloatArray,
    log_force: FloatArray,
    prior: ZeroPrior | None,
    weight: float,
) -> _Sums:
    total = np.zeros((4, 4))
    rows = np.empty((4, min(_BLOCK, log_force.size)))
    rows[0] = 1.0
    for start in range(0, log_force.size, _BLOCK):
        x = log_force[start : start + _BLOCK]
        part = rows[:, : x.size]
        np.multiply(x, model.power, out=part[1])
        np.exp(part[1], out=part[1])
        np.multiply(part[1], x, out=part[2])
        np.multiply(part[1], -model.at_top_m, out=part[3])
        part[3] += deformation[start : start + _BLOCK]
        part[3] -= model.zero_m
        total += gram(part)
    normal, gradient, cost = total[:3, :3], total[:3, 3], float(total[3, 3])
    if prior is not None:
        off = prior.mean_m - model.zero_m
        normal[0, 0] += weight
        gradient[0] += weight * off
        cost += weight * off * off
    return _Sums(normal, gradient, cost)


def _residual_sigma(cost: float, count: int) -> float:
    return math.sqrt(max(cost, 0.0) / max(count - 3, 1))


def _covariance(
    model: _Model, normal: FloatArray, columns: slice, sigma_m: float
) -> FloatArray | None:
    """(3, 3) of (ln K, n, δ0) from the JᵀJ of `_Sums`; None where it is singular."""
    inner = np.zeros((3, 3))
    try:
        inner[columns, columns] = sigma_m**2 * np.linalg.inv(normal[columns, columns])
    except np.linalg.LinAlgError:
        return None
    power, at_top = model.power, model.at_top_m
    change = np.array(
        [
            [0.0, -1.0 / (power * at_top), math.log(at_top) / (power**2 * at_top)],
            [0.0, 0.0, -1.0 / (power**2 * at_top)],
            [1.0, 0.0, 0.0],
        ]
    )
    covariance: FloatArray = change @ inner @ change.T
    return covariance
