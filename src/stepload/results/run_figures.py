"""Which figures the report of a run has, and what their captions say."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stepload.estimators.fit import Fit
from stepload.evidence.identification import REPORTED
from stepload.results import figures
from stepload.results.analyse import Evaluation
from stepload.results.model import Figure
from stepload.units import format_quantity as f

FloatArray = NDArray[np.float64]
LARGEST_EXPONENT = 700.0


def _law(fit: Fit) -> Callable[[FloatArray], FloatArray]:
    def law(deformation_m: FloatArray) -> FloatArray:
        return np.asarray(fit.k * np.maximum(deformation_m - fit.zero_m, 0.0) ** fit.n)

    return law


def figures_of(run: Evaluation) -> list[Figure]:
    """The figures of a run, drawn when they are wanted."""
    data, found, ticks = run.data, run.identification, run.recording.ticks
    if data is None or len(data.time_s) < 2:
        return []
    start_s = run.outcome.start_s
    trace = figures.Trace(data.time_s - start_s, data.force_n, data.travel_m, data.phase)
    limit_n = run.envelope.theory.elastic_limit_n
    made = [
        Figure(
            "time", "Force and displacement against time",
            "Tared contact force and travel since touch; colours are the phases of the procedure.",
            "force and displacement over time", partial(figures.over_time, trace),
        ),
        Figure(
            "limit", "Force against F_c",
            "Measured force and the supervisor's predicted peak against the force limit F_lim and "
            "the elastic limit F_c.",
            f"force over time, elastic limit {f(limit_n, 'N')}",
            partial(
                figures.against_limit, trace, ticks.predicted_peak_n, ticks.time_s - start_s,
                {
                    "F_c": limit_n, "counted on": run.envelope.theory.counted.lower_n,
                    "F_lim": run.envelope.force_limit_n,
                },
            ),
        ),
    ]  # fmt: skip
    if (system := run.system) is not None:
        made.append(
            Figure(
                "misfit", "What the line leaves",
                "Travel less the fitted line (26), over the forces of the fit. A bend speaks for a "
                "contact that is not settled or for a load path that is not linear.",
                "misfit of the system stiffness over force",
                partial(figures.misfit, system.misfit_force_n, system.misfit_m),
            )
        )  # fmt: skip
    if found is None:
        return made
    laws = {name: _law(found.fits[name]) for name in REPORTED if name in found.fits}
    laws[found.believe] = _law(found.fit)
    x, y = found.deformation_m, found.force_n
    made += [
        Figure(
            "law", "Force against deformation",
            f"Loading data and fits; believed is {found.believe}.",
            "force over deformation with fitted laws",
            partial(figures.force_deformation, x, y, laws, found.believe),
        ),
        Figure(
            "residuals", "Residuals",
            "Measured force minus fitted law. Residuals do not show what a fit has absorbed: the "
            "interval comes from the uncertainty budget.",
            "force residuals over force",
            partial(
                figures.residuals, y, {name: y - law(x) for name, law in laws.items()},
                found.believe,
            ),
        ),
    ]  # fmt: skip
    if (stated := found.budget) is not None:
        ln_k, n = stated.ellipse.outline()
        points = [(name, found.fits[name].k, found.fits[name].n) for name in laws]
        if np.abs(ln_k).max() > LARGEST_EXPONENT:  # says nothing about K any more
            return made
        made.append(
            Figure(
                "ellipse", "What K and n can be together",
                "K and n are strongly correlated: quote the secant, which is far better known.",
                "joint confidence region of K and n",
                partial(figures.ellipse, np.exp(ln_k), n, points),
            )
        )  # fmt: skip
    return made
