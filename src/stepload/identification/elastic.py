"""The elastic reference contact of a run, and a jump that no law explains: a slip, a click, a gauge
that was pushed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stepload.identification.chord import Chord
from stepload.identification.fit import FloatArray
from stepload.identification.lawfit import LawFit, Whitened, fit_law
from stepload.identification.laws import POWER
from stepload.identification.loops import Branch, Deflection

_SIGMA = 0.005
"""Uniform error for the fit, as a share of the deformation; only slopes are used of it."""
_STEP = 0.01
CHI2 = 25.0
"""χ² that a jump must explain: of noise alone one in 30,000 loadings of 50 places shows one."""
NEAR = 0.1
"""A jump lies in a hold whose force is within this share of its own."""


@dataclass(frozen=True, slots=True)
class Elastic:
    """δ = at_top (F/F_top)^q for the payload, and the system's deflection.

    Attributes:
        at_top_m: deformation of the payload at the top force.
        q: power, 1/n.
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


class Jump(NamedTuple):
    """Size in m, and the force it lies at."""

    size_m: float
    at_n: float


def jump_of(data: Whitened, fit: LawFit) -> Jump | None:
    """The jump that explains most of what a law leaves; None where none does.

    A step is fitted beside the law at every place of the loading.
    """
    shape = fit.best.shape
    columns = data.columns(fit.law, [shape])[0]
    if fit.law.grid.size > 1:
        step = 1e-4 * max(shape, 1e-3)
        moved = fit.law.basis(data.u, shape + step) - fit.law.basis(data.u, shape)
        own = moved @ fit.best.coefficients[1:] / (step * data.scale_m)
        columns = np.column_stack([columns, data.whiten(own * data.scale_m)])
    size = data.u.size
    steps = data.whiten(np.tril(np.ones((size, size)))[:, 1:-1] * data.scale_m)
    basis = np.linalg.qr(columns / np.linalg.norm(columns, axis=0))[0]
    left = data.y - basis @ (basis.T @ data.y)
    steps = steps - basis @ (basis.T @ steps)
    square = np.einsum("ij,ij->j", steps, steps)
    along = left @ steps
    explained = np.where(square > 1e-9, along**2 / np.maximum(square, 1e-9), 0.0)
    at = int(np.argmax(explained))
    if not explained[at] > CHI2:
        return None
    return Jump(float(along[at] / square[at]) * data.scale_m, float(data.u[at + 1]) * data.top_n)


def usual_creep(branch: Branch, elastic: Elastic, at_n: float) -> float:
    """What the hold at a force creeps in m if it does as most of the branch's, over what the
    deformation has risen since the hold before; 0 where none is."""
    forces = np.array([hold.force_n for hold in branch.holds])
    near = np.flatnonzero(np.abs(forces - at_n) < NEAR * at_n)
    if not near.size:
        return 0.0
    rises = np.maximum(np.diff(elastic.deformation(forces), prepend=0.0), 1e-12)
    compliance = elastic.compliance(forces).tolist()
    crept = [hold.creep(each) for hold, each in zip(branch.holds, compliance, strict=True)]
    return float(np.median(np.array(crept) / rises) * rises[near].max())
