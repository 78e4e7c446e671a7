"""Figures of several runs side by side: arrays in, one SVG text out each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from stepload.results.figures import BLUE, GREEN, GREY, INK, ORANGE, RED, FloatArray, _figure, _svg

COLOURS = (BLUE, ORANGE, GREEN, RED, INK, GREY)


class BandCurve(NamedTuple):
    """A force–deformation curve with its band, (N,) each."""

    deformation_m: FloatArray
    force_n: FloatArray
    lower_n: FloatArray
    upper_n: FloatArray


def bands(
    runs: Mapping[str, BandCurve], imported: tuple[FloatArray, FloatArray] | None = None
) -> str:
    """Believed laws with their 95 % bands, and an imported curve (deformation, force) as points."""
    with _figure(4.4) as (figure, (axes,)):
        for index, (name, run) in enumerate(runs.items()):
            colour = COLOURS[index % len(COLOURS)]
            micrometres = run.deformation_m * 1e6
            axes.fill_between(micrometres, run.lower_n, run.upper_n, color=colour, alpha=0.15, lw=0)
            axes.plot(micrometres, run.force_n, color=colour, label=name)
        if imported is not None:
            axes.plot(imported[0] * 1e6, imported[1], ".", ms=5, color=INK, label="imported curve")
        axes.set(xlabel="payload deformation from its zero [µm]", ylabel="force [N]")
        tops = [float(run.force_n[-1]) for run in runs.values()]
        if imported is not None:
            tops.append(float(imported[1].max()))
        axes.set_ylim(0.0, 1.15 * max(tops))
        axes.legend(loc="upper left")
        return _svg(figure)


class SecantPoint(NamedTuple):
    """A secant stiffness in N/m with its interval, None where there is none."""

    label: str
    secant_n_per_m: float
    interval_n_per_m: tuple[float, float] | None
    cycles_n_per_m: Sequence[float]


def secants(points: Sequence[SecantPoint]) -> str:
    """Secant stiffness of every run with its 95 % interval; its cycles as small marks."""
    with _figure(1.2 + 0.45 * len(points)) as (figure, (axes,)):
        for row, point in enumerate(points):
            if point.interval_n_per_m is not None:
                low, high = point.interval_n_per_m
                axes.plot([low * 1e-6, high * 1e-6], [row, row], color=BLUE, lw=2.5, alpha=0.5)
            axes.plot(
                [value * 1e-6 for value in point.cycles_n_per_m],
                [row] * len(point.cycles_n_per_m), "|", ms=9, color=ORANGE,
            )  # fmt: skip
            axes.plot([point.secant_n_per_m * 1e-6], [row], "o", ms=6, color=BLUE)
        axes.set_yticks(range(len(points)), [point.label for point in points])
        axes.set_ylim(len(points) - 0.5, -0.5)
        axes.set_xlabel("secant stiffness [N/µm]")
        return _svg(figure)


def misfits(runs: Mapping[str, tuple[FloatArray, FloatArray]]) -> str:
    """What the line of (26) leaves in each run: force and misfit in m."""
    with _figure(3.0) as (figure, (axes,)):
        for index, (name, (force_n, misfit_m)) in enumerate(runs.items()):
            axes.plot(
                force_n, misfit_m * 1e6, ".", ms=4, color=COLOURS[index % len(COLOURS)], label=name
            )
        axes.axhline(0.0, color=INK, lw=0.8)
        axes.set(xlabel="force [N]", ylabel="travel − line [µm]")
        if len(runs) > 1:
            axes.legend(loc="best")
        return _svg(figure)
