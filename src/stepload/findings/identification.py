"""From force and travel to a law with an interval that can be believed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError, DomainError
from stepload.feasibility.after import Judgement, judge
from stepload.findings.conditions import Conditions
from stepload.identify.budget import Budget, budget
from stepload.identify.decide import decide
from stepload.identify.fit import Fit, Flag
from stepload.identify.fit_all import SAMPLES, fit_all, payload_deformation
from stepload.identify.sampling import uniform_in_force

FloatArray = NDArray[np.float64]

REPORTED = ("rs_btls", "rs_rtls", "joint")
"""Always reported: the paper's two fits and the one with a fitted zero."""
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


def _budgets(
    fits: Mapping[str, Fit], deformation_m: FloatArray, force_n: FloatArray,
    conditions: Conditions, force_rate_n_per_s: FloatArray | float,
) -> dict[str, Budget]:  # fmt: skip
    found = {}
    for name in ("rs_btls", "inverse_ls", "joint"):
        fit = fits.get(name)
        if fit is None:
            continue
        at_touch_m = (conditions.touch_force_n / fit.k) ** (1.0 / fit.n)
        sources = replace(
            conditions.sources,
            force_rate_n_per_s=force_rate_n_per_s,
            zero_sigma_m=None if name == "joint" else max(at_touch_m, 0.0),
        )
        try:
            found[name] = budget(fit, deformation_m, force_n, sources)
        except (DomainError, np.linalg.LinAlgError):
            continue
    return found


def identify(
    travel_m: FloatArray, force_n: FloatArray, conditions: Conditions,
    *, time_s: FloatArray | None = None,
) -> Identification:  # fmt: skip
    """Fit, choose, state the uncertainty and judge.

    Args:
        travel_m: (N,) travel since touch in m, loading only, in the order of time.
        force_n: (N,) contact force in N.
        conditions: what the data do not tell themselves.
        time_s: (N,) times in s, where there are any.

    Raises:
        BadInputError: too few samples in contact, or no estimator takes the data.
    """
    pressing = force_n > 0.0
    if int(pressing.sum()) < 10:
        raise BadInputError(
            f"{int(pressing.sum())} samples with positive force; at least 10 are needed",
            hint="check the sign of the force: pressing is positive",
        )
    stiffness = conditions.sources.system_stiffness_n_per_m
    peak_n = float(force_n.max())
    fits = fit_all(
        travel_m, force_n, system_stiffness_n_per_m=stiffness,
        secant_force_n=conditions.secant_force_n, elastic_limit_n=conditions.elastic_limit_n,
        time_s=time_s,
    )  # fmt: skip
    loaded = np.flatnonzero(pressing)
    chosen = loaded[uniform_in_force(force_n[loaded], SAMPLES)]
    deformation_m = travel_m if stiffness is None else payload_deformation(
        travel_m, force_n, stiffness
    )  # fmt: skip
    x, y = deformation_m[chosen], force_n[chosen]
    rate: FloatArray | float = 0.0
    if time_s is not None and conditions.sources.lag_sigma_s > 0.0:
        rate = _force_rate(time_s, force_n)[chosen]
    budgets = _budgets(fits, x, y, conditions, rate)
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
        deformation_m=x,
        force_n=y,
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
    return judge(
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


def _force_rate(time_s: FloatArray, force_n: FloatArray, window_s: float = 0.1) -> FloatArray:
    """Force rate (N,) in N/s over a window that is long against the noise."""
    interval_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else math.nan
    reach = max(1, round(0.5 * window_s / interval_s)) if interval_s > 0.0 else 1
    index = np.arange(len(time_s))
    before, after = np.maximum(index - reach, 0), np.minimum(index + reach, len(index) - 1)
    elapsed_s = np.maximum(time_s[after] - time_s[before], 1e-9)
    return np.asarray((force_n[after] - force_n[before]) / elapsed_s)
