"""Figures of a run's report, and their captions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stepload.feasibility.theory import Theory
from stepload.identification.estimators import confidence_band
from stepload.identification.fit import Fit, FloatArray
from stepload.identification.identify import REPORTED, Identification
from stepload.record.rows import Phase
from stepload.report.analyse import Evaluation
from stepload.report.certificate import other_elastic_limit
from stepload.report.conditions import measured, planned
from stepload.report.figures import (
    BLUE,
    GREEN,
    GREY,
    INK,
    MOST_DOTS,
    MOST_POINTS,
    ORANGE,
    RED,
    SAND,
    colour,
    figure_of,
    lines,
    svg_of,
    thin,
)
from stepload.report.model import Figure
from stepload.report.press_data import LOADING, UNLOADING, PressData
from stepload.units import format_quantity as f

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PHASE_TINT = {
    Phase[name]: tint
    for tint, names in {
        "#e8edf3": "FREE_AIR TARE POST_TARE", "#f3ecdc": "ALIGN TOUCH_RETRACT",
        "#e4efe8": "FAST_APPROACH RETRACT",
        "#d3e8da": "GUARDED_APPROACH DWELL", "#dbe6f4": "LOAD", "#c6d8ee": "HOLD",
        "#f7e3d6": "UNLOAD", "#f1d3be": "UNLOAD_HOLD", "#f6d0cd": "SAFING",
    }.items()
    for name in names.split()
}  # fmt: skip
Law = Callable[[FloatArray], FloatArray]
Points = tuple[FloatArray, FloatArray]
"""Deformation and force (N,) each."""


def _law(fit: Fit) -> Law:
    return lambda x: np.asarray(fit.k * np.maximum(x - fit.zero_m, 0.0) ** fit.n)


def law_figure(run: Evaluation) -> Figure | None:
    """The figure that shows the result of a payload run; None where nothing was loaded."""
    data, found = run.data, run.identification
    if data is None or run.preflight.plan.identify.kind == "system":
        return None
    cycles = data.cycle[data.first_loading()]
    if not cycles.size:
        return None
    conditions = found.conditions if found else measured(planned(run.preflight), data)

    def branch(phases: tuple[Phase, ...]) -> Points:
        mask = data.branch(phases, int(cycles[0]))
        force_n = data.force_n[mask]
        return data.travel_m[mask] - conditions.bend(force_n), force_n

    band = law_band(found) if found else None
    told = f"selected: {found.selected}" if found else "nothing could be fitted"
    banded = ", with its 95 % band" if band is not None else ""
    loading = branch(LOADING)
    predicted = _predicted(
        run.preflight.theory, float(loading[1].max()), found.fit.zero_m if found else 0.0
    )
    return Figure(
        "law", "Force against deformation",
        f"First cycle, both ways; {told}{banded}. Dotted: theory of the smooth contact, from the "
        "same zero.",
        "force over deformation with fitted and predicted laws",
        partial(
            force_deformation, loading, branch(UNLOADING), _laws(found) if found else {},
            found.selected if found else "", band, predicted,
        ),
    )  # fmt: skip


def _predicted(theory: Theory, top_n: float, zero_m: float) -> list[tuple[str, Points]]:
    grid_n = np.linspace(0.0, max(top_n, 1e-9), 200)
    laws = [("predicted, smooth", theory.law)]
    if theory.is_range:
        laws = [("softest that was declared", theory.softest), ("stiffest", theory.stiffest)]
    return [(label, ((grid_n / law.k) ** (1.0 / law.n) + zero_m, grid_n)) for label, law in laws]


def _laws(found: Identification) -> dict[str, Law]:
    """The laws to draw; a fit whose force falls with the deformation is left out."""
    fits = {name: found.fits[name] for name in REPORTED if name in found.fits}
    fits[found.selected] = found.fit
    return {name: _law(fit) for name, fit in fits.items() if fit.n > 0.0}


def law_band(found: Identification) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """The selected law's band over the deformations that were pressed; None without."""
    fit, covariance = found.fit, found.covariance
    reach_m = float(found.deformation_m.max()) - fit.zero_m
    if covariance is None or not 0.0 < reach_m < np.inf:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        deformation_m = np.linspace(0.0, reach_m, 121)[1:]
        lower_n, upper_n = confidence_band(fit, covariance, deformation_m)
    if not np.isfinite(upper_n).all():
        return None
    return deformation_m + fit.zero_m, lower_n, upper_n


