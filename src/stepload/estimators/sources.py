"""Sources of error of a press run, and the effect of each on (ln K, n, δ0)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stepload.estimators.deflection import DeflectionTable
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.linearity import linearity_errors
from stepload.estimators.sensitivity import law_compliance
from stepload.estimators.smooth import few_degrees, propagate_smooth, smooth_lengths, worst_of

LEAST_SIGMA = 1e-6
"""Least noise assumed for a channel without noise in a fit of both, as a share of its range."""
HARMONICS = 200
"""So many of the error of a quantum are counted."""


@dataclass(frozen=True, slots=True)
class Sources:
    """What is known of the errors in a run; standard uncertainties in SI, 0 where negligible.

    Attributes:
        system_stiffness_n_per_m: K_s that was subtracted (27); None where a gauge across the
            contact measured the deformation itself.
        system_stiffness_sigma_n_per_m: its standard uncertainty. It must hold the gain of the force
            sensor where K_s was measured with another one; with the same sensor the gain cancels.
        smooth_error_m: sd of the smooth deformation error, from the K_s run.
        smooth_degrees: degrees of freedom that it was estimated with; None: its size is known. Its
            line is then widened so that the 1.96 σ of the budget still cover 95 % (GUM G.4).
        smooth_length_n: its correlation length in force; None: not known, `smooth_lengths` of the
            data are carried through and the worst of them counts.
        force_noise_n, position_noise_m: white noise of a single point given to the fit.
        force_resolution_n, position_resolution_m: quanta. The error of position is constant while
            the travel stays within a quantum.
        zero_sigma_m: uncertainty of δ = 0. Two-parameter fits take the zero as given, so it must
            hold the deformation at the touch threshold; a joint fit, which fits it, ignores it.
        lag_sigma_s: uncertainty of the time between force and position after alignment.
        force_rate_n_per_s: force rate at each point (N,), or one for all.
        gain_sigma: relative uncertainty of the force calibration.
        zero_drift_n_per_s: largest drift of the force's zero that is stated; it counts where the
            zero was not looked at again after the contact.
        nonlinearity: largest departure of the force reading from a line, as a share of the largest
            force of the data.
        temperature_sigma_k: standard uncertainty of the temperature, which also covers its change
            during the data; with `position_m_per_k` (thermal growth of the loop, spread evenly over
            the points in the order given) and `modulus_per_k` (relative change of the payload's
            modulus).
        deflection_force_n, deflection_m, deflection_sigma_m: rows of the table δ_s(F) that was
            subtracted in place of F/K_s; empty without one. `system_stiffness_sigma_n_per_m` is
            then what is common to all rows, in proportion (a contact in series).
        system_stiffness_note: why that uncertainty is not the one that was stated; "" where it is.
    """

    system_stiffness_n_per_m: float | None
    system_stiffness_sigma_n_per_m: float = 0.0
    smooth_error_m: float = 0.0
    smooth_degrees: float | None = None
    smooth_length_n: float | None = None
    force_noise_n: float = 0.0
    force_resolution_n: float = 0.0
    position_noise_m: float = 0.0
    position_resolution_m: float = 0.0
    zero_sigma_m: float | None = None
    lag_sigma_s: float = 0.0
    force_rate_n_per_s: FloatArray | float = 0.0
    gain_sigma: float = 0.0
    zero_drift_n_per_s: float = 0.0
    nonlinearity: float = 0.0
    temperature_sigma_k: float = 0.0
    position_m_per_k: float = 0.0
    modulus_per_k: float = 0.0
    deflection_force_n: tuple[float, ...] = ()
    deflection_m: tuple[float, ...] = ()
    deflection_sigma_m: tuple[float, ...] = ()
    system_stiffness_note: str = ""

    def deflection(self) -> DeflectionTable | None:
        """The table that is subtracted; None where F/K_s is, or nothing.

        Raises:
            DomainError: its rows are no table.
        """
        if self.system_stiffness_n_per_m is None or not self.deflection_force_n:
            return None
        return DeflectionTable(self.deflection_force_n, self.deflection_m, self.deflection_sigma_m)

    @property
    def system_m_per_n(self) -> float:
        """1/K_s, what the system gives way in the travel; 0 where it is not in the chain."""
        stiffness = self.system_stiffness_n_per_m
        return 1.0 / stiffness if stiffness else 0.0

    @property
    def quantum_left_m(self) -> float:
        """Standard deviation of what noise leaves of the position's quantum in a mean.

        Noise of σ leaves (q/πk) exp(−2π²k²σ²/q²) of each harmonic of the error, which is a sawtooth
        over the travel (Carbone and Petri 1994); without noise it is q/√12.
        """
        if self.position_resolution_m <= 0.0:
            return 0.0
        k = np.arange(1, HARMONICS + 1)
        noise = self.position_noise_m / self.position_resolution_m
        left = np.exp(-2.0 * (math.pi * noise * k) ** 2) / (math.pi * k)
        return self.position_resolution_m * math.sqrt(0.5 * float(left @ left))


def white_sigmas(
    sources: Sources, deformation_m: FloatArray, force_n: FloatArray
) -> tuple[float, float]:
    """Standard deviations of deformation in m and force in N of one of the points (N,), never 0."""
    sigma_n = math.hypot(sources.force_noise_n, sources.force_resolution_n / math.sqrt(12.0))
    quantum_m = sources.position_resolution_m / math.sqrt(12.0)
    stiffness = sources.system_stiffness_n_per_m
    bend_m = 0.0 if stiffness is None else sigma_n / stiffness
    sigma_m = math.hypot(sources.position_noise_m, quantum_m, bend_m)
    return max(sigma_m, _least(deformation_m)), max(sigma_n, _least(force_n))


def _least(values: FloatArray) -> float:
    return max(LEAST_SIGMA * float(np.abs(values).max(initial=0.0)), math.ulp(0.0))


class Part(NamedTuple):
    """Contribution of one source: name, size in words, (3, 3) covariance of (ln K, n, δ0)."""

    source: str
    size: str
    covariance: FloatArray


def parts(
    fit: Fit,
    deformation_m: FloatArray,
    force_n: FloatArray,
    sources: Sources,
    sensitivity: FloatArray,
) -> list[Part]:
    """Every source propagated through `sensitivity` (3, N).

    The list has the same sources in the same order for every fit.
    """
    return [
        *_noise(fit, force_n, deformation_m, sources, sensitivity),
        *_systematic(fit, force_n, sources, sensitivity),
        _zero(fit, sources, sensitivity),
        *_whole_run(force_n, sources, sensitivity),
    ]


def _noise(
    fit: Fit,
    force_n: FloatArray,
    deformation_m: FloatArray,
    sources: Sources,
    sensitivity: FloatArray,
) -> list[Part]:
    """Errors that differ from point to point, or from quantum to quantum."""
    rigid = sources.system_m_per_n
    per_newton = sensitivity * (law_compliance(fit, force_n) + rigid)
    force_variance = sources.force_noise_n**2 + sources.force_resolution_n**2 / 12.0
    position = sources.position_noise_m**2 * sensitivity @ sensitivity.T
    quantum = sources.position_resolution_m
    if quantum > 0.0:
        travel = deformation_m + force_n * rigid
        _, place = np.unique(np.floor(travel / quantum), return_inverse=True)
        gathered = np.stack([np.bincount(place, row) for row in sensitivity])
        position = position + quantum**2 / 12.0 * gathered @ gathered.T
    return [
        Part(
            "force noise and quantum",
            f"{sources.force_noise_n:.3g} N, {sources.force_resolution_n:.3g} N",
            force_variance * per_newton @ per_newton.T,
        ),
        Part(
            "position noise and quantum",
            f"{sources.position_noise_m * 1e6:.3g} µm, {quantum * 1e6:.3g} µm",
            position,
        ),
    ]


def _systematic(
    fit: Fit, force_n: FloatArray, sources: Sources, sensitivity: FloatArray
) -> list[Part]:
    """Errors of the deformation that are a curve over force."""
    degrees = sources.smooth_degrees
    widening = few_degrees(degrees)
    lengths = smooth_lengths(sources.smooth_length_n, float(force_n.max()))

    def carried(size: FloatArray | float) -> FloatArray:
        return worst_of([propagate_smooth(sensitivity * size, force_n, n) for n in lengths])

    smooth = (widening * sources.smooth_error_m) ** 2 * carried(1.0)
    over = " to ".join(f"{length:.3g} N" for length in dict.fromkeys((lengths[0], lengths[-1])))
    smooth_size = f"{sources.smooth_error_m * 1e6:.3g} µm over {over}"
    if sources.smooth_length_n is None:
        smooth_size += " (length not known)"
    if degrees is not None:
        smooth_size += f", × {widening:.2f} for {degrees:.2g} degrees of freedom"
    stiffness = sources.system_stiffness_n_per_m
    bend, rigid, size = np.zeros(3), sources.system_m_per_n, "no K_s in the chain"
    if stiffness is not None:
        relative = sources.system_stiffness_sigma_n_per_m / stiffness
        bend = sensitivity @ (force_n * rigid) * relative
        size = f"{100 * relative:.3g} %"
        if sources.system_stiffness_note:
            size += f", {sources.system_stiffness_note}"
    own = np.outer(bend, bend)
    if (table := sources.deflection()) is not None:
        row_m = table.sigma_at(force_n)
        own = own + carried(row_m)
        size = f"table of this pose, rows {float(row_m.max()) * 1e6:.3g} µm, common {size}"
    late = sensitivity @ (sources.force_rate_n_per_s * (law_compliance(fit, force_n) + rigid))
    late = late * sources.lag_sigma_s
    bent = linearity_errors(force_n, sources.nonlinearity)
    crooked = sensitivity @ (bent * (law_compliance(fit, force_n) + rigid)).T
    return [
        Part(
            "smooth deformation error",
            smooth_size,
            smooth,
        ),
        Part("system stiffness K_s", size, own),
        Part("force linearity", f"{100 * sources.nonlinearity:.3g} %", crooked @ crooked.T),
        Part("alignment lag", f"{sources.lag_sigma_s * 1e3:.3g} ms", np.outer(late, late)),
    ]


def _zero(fit: Fit, sources: Sources, sensitivity: FloatArray) -> Part:
    """The zero of deformation: fitted, or taken as given."""
    name = "zero of deformation"
    if fit.estimator == "joint":
        return Part(name, "fitted; its price is in the other lines", np.zeros((3, 3)))
    sigma = sources.zero_sigma_m or 0.0
    shift = -sensitivity.sum(axis=1)
    shift[2] += 1.0
    return Part(name, f"{sigma * 1e6:.3g} µm, as given", sigma**2 * np.outer(shift, shift))


def _whole_run(force_n: FloatArray, sources: Sources, sensitivity: FloatArray) -> list[Part]:
    """Errors that scale or tilt the whole run."""
    elapsed = np.linspace(0.0, 1.0, force_n.size)
    growth = sources.temperature_sigma_k * sources.position_m_per_k * (sensitivity @ elapsed)
    in_k = np.array([1.0, 0.0, 0.0])
    softer = sources.temperature_sigma_k * sources.modulus_per_k * in_k
    gain = sources.gain_sigma * in_k
    return [
        Part("force calibration", f"{100 * sources.gain_sigma:.3g} %", np.outer(gain, gain)),
        Part(
            "temperature",
            f"{sources.temperature_sigma_k:.3g} K",
            np.outer(growth, growth) + np.outer(softer, softer),
        ),
    ]
