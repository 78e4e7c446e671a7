"""From force and travel to a law with a reliable interval."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from stepload.errors import BadInputError, DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.decide import decide, secant_sigma
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.fit_all import fit_all
from stepload.estimators.identifiability import identifiability
from stepload.estimators.selection import Selected
from stepload.estimators.smooth import NORMAL_95
from stepload.estimators.sources import white_sigmas
from stepload.evidence.answer import Evidence, weigh
from stepload.evidence.expected import Narrowing, narrowing
from stepload.evidence.loops import LEAST_STRETCHES
from stepload.evidence.quantity import Judgement, Quantity, ResultVerdict
from stepload.evidence.run_data import RunData
from stepload.units import beside_limit, format_quantity

REPORTED = ("rs_btls", "rs_rtls", "joint")
"""Always reported: the paper's two fits and the one with a fitted zero."""
LEAST_SAMPLES = LEAST_STRETCHES
"""Least number of points of a loading in contact; fewer have no local stiffness."""


@dataclass(frozen=True)
class Identification:
    """The result of one run.

    `evidence` holds the figures that the data support; None where they support no stiffness, and
    `judgement` says why. `run` is its input, from which figures at other forces can be read. The
    fits are those of the paper and others; `deformation_m`, `force_n` (M,) are the points that the
    batch fits were made from.
    """

    fits: Mapping[str, Fit]
    believe: str
    why: tuple[str, ...]
    comparable_with_paper: bool
    judgement: Judgement
    peak_force_n: float
    conditions: Conditions
    deformation_m: FloatArray
    force_n: FloatArray
    run: RunData
    evidence: Evidence | None = None

    @property
    def headline(self) -> Quantity | None:
        """The chord stiffness; None where the data support none."""
        return self.evidence.headline if self.evidence is not None else None

    @cached_property
    def narrowing(self) -> Sequence[Narrowing]:
        """What narrows the headline most; computed where it is asked for."""
        return [] if self.evidence is None else narrowing(self.run, self.evidence.headline)

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Every stiffness by kind; empty where the data support none."""
        return self.evidence.quantities if self.evidence is not None else {}

    @property
    def fit(self) -> Fit:
        """The believed fit."""
        return self.fits[self.believe]

    @property
    def covariance(self) -> FloatArray | None:
        """(3, 3) of (ln K, n, δ0), all errors in it; None where they are not known."""
        return self.evidence.covariance if self.evidence is not None else None

    @property
    def secant_sigma(self) -> float | None:
        """Relative standard uncertainty of the believed fit's secant stiffness."""
        return None if self.covariance is None else secant_sigma(self.fit, self.covariance)

    @property
    def interval_secant_n_per_m(self) -> tuple[float, float] | None:
        """95 % interval of the believed fit's secant stiffness."""
        if self.secant_sigma is None:
            return None
        factor = math.exp(min(NORMAL_95 * self.secant_sigma, 700.0))
        return self.fit.secant_n_per_m / factor, self.fit.secant_n_per_m * factor


def identify(selected: Selected, conditions: Conditions, run: RunData) -> Identification:
    """Fit, evaluate the evidence, state the uncertainty and judge.

    Args:
        selected: the samples of the first loading, for the fits.
        conditions: inputs other than the data.
        run: all cycles, for the evidence.

    Raises:
        BadInputError: too few samples in contact, or no estimator takes the data.
    """
    pressing = int((selected.force_n > 0.0).sum())
    if pressing < LEAST_SAMPLES:
        raise BadInputError(
            f"too few points: the loading has {pressing} with a force above 0, at least "
            f"{LEAST_SAMPLES} are needed",
            hint="record more points on the way up; pressing is positive",
        )
    peak_n = float(selected.force_n.max())
    sigma_m, sigma_n = white_sigmas(
        conditions.sources, selected.deformation_m[selected.batch], selected.force_n[selected.batch]
    )
    fits = fit_all(
        selected,
        secant_force_n=conditions.secant_force_n,
        elastic_limit_n=conditions.elastic_limit_n,
        sigma_m=sigma_m,
        sigma_n=sigma_n,
    )
    batch = selected.samples(selected.batch)
    try:
        evidence, problem = weigh(run), ""
    except DomainError as error:
        evidence, problem = None, error.message
    covariance = None if evidence is None else evidence.covariance
    decision = decide(fits, covariance=covariance, roughness_m=conditions.roughness_m)
    return Identification(
        fits=decision.fits,
        believe=decision.believe,
        why=decision.why,
        comparable_with_paper=decision.comparable_with_paper,
        judgement=_judged(evidence, problem, conditions, peak_n),
        peak_force_n=peak_n,
        conditions=conditions,
        deformation_m=batch.deformation_m,
        force_n=batch.force_n,
        run=run,
        evidence=evidence,
    )


def _judged(
    evidence: Evidence | None, problem: str, conditions: Conditions, peak_n: float
) -> Judgement:
    """The headline's verdict, and K_max by (34) at the force that was reached."""
    sources, k_max, reach = conditions.sources, math.nan, []
    resolution_m = conditions.position_resolution_m
    if not math.isnan(resolution_m):
        resolution_m = max(resolution_m, 2.0 * sources.position_noise_m)
        k_max = identifiability(
            peak_n,
            resolution_m,
            sources.system_stiffness_n_per_m,
            p=conditions.p,
            s=conditions.s,
            t=conditions.t,
        ).k_max_n_per_m
    if evidence is None:
        return Judgement(ResultVerdict.NOT_IDENTIFIABLE, (problem,), k_max)
    headline = evidence.headline
    if not math.isnan(k_max):
        share = headline.value_n_per_m / k_max
        reach.append(
            f"chord stiffness {format_quantity(headline.value_n_per_m, 'N/m')} is {share:.3g} of "
            f"K_max {format_quantity(k_max, 'N/m')} (34), for the measured peak force and a "
            f"position resolution of {format_quantity(resolution_m, 'm', 2)}"
        )
    half, most = beside_limit(headline.half_width, 1.0 / conditions.t)
    interval = (
        f"the 95 % interval is ±{half} of the chord stiffness; up to ±{most} (1/t) counts as "
        "identified"
    )
    against = [why for why in headline.why if not why.startswith("the 95 % interval")]
    return Judgement(headline.verdict, (*against, interval, *reach), k_max)