def force_deformation(
    loading: Points,
    unloading: Points,
    laws: Mapping[str, Law],
    selected: str,
    band: tuple[FloatArray, FloatArray, FloatArray] | None,
    predicted: Sequence[tuple[str, Points]],
) -> str:
    """Measured force against payload deformation with every fitted law and the predicted one.

    Args:
        loading, unloading: as measured; the second may be empty.
        laws: every fitted law, deformation → force; `selected` is the name of one of them, or "".
        band: (deformation, lowest, highest force) of the selected law at 95 %, None without one.
        predicted: each law that theory predicts, by its label.
    """
    with figure_of(3.2, width=5.4) as (figure, (axes,)):
        for (x, y), dots, name in (
            (unloading, SAND, "measured, unloading"),
            (loading, GREY, "measured, loading"),
        ):
            if x.size:
                step = max(1, len(y) // MOST_DOTS)
                axes.plot(x[::step] * 1e6, y[::step], ".", ms=2.0, color=dots, label=name)
        if band is not None:
            x, low, high = band
            axes.fill_between(x * 1e6, low, high, color=BLUE, alpha=0.18, lw=0, label="95 % band")
        reach = np.linspace(float(loading[0].min()), float(loading[0].max()), 400)
        others = iter((ORANGE, GREEN, RED, INK))
        for name, law in laws.items():
            best = name == selected
            axes.plot(
                reach * 1e6, law(reach), color=BLUE if best else next(others, GREY),
                lw=2.0 if best else 1.1, ls="-" if best else "--", zorder=3 if best else 2,
                label=f"{name} (selected)" if best else name,
            )  # fmt: skip
        for label, (x, y) in predicted:
            axes.plot(x * 1e6, y, ":", lw=1.6, color=INK, label=label)
        axes.set(xlabel="payload deformation from touch [µm]", ylabel="force [N]")
        _frame(axes, loading, unloading)
        axes.legend(loc="upper left", markerscale=4, fontsize=8)
        return svg_of(figure)


def _frame(axes: Axes, loading: Points, unloading: Points) -> None:
    """Limits by what was measured: no band and no law hides it."""
    x, y = (np.concatenate(pair) for pair in zip(loading, unloading, strict=True))
    right, top = float(loading[0].max()), float(y.max())
    left = max(float(x.min()), -0.15 * abs(right))
    pad = 0.04 * ((right - left) or 1e-9)
    axes.set_xlim((left - pad) * 1e6, (max(right, float(x.max())) + pad) * 1e6)
    axes.set_ylim(min(0.0, float(y.min())), 1.1 * top if top > 0.0 else 1.0)


def figures_of(run: Evaluation) -> list[Figure]:
    """The other figures of a run, drawn when they are wanted; see `law_figure`."""
    data, ticks, start_s = run.data, run.recording.ticks, run.outcome.start_s
    if data is None or len(data.time_s) < 2:
        return []
    data = dataclasses.replace(data, time_s=data.time_s - start_s)
    theory = run.preflight.theory
    limits_n = {"F_c": theory.elastic_limit_n, "F_lim": run.preflight.force_limit_n}
    if (used_n := other_elastic_limit(run.preflight, run.identification)) is not None:
        limits_n["F_c"] = used_n
    elif theory.counted.lower_n != theory.elastic_limit_n:
        limits_n["F_c used"] = theory.counted.lower_n
    peak = ticks.predicted_peak_n, ticks.time_s - start_s
    return [
        *_fit_figures(run),
        Figure(
            "time", "Force and displacement against time",
            "Tared contact force and travel since touch; colours are the phases of the procedure.",
            "force and displacement over time", partial(over_time, data),
        ),
        Figure(
            "limit", "Force against F_c",
            "Measured force and the supervisor's predicted peak against the force limit F_lim and "
            "the elastic limit F_c.",
            f"force over time, elastic limit {f(limits_n['F_c'], 'N')}",
            partial(against_limit, data, *peak, limits_n),
        ),
    ]  # fmt: skip


def _fit_figures(run: Evaluation) -> list[Figure]:
    """Residuals of the fits, and the lateral force."""
    made, found = [], run.identification
    if run.system is not None:
        made.append(misfit_figure([("", run.system.misfit_force_n, run.system.misfit_m)]))
    if found is None:
        return made
    made.append(
        Figure(
            "residuals", "Residuals",
            "Measured force minus fitted law; rs_btls and rs_rtls are the paper's (25), batch and "
            "recursive; joint fits the zero too. Residuals do not show what a fit has absorbed: "
            "the interval comes from the lines of the figures.",
            "force residuals over force", partial(residuals, found),
        )
    )  # fmt: skip
    return made


def misfit_figure(runs: Sequence[tuple[str, FloatArray, FloatArray]]) -> Figure:
    """Misfit of the line (26) over force, of one run or several: (name, force, misfit)."""
    curves = [
        (force_n, misfit_m * 1e6, ".-", {"ms": 4, "lw": 0.8, "color": colour(i), "label": name})
        for i, (name, force_n, misfit_m) in enumerate(runs)
    ]
    return Figure(
        "misfit", "What the line leaves",
        "Travel less the fitted line (26), over the forces of the fit. A bend speaks for a contact "
        "that is not settled or for a load path that is not linear.",
        "misfit of the system stiffness over force",
        partial(lines, curves, "force [N]", "travel − line [µm]", zero=True),
    )  # fmt: skip


def residuals(found: Identification) -> str:
    """Measured force minus each fitted law, against force."""
    x, y = found.deformation_m, found.force_n
    step = max(1, len(y) // MOST_DOTS)
    curves = [
        (
            y[::step], (y - law(x))[::step], ".",
            {
                "ms": 2.0, "label": name, "zorder": 3 if name == found.selected else 2,
                "color": BLUE if name == found.selected else other,
            },
        )
        for (name, law), other in zip(
            _laws(found).items(), (ORANGE, GREEN, RED, GREY), strict=False
        )
    ]  # fmt: skip
    return lines(curves, "force [N]", "measured − law [N]", zero=True)


def over_time(data: PressData) -> str:
    """Force and travel against time, phases shaded."""
    with figure_of(5.2, rows=2) as (figure, (upper, lower)):
        for axes, value, label, line in (
            (upper, data.force_n, "force [N]", BLUE),
            (lower, data.travel_m * 1e6, "displacement [µm]", ORANGE),
        ):
            index = thin(MOST_POINTS, value)
            _shade(axes, data)
            axes.plot(data.time_s[index], value[index], color=line)
            axes.set_ylabel(label)
            axes.margins(x=0)
        seen = np.isin(data.phase, [Phase.TOUCH_RETRACT, Phase.LOAD, Phase.HOLD, Phase.UNLOAD])
        if np.any(seen):
            reach = data.travel_m[seen] * 1e6
            pad = 0.08 * (np.ptp(reach) or 1.0)
            lower.set_ylim(max(reach.min(), -0.5 * reach.max()) - pad, reach.max() + pad)
        lower.set_xlabel("time since start [s]")
        figure.legend(*upper.get_legend_handles_labels(), loc="outside upper center", ncols=6)
        return svg_of(figure)


def _shade(axes: Axes, data: PressData) -> None:
    edges = np.flatnonzero(np.diff(data.phase)) + 1
    named = set()
    for first, last in pairwise([0, *edges.tolist(), len(data.phase) - 1]):
        phase = Phase(int(data.phase[first]))
        if tint := PHASE_TINT.get(phase):
            label = None if phase in named else phase.name.replace("_", " ").lower()
            named.add(phase)
            axes.axvspan(data.time_s[first], data.time_s[last], color=tint, lw=0, label=label)


def against_limit(data: PressData, predicted_peak_n: FloatArray, tick_s: FloatArray,
                  limits_n: Mapping[str, float]) -> str:  # fmt: skip
    """Force and the supervisor's predicted peak against every limit; F_c on top."""
    with figure_of(3.4) as (figure, (axes,)):
        for time_s, force_n, style in (
            (tick_s, predicted_peak_n, {"color": GREY, "lw": 0.8, "label": "predicted peak (R2)"}),
            (data.time_s, data.force_n, {"color": BLUE, "label": "measured force"}),
        ):
            index = thin(MOST_POINTS, force_n)
            axes.plot(time_s[index], force_n[index], **style)
        for name, limit_n in limits_n.items():
            line = {"F_c": RED, "F_c used": ORANGE}.get(name, GREEN)
            axes.axhline(limit_n, color=line, ls="--", lw=1.1)
            axes.annotate(
                f"{name} {limit_n:.4g} N", (1.0, limit_n), xycoords=("axes fraction", "data"),
                ha="right", va="bottom", color=line, fontsize=9,
            )  # fmt: skip
        axes.set_ylim(top=1.12 * max([*limits_n.values(), float(np.nanmax(data.force_n))]))
        axes.margins(x=0)
        axes.set(xlabel="time since start [s]", ylabel="force [N]")
        axes.legend(loc="upper left")
        return svg_of(figure)
