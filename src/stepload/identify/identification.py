"""From force and travel to a law with an interval that can be believed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError, DomainError
from stepload.identify.budget import Budget, budget
from stepload.identify.conditions import Conditions
from stepload.identify.decide import UNUSABLE, decide
from stepload.identify.fit import Fit, Flag
from stepload.identify.fit_all import fit_all, recursive_as_batch
from stepload.identify.judge import Judgement, ResultVerdict, judge
from stepload.identify.selection import Selected
from stepload.identify.sources import white_sigmas

FloatArray = NDArray[np.float64]


REPORTED = ("rs_btls", "rs_rtls", "joint")
"""Always reported: the paper's two fits and the one with a fitted zero."""
BUDGETED = (*REPORTED, "odr", "inverse_ls")
LEAST_SAMPLES = 10
SECANT_FLAGS = frozenset(Flag) - {Flag.EXPONENT_UNDETERMINED}
"""Doubts that touch the secant; an undetermined exponent alone leaves it usable."""


@dataclass(frozen=True, slots=True)
class Identification:
    """The result of one run.

    `deformation_m`, `force_n` (M,) are the points that the batch fits were made from.
    """

    fits: Mapping[str, Fit]
    believe: str
    why: tuple[str, ...]
    comparable_with_paper: bool
    budgets: Mapping[str, Budget]
    judgement: Judgement
    peak_force_n: float
    conditions: Conditions
    deformation_m: FloatArray
    force_n: FloatArray

    @property
    def fit(self) -> Fit:
        """The believed fit."""
        return self.fits[self.believe]

    @property
    def budget(self) -> Budget | None:
        """The believed fit's budget, None where it has none."""
        return self.budgets.get(self.believe)


def _zero_sigma(fits: Mapping[str, Fit], conditions: Conditions) -> float:
    """How wrong the zero may be that the fits take as given: how far the touch is beyond it, or
    how far from the touch it is found where it is fitted. 0 where the zero is given."""
    fit, touch_n = fits.get("joint") or next(iter(fits.values())), conditions.touch_force_n
    if touch_n <= 0.0 or not 0.0 < fit.k < math.inf:
        return 0.0
    stiffness = conditions.sources.system_stiffness_n_per_m
    at_touch_m = math.exp(math.log(touch_n / fit.k) / fit.n)
    return max(at_touch_m + (touch_n / stiffness if stiffness else 0.0), abs(fit.zero_m))


def _budgets(
    fits: Mapping[str, Fit], selected: Selected, conditions: Conditions
) -> dict[str, Budget]:
    """The budgets of all fits that have one."""
    zero_sigma_m = _zero_sigma(fits, conditions)
    batch = selected.samples(selected.batch)
    recursive = selected.samples(selected.recursive_used)
    found = {}
    for name in BUDGETED:
        if (fit := fits.get(name)) is None:
            continue
        samples, estimate = batch, None
        if name == "rs_rtls":
            samples = recursive
            estimate = partial(recursive_as_batch, secant_force_n=fit.secant_force_n)
        sources = replace(
            conditions.sources,
            force_rate_n_per_s=samples.force_rate_n_per_s,
            zero_sigma_m=None if name == "joint" else zero_sigma_m,
        )
        try:
            found[name] = budget(
                fit, samples.deformation_m, samples.force_n, sources, estimate=estimate
            )
        except (DomainError, np.linalg.LinAlgError):
            continue
    return found


def identify(selected: Selected, conditions: Conditions) -> Identification:
    """Fit, choose, state the uncertainty and judge.

    Args:
        selected: the samples of a loading.
        conditions: what the data do not tell themselves.

    Raises:
        BadInputError: too few samples in contact, or no estimator takes the data.
    """
    pressing = int((selected.force_n > 0.0).sum())
    if pressing < LEAST_SAMPLES:
        raise BadInputError(
            f"{pressing} samples with positive force; at least {LEAST_SAMPLES} are needed",
            hint="check the sign of the force: pressing is positive",
        )
    peak_n = float(selected.force_n.max())
    sigma_m, sigma_n = white_sigmas(conditions.sources)
    fits = fit_all(
        selected,
        secant_force_n=conditions.secant_force_n,
        elastic_limit_n=conditions.elastic_limit_n,
        sigma_m=sigma_m,
        sigma_n=sigma_n,
    )
    batch = selected.samples(selected.batch)
    budgets = _budgets(fits, selected, conditions)
    first = judge_fit(fits["joint"] if "joint" in fits else next(iter(fits.values())), None,
                      peak_n, conditions)  # fmt: skip
    decision = decide(
        fits, peak_force_n=peak_n, elastic_limit_n=conditions.elastic_limit_n,
        k_max_n_per_m=first.identifiability.k_max_n_per_m,
        sigma_n={name: each.sigma_n for name, each in budgets.items()},
        roughness_m=conditions.roughness_m,
    )  # fmt: skip
    believed = decision.fits[decision.believe]
    return Identification(
        fits=decision.fits,
        believe=decision.believe,
        why=decision.why,
        comparable_with_paper=decision.comparable_with_paper,
        budgets=budgets,
        judgement=judge_fit(believed, budgets.get(decision.believe), peak_n, conditions),
        peak_force_n=peak_n,
        conditions=conditions,
        deformation_m=batch.deformation_m,
        force_n=batch.force_n,
    )


def judge_fit(
    fit: Fit, stated: Budget | None, peak_force_n: float, conditions: Conditions
) -> Judgement:
    """Feasibility after the run, with what was measured in it.

    The secant is taken at the peak force, where (34) is meant; the interval keeps its ratio.
    """
    secant = float((peak_force_n ** (fit.n - 1.0) * fit.k) ** (1.0 / fit.n))
    interval = None
    if stated is not None:
        low, high = stated.interval_secant_n_per_m
        scale = secant / fit.secant_n_per_m
        interval = (low * scale, high * scale)
    sources = conditions.sources
    judged = judge(
        secant_n_per_m=secant,
        interval_n_per_m=interval,
        peak_force_n=peak_force_n,
        resolution_m=max(conditions.position_resolution_m, 2.0 * sources.position_noise_m),
        system_stiffness_n_per_m=sources.system_stiffness_n_per_m,
        p=conditions.p,
        s=conditions.s,
        t=conditions.t,
        doubts=[
            doubt.message
            for doubt in fit.doubts
            if doubt.flag in SECANT_FLAGS and doubt.flag is not Flag.BEYOND_K_MAX
        ],
    )
    if any(doubt.flag in UNUSABLE for doubt in fit.doubts):
        return replace(judged, verdict=ResultVerdict.NOT_IDENTIFIABLE)
    return judged
