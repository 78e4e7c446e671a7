"""Inputs of identification other than the data."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from stepload.errors import DomainError
from stepload.identification.deflection import DeflectionTable
from stepload.identification.fit import FloatArray
from stepload.identification.lateral_coupling import Across

ASSUMED_NONLINEARITY = 0.005
"""Nonlinearity assumed where none is stated; a common figure of data sheets."""
_S_PEAK = math.sqrt(3.0) / 36.0
LEAST_SIGMA = 1e-6
"""Least noise assumed for a channel without noise in a fit of both, as a share of its range."""
HARMONICS = 200
"""So many of the error of a quantum are counted."""


def linearity_errors(force_n: FloatArray, nonlinearity: float) -> FloatArray:
    """Errors (2, N) in N of the reading at forces (N,), each with a standard normal size.

    A bow and an S, zero at no force and at the largest one (what errs there is the gain). A largest
    departure is the half width of a rectangle (GUM 4.3.7), shared evenly by the two shapes.

    Args:
        force_n: forces of at least 0.
        nonlinearity: largest departure from a line, as a share of the largest force.
    """
    top_n = float(force_n.max(initial=0.0))
    x = force_n / top_n if top_n > 0.0 else np.zeros_like(force_n)
    shapes = np.stack([4.0 * x * (1.0 - x), x * (x - 0.5) * (x - 1.0) / _S_PEAK])
    return np.asarray(nonlinearity / math.sqrt(6.0) * top_n * shapes)


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
        lag_sigma_s: uncertainty of the time between force and position after alignment.
        gain_sigma: relative uncertainty of the force calibration.
        zero_drift_n_per_s: largest drift of the force's zero that is stated; it counts where the
            zero was not looked at again after the contact.
        travel_drift_m_per_s: standard uncertainty of a drift of the travel that is stated; None:
            the run itself bounds it.
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
    lag_sigma_s: float = 0.0
    gain_sigma: float = 0.0
    zero_drift_n_per_s: float = 0.0
    travel_drift_m_per_s: float | None = None
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
        return _table(self.deflection_force_n, self.deflection_m, self.deflection_sigma_m)

    @property
    def quantum_left_m(self) -> float:
        """`quantum_left` of the position."""
        return quantum_left(self.position_resolution_m, self.position_noise_m)


_table = lru_cache(maxsize=16)(DeflectionTable)
"""A run's conditions ask for its table a thousand times."""


def quantum_left(quantum: float, noise: float) -> float:
    """Standard deviation of what noise of σ leaves of the error of a quantum q in a mean.

    (q/πk) exp(−2π²k²σ²/q²) of each harmonic of the error, which is a sawtooth over the true value
    (Carbone and Petri 1994); without noise it is q/√12.
    """
    if quantum <= 0.0:
        return 0.0
    k = np.arange(1, HARMONICS + 1)
    left = np.exp(-2.0 * (math.pi * noise / quantum * k) ** 2) / (math.pi * k)
    return quantum * math.sqrt(0.5 * float(left @ left))


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


