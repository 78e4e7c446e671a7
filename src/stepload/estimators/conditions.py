"""Inputs of identification other than the data."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray
from stepload.estimators.lateral_effect import Across
from stepload.estimators.sources import Sources

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
        secant_force_n: force the secants are taken at.
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
        laws: names of the chosen laws, see `contact.law_names`; empty: all laws are tried.
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
    laws: tuple[str, ...] = ()
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

    def unseen_sigma(self, force_n: FloatArray) -> FloatArray:
        """Standard uncertainty (N,) in m where the table has no row near; 0 without a table."""
        table = self.sources.deflection()
        return np.zeros_like(force_n) if table is None else table.unseen_sigma_at(force_n)

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
