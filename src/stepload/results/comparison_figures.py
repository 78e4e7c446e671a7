"""Figures of a comparison, their captions, and how they are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.evidence.quantity import Quantity
from stepload.results.comparison import Comparison
from stepload.results.figures import (
    BLUE,
    GREEN,
    GREY,
    INK,
    MOST_DOTS,
    ORANGE,
    RED,
    figure_of,
    plain,
    svg_of,
)
from stepload.results.model import Figure
from stepload.units import format_quantity as f

LAWS = "laws"
MOST_NAMES = 14
"""Largest number of runs with an entry in the legend; more cannot be distinguished by colour."""
COLOURS = (BLUE, ORANGE, GREEN, RED, INK, GREY)


def figures_of(found: Comparison) -> list[Figure]:
    """The figures of a comparison, drawn on demand."""
    imported = (found.curve[0].deformation_m, found.curve[0].force_n) if found.curve else None
    made = [
        Figure(
            LAWS, "Force against deformation",
            "What was measured, each from its fitted zero, and the believed laws"
            + ("; the curve is corrected for its modulus." if imported else "."),
            "force over deformation of every run with its law",
            partial(_laws, found, imported),
        )
    ]  # fmt: skip
    if found.chords:
        spans = f"{f(found.chords[0].from_n, 'N')} to {f(found.chords[0].to_n, 'N')}"
        chords = {
            each.run.name: chord for each, chord in zip(found.runs, found.chords, strict=True)
        }
        made.append(
            Figure(
                "chords", f"Chord stiffness, {spans}",
                "With its 95 % interval, which holds what all runs have in common.",
                "chord stiffness of every run with intervals",
                partial(_chords, chords),
            )
        )  # fmt: skip
    return made


def _laws(found: Comparison, imported: tuple[FloatArray, FloatArray] | None) -> str:
    """Measured points with the believed laws, and an imported curve as larger points."""
    with figure_of(3.8) as (figure, (axes,)):
        top_n = 0.0
        for index, each in enumerate(found.runs):
            colour, fit, force_n = COLOURS[index % len(COLOURS)], each.found.fit, each.found.force_n
            step = max(1, len(found.runs) * len(force_n) // MOST_DOTS)
            measured = (each.found.deformation_m - fit.zero_m)[::step] * 1e6
            axes.plot(measured, force_n[::step], ".", ms=2.0, color=colour, alpha=0.5)
            law_n = np.linspace(0.0, each.found.peak_force_n, 121)
            axes.plot(
                (law_n / fit.k) ** (1.0 / fit.n) * 1e6, law_n, color=colour,
                label=plain(each.run.name),
            )  # fmt: skip
            top_n = max(top_n, each.found.peak_force_n)
        if imported is not None:
            axes.plot(imported[0] * 1e6, imported[1], ".", ms=5, color=INK, label="imported curve")
            top_n = max(top_n, float(imported[1].max()))
        axes.set(xlabel="payload deformation from its zero [µm]", ylabel="force [N]")
        axes.set_ylim(0.0, 1.15 * top_n)
        if len(found.runs) <= MOST_NAMES:
            axes.legend(loc="upper left", fontsize=9 if len(found.runs) < 8 else 7)
        return svg_of(figure)


def _chords(chords: Mapping[str, Quantity]) -> str:
    """Chord stiffness of every run with its 95 % interval."""
    with figure_of(1.2 + 0.45 * len(chords)) as (figure, (axes,)):
        for row, chord in enumerate(chords.values()):
            ends = [end * 1e-6 for end in chord.interval_n_per_m]
            axes.plot(ends, [row, row], color=BLUE, lw=2.5, alpha=0.5)
            axes.plot([chord.value_n_per_m * 1e-6], [row], "o", ms=6, color=BLUE)
        axes.set_yticks(range(len(chords)), [plain(name) for name in chords])
        axes.set_ylim(len(chords) - 0.5, -0.5)
        axes.set_xlabel("chord stiffness [N/µm]")
        return svg_of(figure)
