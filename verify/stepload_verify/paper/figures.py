"""Figures 4 to 14 of the paper from simulated runs, as SVG text; one function each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stepload.identification.identifiability import identifiability
from stepload.identification.ls import smallest_direction
from stepload.identification.recursive import RsRtls
from stepload.report.figures import BLUE, GREEN, GREY, INK, ORANGE, RED, figure_of, svg_of
from stepload_verify.paper import laws, simulated
from stepload_verify.paper.laws import Test
from stepload_verify.paper.printed import (
    CONE,
    METAL,
    PAYLOADS,
    SECANT_FORCE_N,
    SPHERE,
    Estimate,
    Payload,
)
from stepload_verify.paper.rigs import rigs, secants
from stepload_verify.paper.simulated import SEED, SYSTEMS, batch, points, rig_of
from stepload_verify.paper.step_load import FloatArray, RawRun, press

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TIME, _FORCE, _DEFORMATION = "time, s", "force, N", "deformation, µm"
_COLOURS = {Test.ONE: ORANGE, Test.TWO: BLUE, Test.INSTRON: GREEN}


def all_figures() -> dict[str, str]:
    """Every figure by file name."""
    drawn = {"fig-4": system(), "fig-5": one_test(SPHERE), "fig-6": one_test(METAL),
             "fig-7": recursion(), "fig-12": two_tests(METAL), "fig-13": two_tests(CONE),
             "fig-14": identifiable()}  # fmt: skip
    for number, payload in enumerate(PAYLOADS, 8):
        drawn[f"fig-{number}"] = machines(payload)
    return {f"{name}.svg": text for name, text in drawn.items()}


def run_of(payload: Payload, test: Test) -> RawRun:
    """A simulated run with the zero known, so that curves of runs and elements begin together."""
    rig, errors = rig_of(test)
    rng = np.random.default_rng(simulated.seed_of(payload, test))
    return press(laws.measured(payload, test), rig, replace(errors, touch_force_n=None), rng)


def system() -> str:
    """Fig. 4: system deformation and force over time, and over each other, against a rigid body."""
    rig, errors = rig_of(Test.ONE)
    run = press(np.zeros_like, rig, errors, np.random.default_rng(SEED))
    thin = slice(run.touch, None, 24)
    time, force, travel = run.time_s[thin], run.force_n[thin], run.travel_m[thin] * 1e6
    with _figure(7.5) as (figure, _):
        figure.clear()
        first, second, third = figure.subplots(3, 1)
        first.plot(time, travel, color=BLUE)
        first.set(ylabel="system deformation, µm", xlabel=_TIME)
        second.plot(time, force, color=BLUE)
        second.set(ylabel=_FORCE, xlabel=_TIME)
        third.plot(travel, force, ".", ms=2, color=BLUE, label="simulated")
        line = np.array([0.0, SECANT_FORCE_N])
        third.plot(1e6 * line / rig.stiffness_n_per_m, line, "--", color=INK, label="F / K_s")
        third.set(xlabel="system deformation, µm", ylabel=_FORCE)
        third.legend()
        return svg_of(figure)


def one_test(payload: Payload) -> str:
    """Figs 5 and 6: a run of test 1 with RS-BTLS, and the printed fit."""
    run = run_of(payload, Test.ONE)
    deformation, force = points(run, payload, Test.ONE)
    fit = batch(deformation, force)
    with _figure() as (figure, (axes,)):
        axes.plot(deformation[::24] * 1e6, force[::24], ".", ms=2, color=GREY, label="simulated")
        _power(axes, fit.k, fit.n, "-", BLUE, f"RS-BTLS, n̂ {fit.n:.2f}")
        _estimate(axes, payload.rs_btls[0], ORANGE, "printed")
        _force_deformation(axes)
        return svg_of(figure)


def recursion() -> str:
    """Fig. 7: K̂, n̂ and secant of the plastic sphere over time, batch and recursive."""
    run = run_of(SPHERE, Test.ONE)
    deformation, force = points(run, SPHERE, Test.ONE)
    whole = batch(deformation, force)
    fit = RsRtls(0.999, SECANT_FORCE_N, rest_band_n=3.0)
    course = []
    for i, (d, f) in enumerate(zip(deformation[::2].tolist(), force[::2].tolist(), strict=True)):
        fit.update(d, f)
        if i > 60 and i % 10 == 0:
            log_k, n = smallest_direction(fit.triangle())[:2]
            log_secant = ((n - 1) * np.log(SECANT_FORCE_N) + log_k) / n
            course.append((i / 100.0, np.exp(log_k), n, np.exp(log_secant)))
    time, *values = np.array(course).T
    printed = SPHERE.rs_rtls[0]
    with _figure(7.0, 3) as (figure, axes):
        for ax, name, value, end, text in zip(
            axes,
            ("K̂, N/m^n", "n̂", "secant, N/m"),
            values,
            (whole.k, whole.n, whole.secant_n_per_m),
            printed,
            strict=True,
        ):
            ax.plot(time, value, color=BLUE, label="RS-RTLS, 100 Hz")
            ax.axhline(end, color=INK, ls="-", lw=0.8, label="RS-BTLS of the whole run")
            ax.axhline(float(text), color=ORANGE, ls="--", label="RS-RTLS, printed")
            ax.set(ylabel=name)
            middle = max(end, float(text))
            ax.set_ylim(*((middle / 1e3, middle * 1e2) if name[0] == "K" else (0, 1.6 * middle)))
        axes[0].set(yscale="log")
        axes[0].legend(ncols=3)
        axes[-1].set(xlabel="time from touch, s")
        return svg_of(figure)  # fmt: skip


def machines(payload: Payload) -> str:
    """Figs 8 to 11: STVF test 2 and Instron with bounds, finite elements with roughness."""
    with _figure() as (figure, (axes,)):
        for test, text in ((Test.TWO, payload.rs_btls[1]), (Test.INSTRON, payload.instron)):
            name = "Instron" if test is Test.INSTRON else "STVF, test 2"
            _bounded(axes, payload, test, name)
            _estimate(axes, text, _COLOURS[test], f"{name}, printed")
        _mesh(axes, payload, "elements × (10)", RED, roughness=1.0)
        _estimate(axes, payload.rough, RED, "elements × (10), printed")
        _force_deformation(axes)
        return svg_of(figure)


def two_tests(payload: Payload) -> str:
    """Figs 12 and 13: both tests with the finite elements, smooth, rough, and with yield."""
    with _figure() as (figure, (axes,)):
        for test, text in zip((Test.ONE, Test.TWO), payload.rs_btls, strict=True):
            _bounded(axes, payload, test, test)
            _estimate(axes, text, _COLOURS[test], f"{test}, printed")
        if payload is METAL:
            _mesh(axes, payload, "elements", INK)
        _mesh(axes, payload, "elements × (10)", RED, roughness=1.0)
        if payload is CONE:
            _mesh(axes, payload, "elements × (10) × (15)", INK, roughness=1.0, yields=1.0)
        _force_deformation(axes)
        return svg_of(figure)


def identifiable() -> str:
    """Fig. 14: K_max (34) over K_s and K_r = F_max / δ_Δ."""
    stiffness, resolution = np.geomspace(1e5, 1e9, 61), np.geomspace(1e6, 1e10, 61)
    k_max = np.array([
        [identifiability(SECANT_FORCE_N, SECANT_FORCE_N / r, s).k_max_n_per_m for s in stiffness]
        for r in resolution
    ])  # fmt: skip
    levels = sorted(secants(SECANT_FORCE_N).items(), key=lambda item: item[1])
    with _figure(5.4) as (figure, (axes,)):
        grey = axes.contour(stiffness, resolution, np.log10(k_max), range(5, 9), colors=GREY,
                            linewidths=0.8)  # fmt: skip
        axes.clabel(grey, fmt=lambda level: f"10^{level:.0f}", fontsize=8)
        colours = (GREEN, BLUE, ORANGE, RED, INK)
        for (name, secant), colour in zip(levels, colours, strict=True):
            axes.contour(stiffness, resolution, k_max, [secant], colors=colour, linewidths=1.6)
            axes.plot([], [], color=colour, label=f"{name}: {secant:.1e} N/m".replace("e+0", "e"))
        for rig in rigs():
            at = rig.stiffness_n_per_m, rig.top_force_n / rig.resolution_m
            axes.plot(*at, "o", color=INK, ms=5)
            axes.annotate(rig.name, at, xytext=(5, 4), textcoords="offset points")
        axes.set(xscale="log", yscale="log", xlabel="K_s, N/m", ylabel="K_r = F_max / δ_Δ, N/m")
        axes.set_title("A rig identifies the payloads whose line lies below or left of it")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return svg_of(figure)


@contextmanager
def _figure(height: float = 4.4, rows: int = 1) -> Iterator[tuple[Figure, list[Axes]]]:
    """The report's style, letters as text so that files stay small."""
    import matplotlib as mpl

    with mpl.rc_context({"svg.fonttype": "none"}), figure_of(height, rows) as drawn:
        yield drawn


