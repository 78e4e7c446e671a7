"""Figures of a run's report, and their captions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np

from stepload.contact.power_law import ContactLaw
from stepload.envelope.theory import Theory
from stepload.estimators.compare import confidence_band
from stepload.estimators.fit import Fit, FloatArray, Missing
from stepload.evidence.identification import REPORTED, Identification
from stepload.record.rows import Phase
from stepload.results import figures
from stepload.results.analyse import Evaluation
from stepload.results.certificate import other_elastic_limit
from stepload.results.conditions import measured, planned
from stepload.results.model import Figure
from stepload.results.press_data import LOADING, UNLOADING
from stepload.results.quality import quality_figure
from stepload.units import format_quantity as f


def _law(fit: Fit) -> Callable[[FloatArray], FloatArray]:
    def law(deformation_m: FloatArray) -> FloatArray:
        return np.asarray(fit.k * np.maximum(deformation_m - fit.zero_m, 0.0) ** fit.n)

    return law


def law_figure(run: Evaluation) -> Figure | None:
    """The figure that shows the result of a payload run; None where nothing was loaded."""
    data, found = run.data, run.identification
    if data is None or run.envelope.plan.identify.kind == "system":
        return None
    cycles = data.cycle[data.first_loading()]
    if not cycles.size:
        return None
    conditions = found.conditions if found else measured(planned(run.envelope), data)

    def branch(phases: tuple[Phase, ...]) -> tuple[FloatArray, FloatArray]:
        mask = data.branch(phases, int(cycles[0]))
        force_n = data.force_n[mask]
        return data.travel_m[mask] - conditions.bend(force_n), force_n

    loading = branch(LOADING)
    zero_m = found.fit.zero_m if found else 0.0
    grid_n = np.linspace(0.0, max(float(loading[1].max()), 1e-9), 200)
    band = _band(found) if found else None
    predicted = [
        (label, (grid_n / law.k) ** (1.0 / law.n) + zero_m, grid_n)
        for label, law in _predicted(run.envelope.theory)
    ]
    told = f"believed is {found.believe}" if found else "nothing could be fitted"
    banded = ", with its 95 % band" if band is not None else ""
    return Figure(
        "law", "Force against deformation",
        f"First cycle, both ways; {told}{banded}. Dotted: theory of the smooth contact, from the "
        "same zero.",
        "force over deformation with fitted and predicted laws",
        partial(
            figures.force_deformation, loading, branch(UNLOADING), _laws(found) if found else {},
            found.believe if found else "", band, predicted,
        ),
    )  # fmt: skip


def _predicted(theory: Theory) -> list[tuple[str, ContactLaw]]:
    if theory.is_range:
        return [("softest that was declared", theory.softest), ("stiffest", theory.stiffest)]
    return [("predicted, smooth", theory.law)]


def _laws(found: Identification) -> dict[str, Callable[[FloatArray], FloatArray]]:
    """The laws to draw; a fit whose force falls with the deformation is left out."""
    fits = {name: found.fits[name] for name in REPORTED if name in found.fits}
    fits[found.believe] = found.fit
    return {name: _law(fit) for name, fit in fits.items() if fit.n > 0.0}


def _band(found: Identification) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """The believed law's band over the deformations that were pressed; None without."""
    fit, covariance = found.fit, found.covariance
    reach_m = float(found.deformation_m.max()) - fit.zero_m
    if covariance is None or not 0.0 < reach_m < np.inf:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        band = confidence_band(fit, covariance, np.linspace(0.0, reach_m, 121)[1:])
    if not np.isfinite(band.upper_n).all():
        return None
    return band.deformation_m + fit.zero_m, band.lower_n, band.upper_n


def figures_of(run: Evaluation) -> list[Figure]:
    """The other figures of a run, drawn when they are wanted; see `law_figure`."""
    data, ticks = run.data, run.recording.ticks
    if data is None or len(data.time_s) < 2:
        return []
    start_s = run.outcome.start_s
    data = dataclasses.replace(data, time_s=data.time_s - start_s)
    limit_n, counted_n = (
        run.envelope.theory.elastic_limit_n, run.envelope.theory.counted.lower_n,
    )  # fmt: skip
    if (used_n := other_elastic_limit(run.envelope, run.identification)) is not None:
        limit_n = counted_n = used_n
    return [
        *_fit_figures(run),
        Figure(
            "time", "Force and displacement against time",
            "Tared contact force and travel since touch; colours are the phases of the procedure.",
            "force and displacement over time", partial(figures.over_time, data),
        ),
        Figure(
            "limit", "Force against F_c",
            "Measured force and the supervisor's predicted peak against the force limit F_lim and "
            "the elastic limit F_c.",
            f"force over time, elastic limit {f(limit_n, 'N')}",
            partial(
                figures.against_limit, data, ticks.predicted_peak_n, ticks.time_s - start_s,
                {
                    "F_c": limit_n, "F_lim": run.envelope.force_limit_n,
                    **({} if counted_n == limit_n else {"F_c used": counted_n}),
                },
            ),
        ),
    ]  # fmt: skip


def _fit_figures(run: Evaluation) -> list[Figure]:
    """Residuals of the fits, and the lateral force."""
    made, found = [], run.identification
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
    laws, x, y = _laws(found), found.deformation_m, found.force_n
    made.append(
        Figure(
            "residuals", "Residuals",
            "Measured force minus fitted law; rs_btls and rs_rtls are the paper's (25), batch and "
            "recursive; joint fits the zero too. Residuals do not show what a fit has absorbed: "
            "the interval comes from the lines of the figures.",
            "force residuals over force",
            partial(
                figures.residuals, y, {name: y - law(x) for name, law in laws.items()},
                found.believe,
            ),
        )
    )  # fmt: skip
    if not isinstance(contact := found.run.alignment.quality, Missing):
        made.append(quality_figure(contact))
    return made
