"""A run against a curve from elsewhere: another machine, finite elements, theory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.identification.difference import (
    SAME_FORCE,
    Agreement,
    Difference,
    Measured,
    difference,
)
from stepload.identification.fit import FloatArray
from stepload.identification.origin import Origin
from stepload.identification.quantity import Line, Quantity
from stepload.identification.verdict import judge
from stepload.record.curves import Curve
from stepload.report.comparison_runs import ComparedRun

CHORD_SHARE = 0.1
"""A chord begins at this share of its highest force."""
NEAR, FEWEST = 0.1, 4
"""The deformation at a force is a mean of the points within this share of it, if there are so
many."""
OF_THE_CURVE = "imported curve"


@dataclass(frozen=True, slots=True)
class CurveGiven:
    """A curve of another machine, finite elements or theory, by its name.

    `modulus_pa` is its equivalent modulus (4); `plate_pa` E/(1 − ν²) of its counter body, where
    that alone differs from the run's. Both None: it needs no correction. `resolution_m` and
    `msde_m` are its position resolution δ_Δ and the root of the MSDE of its machine's K_s; both 0
    where it counts as exact. `payload`: the one it is predicted for, if any.
    """

    name: str
    curve: Curve
    modulus_pa: float | None = None
    plate_pa: float | None = None
    resolution_m: float = 0.0
    msde_m: float = 0.0
    payload: str = ""

    @property
    def corrects(self) -> bool:
        """Whether its counter body differs from the run's."""
        return self.modulus_pa is not None or self.plate_pa is not None

    @property
    def sigma_m(self) -> float:
        """Standard uncertainty of its deformation."""
        return math.hypot(self.resolution_m / math.sqrt(12.0), self.msde_m)

    def loading(self, correction: float = 1.0) -> Loading:
        """Its points up to the highest force, in contact, the forces times the correction."""
        assert self.curve.displacement_m is not None  # see `deformation_curve`
        peak = int(np.argmax(self.curve.force_n)) + 1
        deformation_m, force_n = self.curve.displacement_m[:peak], self.curve.force_n[:peak]
        usable = (force_n > 0.0) & (deformation_m > 0.0)
        return Loading(deformation_m[usable], correction * force_n[usable])


class Loading(NamedTuple):
    """Deformation and force (N,) of a curve's loading, both above 0."""

    deformation_m: FloatArray
    force_n: FloatArray

    def has(self, force_n: float) -> bool:
        """Whether its deformation at a force can be read: there, or from several points near it."""
        if not self.force_n.size:
            return False
        near = np.abs(self.force_n - force_n) <= NEAR * force_n
        least, most = float(self.force_n.min()), float(self.force_n.max())
        within = least <= force_n <= (1.0 + SAME_FORCE) * most
        return within or int(np.count_nonzero(near)) >= FEWEST

    def deformation_at(self, force_n: float) -> float:
        """Its deformation at a force that it has."""
        return _deformation_at(force_n, *self)


@dataclass(frozen=True, slots=True)
class AgainstCurve:
    """A curve against one run, at forces that both have reached.

    Attributes:
        curve, run: their names.
        estimator: the selected fit, whose misfits are given.
        from_n, to_n: the forces of the chord; secants are at `to_n`, the run's secant force or the
            highest that the curve has.
        chord: of the curve against that of the run, which needs no zero; None where one of them
            has none there.
        secant: the same from the curve's own zero and the fitted one of the run.
        secant_n_per_m: of the curve; None where it has no point as low.
        force_rms_n, deformation_rms_m: rms difference of curve and selected fit, at equal
            deformation and at equal force.
        deformation_m, force_n: (N,) points of the curve that were compared.
        left_out: points of the curve at forces that the run has not reached.
        correction: the ratio of the equivalent moduli (V-A) that the forces were multiplied by; 1
            where none was given.
    """

    curve: str
    run: str
    estimator: str
    from_n: float
    to_n: float
    chord: Difference | None
    secant: Difference | None
    secant_n_per_m: float | None
    force_rms_n: float
    deformation_rms_m: float
    deformation_m: FloatArray
    force_n: FloatArray
    left_out: int
    correction: float

    @property
    def judged(self) -> Difference | None:
        """The difference that the verdict is taken from: the chord's, else the secant's."""
        return self.chord or self.secant

    @property
    def verdict(self) -> Agreement:
        """Whether the two agree."""
        return Agreement.CANNOT_TELL if self.judged is None else self.judged.verdict