def _bounded(axes: Axes, payload: Payload, test: Test, name: str) -> None:
    """The fit of a run, with bounds from the position resolution and the MSDE of the system."""
    rig, _ = rig_of(test)
    fit = batch(*points(run_of(payload, test), payload, test))
    force = np.linspace(1.0, SECANT_FORCE_N, 60)
    deformation = (force / fit.k) ** (1.0 / fit.n)
    msde = SYSTEMS["Instron" if test is Test.INSTRON else "STVF"]
    bound = 0.5 * rig.position_resolution_m + 2.0 * msde
    axes.plot(deformation * 1e6, force, color=_COLOURS[test], label=name)
    axes.fill_betweenx(force, (deformation - bound) * 1e6, (deformation + bound) * 1e6,
                       color=_COLOURS[test], alpha=0.15, lw=0)  # fmt: skip


def _mesh(axes: Axes, payload: Payload, name: str, colour: str, **factors: float) -> None:
    force = np.linspace(1.0, SECANT_FORCE_N, 60)
    axes.plot(laws.with_factors(payload, force, **factors) * 1e6, force, color=colour, label=name)


def _estimate(axes: Axes, estimate: Estimate, colour: str, name: str) -> None:
    _power(axes, float(estimate.k), float(estimate.n), "--", colour, name)


def _power(axes: Axes, k: float, n: float, style: str, colour: str, name: str) -> None:
    force: FloatArray = np.linspace(1.0, SECANT_FORCE_N, 60)
    axes.plot((force / k) ** (1.0 / n) * 1e6, force, style, color=colour, label=name)


def _force_deformation(axes: Axes) -> None:
    axes.set(xlabel=_DEFORMATION, ylabel=_FORCE, ylim=(0, 330))
    axes.set_xlim(left=0)
    axes.legend(loc="upper left")
