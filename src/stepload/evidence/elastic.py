"""The elastic reference contact of a run: a power law through its first loading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.evidence.chord import Chord
from stepload.evidence.lawfit import Whitened, fit_law
from stepload.evidence.laws import POWER
from stepload.evidence.loops import Branch, Deflection

_SIGMA = 0.005
"""Uniform error for the fit, as a share of the deformation; only slopes are used of it."""
_STEP = 0.01


@dataclass(frozen=True, slots=True)
class Elastic:
    """δ = at_top (F/F_top)^q for the payload, and the system's deflection.

    Attributes:
        at_top_m: deformation of the payload at the top force.
        q: power, 1/n.
        top_n: the top force.
        deflection: of the system, in m at forces (N,).
    """

    at_top_m: float
    q: float
    top_n: float
    deflection: Deflection

    def deformation(self, force_n: FloatArray) -> FloatArray:
        """Deformation (N,) of the payload in m."""
        return np.asarray(self.at_top_m * (np.maximum(force_n, 0.0) / self.top_n) ** self.q)

    def travel(self, force_n: FloatArray) -> FloatArray:
        """Travel (N,) of payload and system in m."""
        return np.asarray(self.deformation(force_n) + self.deflection(force_n))

    def payload_compliance(self, force_n: FloatArray) -> FloatArray:
        """dδ/dF (N,) of the payload in m/N."""
        u = np.maximum(force_n / self.top_n, 1e-3)
        return np.asarray(self.at_top_m * self.q * u ** (self.q - 1.0) / self.top_n)

    def system_compliance(self, force_n: FloatArray) -> FloatArray:
        """The same of the system."""
        step = _STEP * self.top_n
        return np.asarray((self.deflection(force_n + step) - self.deflection(force_n)) / step)

    def compliance(self, force_n: FloatArray) -> FloatArray:
        """The same of both together."""
        return np.asarray(self.payload_compliance(force_n) + self.system_compliance(force_n))

    def payload_at(self, force_n: float) -> float:
        """Compliance of the payload in m/N at one force."""
        return float(self.payload_compliance(np.array([force_n]))[0])

    def at(self, force_n: float) -> float:
        """Compliance of both together in m/N at one force."""
        return float(self.compliance(np.array([force_n]))[0])


def elastic_of(first: Branch, raw: Chord, deflection: Deflection) -> Elastic:
    """The power law through a loading; a straight line where none can be fitted."""
    path = first.path
    sigma_m = _SIGMA * raw.span_m
    data = Whitened(path.force_n, first.deformation_m, sigma_m**2 * np.eye(path.size))
    found = fit_law(data, POWER)
    if found is None:
        return Elastic(raw.span_m / (1.0 - raw.from_n / raw.to_n), 1.0, data.top_n, deflection)
    best = found.best
    return Elastic(float(best.coefficients[1]), best.shape, data.top_n, deflection)