def against_curve(
    each: ComparedRun, given: CurveGiven, tolerance: float, comparisons: int = 1
) -> AgainstCurve:
    """Compare a run with one of as many curves as there are `comparisons`.

    Raises:
        BadInputError: the curve has fewer than three usable points, or its modulus cannot be
            corrected for.
    """
    correction = correction_for(each, given)
    loading = given.loading(correction)
    deformation_m, force_n = loading
    keep = force_n <= each.found.peak_force_n * (1.0 + SAME_FORCE)
    if np.count_nonzero(keep) < 3:
        raise BadInputError(
            f"{np.count_nonzero(keep)} points of the curve {given.name} are usable, 3 are needed",
            hint="deformation and force must be positive, and the force one that the run has "
            "reached; check the columns and units of the file",
        )
    fit = each.found.fit
    to_n = min(fit.secant_force_n, float(force_n.max()))
    from_n = CHORD_SHARE * to_n
    run = replace(
        each.found.run,
        between_n=(from_n, to_n),
        conditions=replace(each.found.conditions, secant_force_n=to_n, branch="loading"),
    )
    try:
        figures = judge(run).quantities
    except DomainError:
        figures = {}
    own = {
        kind: _against(each, figures.get(kind), given, loading, tolerance, comparisons)
        for kind in ("chord", "secant_from_touch")
    }
    kept_m, kept_n = deformation_m[keep], force_n[keep]
    lowest_n = float(force_n.min())
    return AgainstCurve(
        curve=given.name,
        run=each.run.name,
        estimator=each.found.selected,
        from_n=from_n,
        to_n=to_n,
        chord=own["chord"],
        secant=own["secant_from_touch"],
        secant_n_per_m=to_n / loading.deformation_at(to_n) if lowest_n <= to_n else None,
        force_rms_n=_rms(fit.k * kept_m**fit.n - kept_n),
        deformation_rms_m=_rms((kept_n / fit.k) ** (1.0 / fit.n) - kept_m),
        deformation_m=kept_m,
        force_n=kept_n,
        left_out=int(np.count_nonzero(~keep)),
        correction=correction,
    )


def correction_for(each: ComparedRun, given: CurveGiven) -> float:
    """The ratio of the equivalent moduli of run and curve (V-A).

    For one geometry K = g E_eq, with g and n of the geometry alone (3), (5), (7): F(δ) scales with
    E_eq (4) below F_c, where roughness is small against δ.
    """
    conditions = each.found.conditions
    own_pa, own_plate_pa, other_pa = conditions.modulus_pa, conditions.plate_pa, given.modulus_pa
    if not given.corrects:
        return 1.0
    if own_pa is None or (other_pa is None and own_plate_pa is None):
        raise BadInputError(
            f"{each.run.path}: the record does not tell its materials",
            hint="compare the curve as it is, or give its equivalent modulus: --curve-modulus",
        )
    if other_pa is None and given.plate_pa is not None and own_plate_pa is not None:
        other_pa = 1.0 / (1.0 / own_pa - 1.0 / own_plate_pa + 1.0 / given.plate_pa)
    assert other_pa is not None
    return own_pa / other_pa


def _against(
    each: ComparedRun,
    figure: Quantity | None,
    given: CurveGiven,
    loading: Loading,
    tolerance: float,
    comparisons: int,
) -> Difference | None:
    """The curve against a figure of the run, between the same forces."""
    if figure is None or not math.isfinite(figure.value_n_per_m):
        return None
    low_n, top_n = figure.from_n, figure.to_n
    lowest_n = float(loading.force_n.min())
    if lowest_n > (1.0 + SAME_FORCE) * (low_n or top_n):
        return None
    span_m = loading.deformation_at(top_n)
    if low_n > 0.0:
        span_m -= loading.deformation_at(low_n)
    if not span_m > 0.0:
        return None
    ends = 2.0 if low_n > 0.0 else 1.0
    line = Line(OF_THE_CURVE, "resolution, MSDE", math.sqrt(ends) * given.sigma_m / span_m)
    imported = replace(figure, value_n_per_m=(top_n - low_n) / span_m, lines=(line,))
    return difference(
        [each.measured(figure)],
        [Measured(given.name, imported, Origin())],
        tolerance=tolerance,
        comparisons=comparisons,
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _deformation_at(at_n: float, deformation_m: FloatArray, force_n: FloatArray) -> float:
    """Deformation of a curve at a force: the mean of the points near it, each carried there by the
    power that they follow, so that noise averages out; between neighbours where there are few."""
    log_force, log_deformation = np.log(force_n), np.log(deformation_m)
    near = np.abs(force_n - at_n) <= NEAR * at_n
    if np.count_nonzero(near) >= FEWEST and np.ptp(log_force[near]) > 0.0:
        x = log_force[near] - log_force[near].mean()
        power = float(x @ log_deformation[near] / (x @ x))
        return float(np.mean(deformation_m[near] * (at_n / force_n[near]) ** power))
    order = np.argsort(force_n, kind="stable")
    return math.exp(float(np.interp(math.log(at_n), log_force[order], log_deformation[order])))
