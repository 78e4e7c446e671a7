"""System stiffness K_s from its own run (26), with a realistic standard uncertainty σ.

    F = K_s δ_s + C_s dδ_s/dt + F_0

The errors are errors of position, smooth in force, so the fit is δ = c + F/K_s − (C_s/K_s) dδ/dt.
Without the intercept a zero error of 2 µm biases K_s by −3 %. The contact in series rules the low
forces: a known one is subtracted, an unknown one bounded (`stiffness_upper_n_per_m`). Noise biases
C_s low, and a lag τ between force and position adds K_s τ to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray, IntArray
from stepload.identification.smooth import (
    NORMAL_95,
    few_degrees,
    fit_with_smooth_error,
    smooth_lengths,
)

BoolArray = NDArray[np.bool_]

_CELLS = 60
_IN_CONTACT = 0.03
"""Below this share of the largest force a sample may be noise in free air."""
_RATE_WINDOW_S = 0.1
_NORMAL_95_ONE_SIDED = 1.644854


@dataclass(frozen=True, slots=True)
class SeriesContact:
    """The contact of the K_s run, F = k δ^n; `relative_sigma` is the standard uncertainty of its
    deformation."""

    k: float
    n: float
    relative_sigma: float

    def deformation_m(self, force_n: FloatArray) -> FloatArray:
        """Deformation (N,) in m of the contact at `force_n` (N,) ≥ 0."""
        return np.asarray((np.maximum(force_n, 0.0) / self.k) ** (1.0 / self.n))


@dataclass(frozen=True, slots=True)
class SystemStiffnessFit:
    """K_s with what is needed to judge it.

    Attributes:
        sigma_n_per_m: standard uncertainty, such that K_s ± 1.96 σ covers 95 %.
        stiffness_upper_n_per_m: upper 95 % limit of K_s when a contact of exponent 3/2 in series
            explains the curvature at small force; K_s + 1.96 σ where a contact was given.
        damping_n_s_per_m: C_s as fitted, biased low; negative means not resolved.
        damping_lower_bound_n_s_per_m: one-sided 95 % lower bound of C_s, at least 0.
        intercept_n: F_0.
        msde_m: rms misfit of the line.
        smooth_error_m: size of the smooth position error, with what the line absorbs; never below
            `msde_m`.
        smooth_degrees: degrees of freedom that this size was estimated with; None: it was given.
        nonlinearity: relative change of compliance from the middle of the range to its end.
        contact_share: part of the measured compliance that was subtracted as series contact.
        contact_sigma_n_per_m: part of `sigma_n_per_m` common to all runs against that contact.
        bend_sigma_n_per_m: part of `sigma_n_per_m` that comes from a significant nonlinearity.
        error_gain_n_per_m2: the remaining part of `sigma_n_per_m`, per metre of smooth error.
        force_range_n, points: lowest and highest force, and number of the samples used.
        misfit_force_n, misfit_m: (M,) cells of force, and the misfit of the line there.
        loading_force_n, loading_m: (L,) cells of force of the loading, and the deflection there
            from any zero: travel less contact and damping.
    """

    stiffness_n_per_m: float
    sigma_n_per_m: float
    stiffness_upper_n_per_m: float
    damping_n_s_per_m: float
    damping_lower_bound_n_s_per_m: float
    intercept_n: float
    msde_m: float
    smooth_error_m: float
    smooth_degrees: float | None
    nonlinearity: float
    nonlinearity_sigma: float
    contact_share: float
    contact_sigma_n_per_m: float
    bend_sigma_n_per_m: float
    error_gain_n_per_m2: float
    force_range_n: tuple[float, float]
    points: int
    misfit_force_n: FloatArray
    misfit_m: FloatArray
    loading_force_n: FloatArray
    loading_m: FloatArray


def fit_system_stiffness(
    time_s: FloatArray,
    displacement_m: FloatArray,
    force_n: FloatArray,
    *,
    contact: SeriesContact | None = None,
    piece: IntArray | None = None,
    loading: BoolArray | None = None,
    min_force_fraction: float = 0.4,
    resolution_m: float = 0.0,
    known_error_m: float | None = None,
    length_n: float | None = None,
) -> SystemStiffnessFit:
    """Fit (26) to a run of force steps against a flat, stiff contact.

    Args:
        time_s: (N,) rising.
        displacement_m: (N,) travel into the contact, any zero.
        force_n: (N,) contact force, tared, positive when pressing.
        contact: the series contact, where it is known.
        piece: (N,) piece of the run that a sample belongs to (`piece_shifts`); None: all are one.
        loading: (N,) whether a sample belongs to a loading; None: all do.
        min_force_fraction: forces below this fraction of the largest are left out of K_s.
        resolution_m: quantum of `displacement_m`; 0 counts the whole misfit as smooth error.
        known_error_m: sd of the smooth position error; None: estimated from this run.
        length_n: its correlation length; None: not known, of `smooth_lengths` the one that makes
            K_s least sure counts.

    Raises:
        DomainError: unusable data, or a stiffness that is not positive.
    """
    _check(time_s, displacement_m, force_n)
    if not 0 <= min_force_fraction < 0.9:
        raise DomainError(f"min_force_fraction is {min_force_fraction}; limits are 0 and 0.9")
    top = float(force_n.max())
    if piece is None:
        piece = np.zeros(force_n.size, dtype=np.intp)
    elif piece.shape != force_n.shape:
        raise DomainError(f"pieces have shape {piece.shape}, forces {force_n.shape}")
    if loading is None:
        loading = np.ones(force_n.size, dtype=np.bool_)
    touched = force_n > _IN_CONTACT * top
    cells = gather(time_s, displacement_m, force_n, touched, piece, loading)
    points = int(np.count_nonzero(force_n >= min_force_fraction * top))
    fits = [
        _fit(cells, top, points, contact, min_force_fraction, resolution_m, known_error_m, length)
        for length in smooth_lengths(length_n, top)
    ]
    return max(fits, key=lambda fit: fit.sigma_n_per_m)


def _fit(
    cells: Cells,
    top: float,
    points: int,
    contact: SeriesContact | None,
    min_force_fraction: float,
    resolution_m: float,
    known_error_m: float | None,
    length_n: float,
) -> SystemStiffnessFit:
    """The fit for one correlation length of the smooth error."""
    high = cells.force_n >= min_force_fraction * top
    force, travel = cells.force_n[high], cells.displacement_m[high]
    shift = (
        np.zeros_like(cells.force_n) if contact is None else contact.deformation_m(cells.force_n)
    )
    white = quantum_sd(float(np.ptp(cells.displacement_m)) / _CELLS, resolution_m)
    base = [np.ones_like(force), force]
    rate = cells.rate_m_s[high]
    moving = bool(np.ptp(rate) > 0.0)
    columns = np.stack([*base, rate] if moving else base, axis=1)
    line = fit_with_smooth_error(columns, travel - shift[high], force, length_n, white_sd=white)
    compliance = float(line.theta[1])
    if not compliance > 0:
        raise DomainError(
            f"fitted K_s is {1 / compliance:.4g} N/m; it must be positive",
            hint="check the sign of force and travel",
        )
    stiffness = 1.0 / compliance
    # Few correlation lengths lie above min_force_fraction: the size of the smooth error is taken
    # from the whole range, with a Hertz term for the contact where that is not known.
    hertz = [] if contact is not None else [cells.force_n ** (2.0 / 3.0)]
    whole = fit_with_smooth_error(
        np.stack([np.ones_like(cells.force_n), cells.force_n, *hertz], axis=1),
        cells.displacement_m - shift,
        cells.force_n,
        length_n,
        white_sd=white,
    )
    error_m, widening = known_error_m, 1.0
    if error_m is None:
        error_m, widening = whole.smooth_sd, few_degrees(whole.degrees)
    bend, bend_sigma = _curvature(force, travel - shift[high], error_m, length_n)
    slope = 0.0 if contact is None else _slope(force, shift[high])
    gain = stiffness**2 * line.sigma(1, 1.0)
    from_contact = stiffness**2 * contact.relative_sigma * slope if contact else 0.0
    from_bend = stiffness * bend / float(np.sqrt(3.0)) if bend > 3.0 * bend_sigma else 0.0
    sigma = float(np.linalg.norm([gain * error_m * widening, from_contact, from_bend]))
    upper = stiffness + NORMAL_95 * sigma
    if contact is None:
        lowest = whole.theta[1] - _NORMAL_95_ONE_SIDED * whole.sigma(1, error_m * widening)
        upper = max(upper, 1.0 / float(lowest) if lowest > 0 else float("inf"))
    damping = bound = late = 0.0
    if moving:
        late = -float(line.theta[2])
        damping = late * stiffness
        undetected = _NORMAL_95_ONE_SIDED * stiffness * line.sigma(2, error_m * widening)
        bound = max(0.0, damping - undetected)
    return SystemStiffnessFit(
        stiffness_n_per_m=stiffness,
        sigma_n_per_m=sigma,
        stiffness_upper_n_per_m=upper,
        damping_n_s_per_m=damping,
        damping_lower_bound_n_s_per_m=bound,
        intercept_n=-float(line.theta[0]) * stiffness,
        msde_m=line.rms,
        smooth_error_m=max(error_m, line.rms),
        smooth_degrees=whole.degrees if known_error_m is None else None,
        nonlinearity=bend,
        nonlinearity_sigma=bend_sigma,
        contact_share=slope / (compliance + slope),
        contact_sigma_n_per_m=from_contact,
        bend_sigma_n_per_m=from_bend,
        error_gain_n_per_m2=gain,
        force_range_n=(float(force.min()), float(force.max())),
        points=points,
        misfit_force_n=force,
        misfit_m=travel - shift[high] - columns @ line.theta,
        loading_force_n=cells.force_n[cells.loading],
        loading_m=(cells.displacement_m - shift + late * cells.rate_m_s)[cells.loading],
    )


@dataclass(frozen=True, slots=True)
class Cells:
    """Means (M,) over the samples of a cell of force; `across_n` (M, K) of the extra columns,
    `loading` (M,) whether they belong to a loading."""

    force_n: FloatArray
    displacement_m: FloatArray
    rate_m_s: FloatArray
    across_n: FloatArray
    loading: BoolArray


def _check(time_s: FloatArray, displacement_m: FloatArray, force_n: FloatArray) -> None:
    if not (time_s.shape == displacement_m.shape == force_n.shape and force_n.ndim == 1):
        raise DomainError(
            f"time {time_s.shape}, displacement {displacement_m.shape} and force {force_n.shape} "
            "must have one and the same length"
        )
    if force_n.size < 10:
        raise DomainError(f"{force_n.size} samples; at least 10 are needed for K_s")
    if not all(np.all(np.isfinite(x)) for x in (time_s, displacement_m, force_n)):
        raise DomainError("time, displacement or force holds values that are not finite")
    if np.any(np.diff(time_s) <= 0):
        raise DomainError("time must rise from sample to sample", hint="sort and merge first")
    if not force_n.max() > 0:
        raise DomainError(f"largest force is {force_n.max():.4g} N; pressing must be positive")


def gather(
    time_s: FloatArray,
    displacement_m: FloatArray,
    force_n: FloatArray,
    mask: BoolArray,
    piece: IntArray,
    loading: BoolArray,
    across_n: FloatArray | None = None,
) -> Cells:
    """Mean force, travel and rate in cells of force, loading, resting and unloading apart: the
    holds would dominate otherwise, and only cells that move tell C_s. All pieces have the zero of
    the one with most cells. `across_n` (N, K) is averaged with them."""
    velocity = _windowed_rate(time_s, displacement_m)
    force_rate = _windowed_rate(time_s, force_n)
    threshold = 0.25 * float(np.quantile(np.abs(force_rate), 0.95))
    motion = np.sign(force_rate) * (np.abs(force_rate) > threshold)
    width = float(force_n.max()) / _CELLS
    keys = 3 * np.floor(force_n[mask] / width).astype(np.intp) + motion[mask].astype(np.intp)
    keys = 2 * keys + loading[mask]
    shift_m, known = piece_shifts(displacement_m[mask], keys, piece[mask])
    _, index, count = np.unique(keys[known], return_inverse=True, return_counts=True)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(index, values[known]) / count)

    beside = np.zeros((force_n.size, 0)) if across_n is None else across_n
    return Cells(
        mean(force_n[mask]),
        mean(displacement_m[mask] - shift_m),
        mean(velocity[mask]),
        np.stack([mean(column) for column in beside[mask].T], axis=1)
        if beside.shape[1]
        else np.zeros((count.size, 0)),
        mean(loading[mask].astype(np.float64)) > 0.5,
    )


def piece_shifts(
    displacement_m: FloatArray, cell: IntArray, piece: IntArray
) -> tuple[FloatArray, BoolArray]:
    """A common zero for the pieces of a run, between which set, drift or a touch shifts the travel.

    The shifts are taken where two pieces have cells of force in common, which is least squares with
    an intercept per piece.

    Args:
        displacement_m: (N,) travel.
        cell: (N,) cell of force (and of motion) that the sample belongs to.
        piece: (N,) number of the piece of the run that it belongs to.

    Returns:
        Shift (N,) in m of each sample's piece against the piece with most cells, and (N,) whether
        it is known: a piece that shares no cell with that one cannot be placed.
    """
    _, cells = np.unique(cell, return_inverse=True)
    numbers, pieces = np.unique(piece, return_inverse=True)
    shape = numbers.size, int(cells.max(initial=0)) + 1
    flat = np.ravel_multi_index((pieces, cells), shape)
    count = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
    total = np.bincount(flat, displacement_m, minlength=shape[0] * shape[1]).reshape(shape)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    # Of equals the first: the zero of the run is that of its first piece.
    reference = mean[int(np.argmax((count > 0).sum(axis=1)))]
    shared = np.isfinite(mean) & np.isfinite(reference)
    known = shared.any(axis=1)
    apart = np.where(shared, mean - reference, 0.0).sum(axis=1) / np.maximum(shared.sum(axis=1), 1)
    return np.asarray(apart[pieces]), np.asarray(known[pieces])


def _windowed_rate(time_s: FloatArray, values: FloatArray) -> FloatArray:
    interval = float(np.median(np.diff(time_s)))
    reach = max(1, min(round(_RATE_WINDOW_S / interval), values.size // 4))
    index: IntArray = np.arange(values.size)
    before, after = np.maximum(index - reach, 0), np.minimum(index + reach, values.size - 1)
    return np.asarray((values[after] - values[before]) / (time_s[after] - time_s[before]))


def quantum_sd(travel_m: float, quantum_m: float) -> float:
    """Standard deviation in m left of a quantum after averaging over `travel_m`."""
    if quantum_m <= 0.0:
        return 0.0
    return quantum_m / float(np.sqrt(12.0)) * float(np.sinc(min(travel_m / quantum_m, 1.0)))


def _slope(x: FloatArray, y: FloatArray) -> float:
    centred = x - x.mean()
    return float(centred @ y / (centred @ centred))


def _curvature(
    force_n: FloatArray, travel_m: FloatArray, error_m: float, length_n: float
) -> tuple[float, float]:
    """Relative change of compliance from mid-range to the end, and its standard uncertainty."""
    half = 0.5 * float(np.ptp(force_n))
    place = (force_n - force_n.mean()) / half
    fit = fit_with_smooth_error(
        np.stack([np.ones_like(place), place, place**2], axis=1), travel_m, force_n, length_n
    )
    scale = 2.0 / abs(float(fit.theta[1]))
    return scale * abs(float(fit.theta[2])), scale * fit.sigma(2, error_m)
