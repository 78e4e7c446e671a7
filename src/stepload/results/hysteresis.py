"""Further results of a run besides the law: relaxation and loss.

Each is an object or a `Missing` that says why there is none. Nothing here can fail a run: numerical
errors are reported, never raised.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.cycles import Loss, loss
from stepload.estimators.fit import FloatArray, Missing
from stepload.estimators.relaxation import HoldSamples, Relaxation, relaxation
from stepload.evidence.identification import Identification
from stepload.evidence.inelastic import NOT_REPEATED
from stepload.record.rows import Phase
from stepload.results.model import NOTHING, Table
from stepload.results.press_data import LOADING, UNLOADING, PressData, holds_of
from stepload.units import format_quantity as f

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Hysteresis:
    """Creep compliance from the holds, loops of the cycles; `Missing` where there is none."""

    relaxation: Relaxation | Missing
    loss: Loss | Missing


def hysteresis_of(data: PressData, found: Identification) -> Hysteresis:
    """Compute both.

    Args:
        data: of the run.
        found: its identification: the law, K_s and the uncertainty sources.
    """
    deformation_m = data.travel_m - found.conditions.bend(data.force_n)
    return Hysteresis(
        _or_missing(lambda: _relaxation(data, deformation_m, found)),
        _or_missing(lambda: _loss(data, deformation_m, found)),
    )


def _or_missing(compute: Callable[[], T | Missing]) -> T | Missing:
    """The result of `compute`; a numerical error becomes a `Missing` with the reason."""
    try:
        return compute()
    except (DomainError, np.linalg.LinAlgError, ArithmeticError) as error:
        return Missing(f"the numbers do not allow it: {str(error).splitlines()[0]}")


def _relaxation(
    data: PressData, deformation_m: FloatArray, found: Identification
) -> Relaxation | Missing:
    busy = data.branch((*LOADING, *UNLOADING))
    if not busy.any():
        return Missing("the run ended before the first load step")
    held = holds_of(data.phase)
    edges = np.flatnonzero(np.diff(held, prepend=0, append=0))
    holds = [
        HoldSamples(
            data.time_s[start:stop], deformation_m[start:stop], data.force_n[start:stop],
            bool(data.phase[start] == Phase.HOLD),
        )
        for start, stop in pairwise(edges.tolist())
        if held[start]
    ]  # fmt: skip
    first = int(np.argmax(busy))
    pressed_n = np.where(busy, data.force_n, 0.0)
    return relaxation(
        data.time_s[first:], pressed_n[first:], holds, found.fit, found.conditions.sources
    )


def _loss(data: PressData, deformation_m: FloatArray, found: Identification) -> Loss | Missing:
    up, down = (np.unique(data.cycle[data.branch(phases)]) for phases in (LOADING, UNLOADING))
    cycles = np.intersect1d(up, down)
    cycles = cycles[cycles > 0]
    if not cycles.size:
        return Missing("no cycle was unloaded in steps: plan `unload: true`")
    mask = data.branch((*LOADING, *UNLOADING)) & np.isin(data.cycle, cycles)
    sources = found.conditions.sources
    return loss(
        data.time_s[mask], deformation_m[mask], data.force_n[mask], data.cycle[mask],
        lag_sigma_s=sources.lag_sigma_s,
        travel_sigma_m=NOT_REPEATED * sources.smooth_error_m,
        length_n=sources.smooth_length_n or 0.5 * float(data.force_n.max()),
    )  # fmt: skip


def hysteresis_data(found: Hysteresis) -> dict[str, Any]:
    """The object for programs: null where there is no result; `missing` says why."""
    parts = {each.name: getattr(found, each.name) for each in fields(found)}
    missing = {name: each.why for name, each in parts.items() if isinstance(each, Missing)}
    return parts | dict.fromkeys(missing) | {"missing": missing}


def hysteresis_table(found: Hysteresis) -> Table:
    """The table for people."""
    rows = [
        ("relaxation in the holds", *_relaxed(found.relaxation)),
        ("loss per cycle", *_lost(found.loss)),
    ]
    return Table("Beside the law", ("result", "value", "what it is worth"), rows)


def _relaxed(found: Relaxation | Missing) -> tuple[str, str]:
    if isinstance(found, Missing) or not found.resolved:
        return NOTHING, found.why
    time = f", τ = {f(found.time_s, 's')}" if found.time_s is not None else ""
    return (
        f"creep {found.creep_share:.1%} ± {found.creep_sigma:.1%} (1 σ){time}",
        found.why or "at constant force, relative to the instantaneous deformation",
    )


def _lost(found: Loss | Missing) -> tuple[str, str]:
    if isinstance(found, Missing):
        return NOTHING, found.why
    shares = ", ".join(f"{c.share:.1%} ± {c.share_sigma:.1%}" for c in found.cycles)
    worth = "of the energy stored, cycle by cycle, ± 1 σ"
    if found.change is not None and found.change_sigma is not None:
        worth += f"; last minus first {found.change:+.1%} ± {found.change_sigma:.1%}"
    return shares, worth