BRANCHES = ("loading", "unloading", "reloading")
UNKNOWN_OFFSET_M = 0.02
"""Assumed distance of a gauge from the contact on a serial arm, where none is stated."""
ROUGH_LENGTH_SIGMA = 0.2
"""Least relative uncertainty of a roughness length 1.22 σ κ^-0.16 that was stated."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """Inputs of identification other than the data; SI units.

    Attributes:
        sources: the uncertainty sources; `system_stiffness_n_per_m` None where the travel is the
            payload's deformation already.
        touch_force_n: the contact threshold that found the zero; 0 where the zero is given.
        position_resolution_m: δ_Δ for (34); NaN where it is neither stated nor seen.
        elastic_limit_n: F_c, None where it is not known.
        roughness_m: σ_eq, None where the payload is smooth or not known.
        rough_length_m: 1.22 σ κ^-0.16 of the surface (11); 0 where it was declared smooth, None
            where it is not stated.
        rough_length_sigma: its relative standard uncertainty, at least `ROUGH_LENGTH_SIGMA`.
        p, s, t: those of (29)–(32).
        kind: "payload" or "system".
        theory_k, theory_n: the payload's contact law by theory (3), in N/m^n.
        modulus_pa: equivalent modulus (4) of payload and plate.
        plate_pa: E/(1 − ν²) of the plate alone.
        pose, temperature_c: of the run; "" and None where the plan does not state them.
        across: what is known of the effect of lateral force.
        arm: whether a serial arm presses, which friction at the contact makes stiffer.
        lever_m: from the force sensor's origin to the contact; None where it is not stated.
        misalignment_rad: largest angle between the sensor's axis and the direction of the press.
        yields_m_per_n: how far the rig gives way along the press per newton, 1/K_s, whether or not
            that is in the travel; 0 where it is not known.
        gauge_offset_m: lateral distance from the contact at which a gauge on a serial arm measures;
            0 without one.
        arm_sources: the sources of the arm's travel where a gauge measures beside it; None without
            a gauge.
        second_share: how far, as a share of the force, a sound second force channel may differ;
            None without one.
        branch: whose chord is the headline: loading, unloading or reloading.
    """

    sources: Sources
    secant_force_n: float
    touch_force_n: float
    position_resolution_m: float
    elastic_limit_n: float | None = None
    roughness_m: float | None = None
    rough_length_m: float | None = None
    p: float = 2.0
    s: float = 20.0
    t: float = 5.0
    kind: str = "payload"
    theory_k: float | None = None
    theory_n: float | None = None
    modulus_pa: float | None = None
    plate_pa: float | None = None
    pose: str = ""
    temperature_c: float | None = None
    across: Across = field(default_factory=Across)
    arm: bool = False
    lever_m: float | None = None
    misalignment_rad: float = 0.0
    yields_m_per_n: float = 0.0
    gauge_offset_m: float = 0.0
    branch: str = "loading"
    second_share: float | None = None
    arm_sources: Sources | None = None
    rough_length_sigma: float = ROUGH_LENGTH_SIGMA

    def uncovered_sigma(self, force_n: FloatArray) -> FloatArray:
        """Standard uncertainty (N,) in m where the table has no row near; 0 without a table."""
        table = self.sources.deflection()
        return np.zeros_like(force_n) if table is None else table.uncovered_sigma_at(force_n)

    def table_remarks(self, peak_force_n: float) -> list[str]:
        """A remark on the table up to a force; empty where its rows reach that far."""
        table = self.sources.deflection()
        return [said] if table is not None and (said := table.beyond(peak_force_n)) else []

    def bend(self, force_n: FloatArray) -> FloatArray:
        """Deflection (N,) in m of everything but the payload at forces (N,); 0 for a gauge.

        Raises:
            DomainError: K_s is not finite and positive.
        """
        stiffness = self.sources.system_stiffness_n_per_m
        if stiffness is None:
            return np.zeros_like(force_n)
        if (table := self.sources.deflection()) is not None:
            return table.at(force_n)
        if not 0.0 < stiffness < math.inf:
            raise DomainError(
                f"system stiffness is {stiffness:g} N/m; it must be finite and greater than 0 N/m",
                hint="calibrate the rig; data that are compensated already take none",
            )
        return force_n / stiffness

    def bend_sigma(self, force_n: FloatArray) -> FloatArray:
        """Standard uncertainty (N,) in m of the deflection, proportional to it."""
        stiffness = self.sources.system_stiffness_n_per_m
        if stiffness is None:
            return np.zeros_like(force_n)
        relative = self.sources.system_stiffness_sigma_n_per_m / stiffness
        return np.asarray(relative * self.bend(force_n))

    def table_sigma(self, force_n: FloatArray) -> FloatArray:
        """Standard uncertainty (N,) in m of the table's rows; 0 without a table."""
        table = self.sources.deflection()
        return np.zeros_like(force_n) if table is None else table.sigma_at(force_n)
