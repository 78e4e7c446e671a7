"""Changes of a rig: position, gauge, stiffness and its uncertainty, and what narrows a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from stepload.identification.conditions import UNKNOWN_OFFSET_M, Conditions
from stepload.identification.lateral_coupling import Across
from stepload.units import format_quantity

AS_IT_IS = "as it is"
Change = Callable[[Conditions], Conditions]
Named = tuple[str, Change]
TABLE_ROWS = 10
GAUGE_M, FINER, STIFFER = 1e-6, 4.0, 1.5
KNOWN = 0.01
"""Common uncertainty of the rows of a carefully measured table of the pose."""
HALVES: Mapping[str, tuple[str, str]] = {
    "force noise and quantum": ("force_noise_n", "force sensor with half the noise and quantum"),
    "force calibration": ("gain_sigma", "gain of the force sensor known to {:.2g} %"),
    "force linearity": ("nonlinearity", "linearity of the force sensor of {:.2g} %"),
    "alignment lag": ("lag_sigma_s", "clocks of force and position aligned twice as well"),
    "temperature": ("temperature_sigma_k", "temperature held twice as well"),
    "temperature of the material": ("temperature_sigma_k", "temperature known twice as well"),
    "zero of force": ("zero_drift_n_per_s", "force sensor with half the drift"),
}
"""By line: the source that is halved, and what to do for it."""
_OF_SYSTEM = ("system stiffness K_s", "smooth deformation error", "lateral force")
_OF_POSITION = ("position noise and quantum", "drift")


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
    """A gauge across the contact of which nothing else is stated; K_s no longer acts."""
    return replace(
        told,
        position_resolution_m=resolution_m,
        gauge_offset_m=UNKNOWN_OFFSET_M if told.arm else 0.0,
        sources=replace(
            told.sources, system_stiffness_n_per_m=None, system_stiffness_sigma_n_per_m=0.0,
            smooth_error_m=0.0, smooth_degrees=None, smooth_length_n=None,
            position_noise_m=0.0, position_resolution_m=resolution_m,
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
        yields_m_per_n=told.yields_m_per_n / factor,
        sources=replace(
            sources,
            system_stiffness_n_per_m=factor * sources.system_stiffness_n_per_m,
            system_stiffness_sigma_n_per_m=factor * sources.system_stiffness_sigma_n_per_m,
            deflection_m=tuple(each / factor for each in sources.deflection_m),
        ),
    )


def known(told: Conditions, relative: float) -> Conditions:
    """A K_s with this relative standard uncertainty.

    A table that does not cover the secant's force is replaced by one that does, each of its rows as
    uncertain as the misfit of the line was.
    """
    sources = told.sources
    stiffness = sources.system_stiffness_n_per_m
    if stiffness is None:
        return told
    sources = replace(
        sources, system_stiffness_sigma_n_per_m=relative * stiffness, system_stiffness_note=""
    )
    if told.table_remarks(told.secant_force_n):
        force = told.secant_force_n * np.arange(1, TABLE_ROWS + 1) / TABLE_ROWS
        sources = replace(
            sources,
            deflection_force_n=tuple(force.tolist()),
            deflection_m=tuple((force / stiffness).tolist()),
            deflection_sigma_m=(sources.smooth_error_m,) * TABLE_ROWS,
        )
    return replace(told, sources=sources, across=_stated(told.across))


def _stated(across: Across) -> Across:
    """What is known of lateral force once K_s is stated in the pose."""
    known = across.at_share is not None or across.per_newton_m is not None
    return across if known else Across(at_share=(0.0, 0.0), stated=True)


def relative_sigma(told: Conditions) -> float:
    """Relative uncertainty of K_s; 0 where K_s does not act."""
    stiffness = told.sources.system_stiffness_n_per_m
    return told.sources.system_stiffness_sigma_n_per_m / stiffness if stiffness else 0.0


def for_sale(told: Conditions) -> dict[str, Change]:
    """Possible changes by their names; the first is the rig as it is."""
    found: dict[str, Change] = {AS_IT_IS: lambda told: told, **dict([_finer(told)])}
    if told.sources.system_stiffness_n_per_m is not None:
        found |= [_gauge(), _better_known(told)]
        found[f"pose {STIFFER:g} times as stiff"] = lambda one: stiffer(one, STIFFER)
    return found


def narrower(line: str, told: Conditions) -> Named | None:
    """The one thing to do about a line of the budget; None where nothing is known to help."""
    if line in _OF_POSITION:
        return _finer(told)
    if line in _OF_SYSTEM and told.sources.system_stiffness_n_per_m is not None:
        known_well = line != _OF_SYSTEM[0] or relative_sigma(told) <= KNOWN
        return _gauge() if known_well else _better_known(told)
    if line == "misalignment of sensor and plate":
        return "sensor aligned twice as well", lambda one: replace(
            one, misalignment_rad=0.5 * one.misalignment_rad
        )
    if line == "gauge off the axis of an arm that turns":
        return "gauge half as far from the axis", lambda one: replace(
            one, gauge_offset_m=0.5 * one.gauge_offset_m
        )
    if line not in HALVES:
        return None
    name, words = HALVES[line]
    half = 0.5 * getattr(told.sources, name)
    values = {name: half}
    if name == "force_noise_n":
        values["force_resolution_n"] = 0.5 * told.sources.force_resolution_n
    return words.format(100.0 * half), lambda one: replace(
        one, sources=replace(one.sources, **values)
    )


def _finer(told: Conditions) -> Named:
    resolution = format_quantity(told.sources.position_resolution_m / FINER, "m", 2)
    return f"position of {resolution}", lambda one: finer(one, FINER)


def _gauge() -> Named:
    return f"gauge of {format_quantity(GAUGE_M, 'm')}", lambda one: gauged(one, GAUGE_M)


def _better_known(told: Conditions) -> Named:
    share = min(KNOWN, relative_sigma(told) / 2.0)
    return f"K_s known to {100.0 * share:.2g} % in this pose", lambda one: known(one, share)
