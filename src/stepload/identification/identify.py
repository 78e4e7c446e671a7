"""From force and travel of a run to its law, its stiffnesses and the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from stepload.errors import BadInputError, DomainError
from stepload.identification.conditions import Conditions, white_sigmas
from stepload.identification.estimators import decide, fit_all, secant_sigma
from stepload.identification.expected import Narrowing, narrowing
from stepload.identification.fit import Fit, FloatArray
from stepload.identification.identifiability import k_max
from stepload.identification.loops import LEAST_STRETCHES
from stepload.identification.quantity import Quantity, ResultVerdict, interval_said
from stepload.identification.run_data import RunData
from stepload.identification.samples import Selected
from stepload.identification.smooth import NORMAL_95
from stepload.identification.verdict import Judgement, judge
from stepload.units import format_quantity

REPORTED = ("rs_btls", "rs_rtls", "joint")
"""Always reported: the paper's two fits and the one with a fitted zero."""
LEAST_SAMPLES = LEAST_STRETCHES
"""Least number of points of a loading in contact; fewer have no local stiffness."""


@dataclass(frozen=True)
class Identification:
    """The result of one run.

    Attributes:
        fits: those of the paper and others, by name; `selected` is the one to use, for the reasons
            `why`; `comparable_with_paper`: whether its exponent compares with the paper's tables.
        peak_force_n: largest force of the loading.
        run: the input, from which figures at other forces can be read.
        deformation_m, force_n: (M,) points that the batch fits were made from.
        judgement: what the data show; None where they support no stiffness, for the reason
            `problem`.
    """

    fits: Mapping[str, Fit]
    selected: str
    why: tuple[str, ...]
    comparable_with_paper: bool
    peak_force_n: float
    deformation_m: FloatArray
    force_n: FloatArray
    run: RunData
    judgement: Judgement | None = None
    problem: str = ""

    @property
    def conditions(self) -> Conditions:
        """Inputs other than the data."""
        return self.run.conditions

    @property
    def headline(self) -> Quantity | None:
        """The chord stiffness; None where the data support none."""
        return None if self.judgement is None else self.judgement.headline

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Every stiffness by kind; empty where the data support none."""
        return {} if self.judgement is None else self.judgement.quantities

    @property
    def verdict(self) -> ResultVerdict:
        """What the data have shown about the payload: the verdict of the headline."""
        return ResultVerdict.NOT_IDENTIFIABLE if self.headline is None else self.headline.verdict

    @cached_property
    def k_max_n_per_m(self) -> float:
        """(34) with the force that was reached; NaN where the position resolution is not known."""
        told = self.conditions
        if math.isnan(told.position_resolution_m) or not self.run.errors_known:
            return math.nan
        return k_max(replace(told, position_resolution_m=self._seen_m), self.peak_force_n)

    @property
    def _seen_m(self) -> float:
        """Resolution of the position, noise included."""
        told = self.conditions
        return max(told.position_resolution_m, 2.0 * told.sources.position_noise_m)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Whole sentences: what the verdict rests on."""
        headline, told = self.headline, self.conditions
        if headline is None:
            return (self.problem,)
        if not self.run.errors_known:
            return headline.why
        interval = interval_said(headline.half_width, told.t)
        return (*dict.fromkeys((*headline.why, interval)), *self._of_k_max(headline))

    def _of_k_max(self, headline: Quantity) -> list[str]:
        if math.isnan(self.k_max_n_per_m):
            return []
        return [
            f"chord stiffness {format_quantity(headline.value_n_per_m, 'N/m')} is "
            f"{headline.value_n_per_m / self.k_max_n_per_m:.3g} of "
            f"K_max {format_quantity(self.k_max_n_per_m, 'N/m')} (34), for the measured peak force "
            f"and a position resolution of {format_quantity(self._seen_m, 'm', 2)}"
        ]

    @cached_property
    def narrowing(self) -> Sequence[Narrowing]:
        """What narrows the headline most; computed where it is asked for."""
        return [] if self.headline is None else narrowing(self.run, self.headline)

    @property
    def fit(self) -> Fit:
        """The selected fit."""
        return self.fits[self.selected]

    @property
    def covariance(self) -> FloatArray | None:
        """(3, 3) of (ln K, n, δ0), all errors in it; None where they are not known."""
        return None if self.judgement is None else self.judgement.covariance

    @property
    def secant_sigma(self) -> float | None:
        """Relative standard uncertainty of the selected fit's secant stiffness."""
        return None if self.covariance is None else secant_sigma(self.fit, self.covariance)

    @property
    def interval_secant_n_per_m(self) -> tuple[float, float] | None:
        """95 % interval of the selected fit's secant stiffness."""
        if self.secant_sigma is None:
            return None
        factor = math.exp(min(NORMAL_95 * self.secant_sigma, 700.0))
        return self.fit.secant_n_per_m / factor, self.fit.secant_n_per_m * factor


def identify(selected: Selected, run: RunData) -> Identification:
    """Fit the first loading, judge all cycles, and select a fit.

    Args:
        selected: the samples of the first loading, for the fits.
        run: all cycles, for the verdict.

    Raises:
        BadInputError: too few samples in contact, or no estimator takes the data.
    """
    told, pressing = run.conditions, int((selected.force_n > 0.0).sum())
    if pressing < LEAST_SAMPLES:
        raise BadInputError(
            f"only {pressing} points of the loading have F > 0, {LEAST_SAMPLES} are needed",
            hint="record more points on the way up; pressing is positive",
        )
    batch = selected.samples(selected.batch)
    sigma_m, sigma_n = white_sigmas(told.sources, batch.deformation_m, batch.force_n)
    fits = fit_all(selected, secant_force_n=told.secant_force_n, sigma_m=sigma_m, sigma_n=sigma_n)
    judgement, problem = None, ""
    try:
        judgement = judge(run)
    except DomainError as error:
        problem = error.message
    covariance = None if judgement is None else judgement.covariance
    decision = decide(fits, covariance=covariance, roughness_m=told.roughness_m)
    return Identification(
        fits=decision.fits,
        selected=decision.selected,
        why=decision.why,
        comparable_with_paper=decision.comparable_with_paper,
        peak_force_n=float(selected.force_n.max()),
        deformation_m=batch.deformation_m,
        force_n=batch.force_n,
        run=run,
        judgement=judgement,
        problem=problem,
    )
