"""Changes of a rig that a map tries: position, gauge, stiffness and its uncertainty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from stepload.estimators.conditions import Conditions
from stepload.estimators.deflection import LEAST_RELATIVE

AS_IT_IS, BY_A_TABLE = "as it is", "by a table"
Change = Callable[[Conditions], Conditions]
TABLE_ROWS = 10
GAUGE_M, FINER, STIFFER = 1e-6, 4.0, 1.5
KNOWN = 0.01
"""Common uncertainty of the rows of a carefully measured table of the pose."""


def finer(told: Conditions, factor: float) -> Conditions:
    """A travel with a resolution finer by this factor, and noise smaller by it."""
    sources = told.sources
    return replace(
        told,
        position_resolution_m=told.position_resolution_m / factor,
        sources=replace(
            sources,
            position_resolution_m=sources.position_resolution_m / factor,
            position_noise_m=sources.position_noise_m / factor,
        ),
    )


def gauged(told: Conditions, resolution_m: float) -> Conditions:
    """A gauge across the contact, with noise of a third of its resolution; K_s no longer acts."""
    return replace(
        told,
        position_resolution_m=resolution_m,
        sources=replace(
            told.sources, system_stiffness_n_per_m=None, system_stiffness_sigma_n_per_m=0.0,
            smooth_error_m=0.0, smooth_degrees=None, smooth_length_n=None,
            position_noise_m=resolution_m / 3.0, position_resolution_m=resolution_m,
            deflection_force_n=(), deflection_m=(), deflection_sigma_m=(), system_stiffness_note="",
        ),
    )  # fmt: skip


def stiffer(told: Conditions, factor: float) -> Conditions:
    """A load path stiffer by this factor, with the same relative uncertainty."""
    sources = told.sources
    if sources.system_stiffness_n_per_m is None:
        return told
    return replace(
        told,
        sources=replace(
            sources,
            system_stiffness_n_per_m=factor * sources.system_stiffness_n_per_m,
            system_stiffness_sigma_n_per_m=factor * sources.system_stiffness_sigma_n_per_m,
            deflection_m=tuple(each / factor for each in sources.deflection_m),
        ),
    )


def known(told: Conditions, relative: float) -> Conditions:
    """A K_s with this relative standard uncertainty.

    Below 5 % that needs a table of the pose, whose rows have it in common; each row is as uncertain
    as the misfit of the line was. A table that does not cover the secant's force is replaced.
    """
    sources = told.sources
    stiffness = sources.system_stiffness_n_per_m
    if stiffness is None:
        return told
    sources = replace(sources, system_stiffness_sigma_n_per_m=relative * stiffness)
    covered = sources.deflection_force_n and not told.table_doubts(told.secant_force_n)
    if relative < LEAST_RELATIVE and not covered:
        force = told.secant_force_n * np.arange(1, TABLE_ROWS + 1) / TABLE_ROWS
        sources = replace(
            sources,
            deflection_force_n=tuple(force.tolist()),
            deflection_m=tuple((force / stiffness).tolist()),
            deflection_sigma_m=(sources.smooth_error_m,) * TABLE_ROWS,
            system_stiffness_note="",
        )
    elif relative >= LEAST_RELATIVE:
        sources = replace(
            sources, deflection_force_n=(), deflection_m=(), deflection_sigma_m=(),
            system_stiffness_note="K_s without a table of the pose",
        )  # fmt: skip
    return replace(told, sources=sources)


def relative_sigma(told: Conditions) -> float:
    """Relative uncertainty of K_s; 0 where K_s does not act."""
    stiffness = told.sources.system_stiffness_n_per_m
    return told.sources.system_stiffness_sigma_n_per_m / stiffness if stiffness else 0.0


def for_sale(told: Conditions) -> dict[str, Change]:
    """Possible changes by their names; the first is the rig as it is."""
    found: dict[str, Change] = {AS_IT_IS: lambda told: told}
    resolution_um = told.position_resolution_m / FINER * 1e6
    found[f"position of {resolution_um:.3g} µm"] = lambda one: finer(one, FINER)
    if told.sources.system_stiffness_n_per_m is None:
        return found
    found[f"gauge of {GAUGE_M * 1e6:g} µm"] = lambda one: gauged(one, GAUGE_M)
    found[f"pose {STIFFER:g} times as stiff"] = lambda one: stiffer(one, STIFFER)
    share = min(KNOWN, relative_sigma(told) / 2.0)
    found[f"K_s known to {100.0 * share:.2g} %, {BY_A_TABLE}"] = lambda one: known(one, share)
    return found
