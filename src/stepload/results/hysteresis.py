"""Further results of a run besides the law: relaxation, unloading, loss, damping.

Each is an object or a `Missing` that says why there is none. Nothing here can fail a run: numerical
errors are reported, never raised.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from stepload.contact.elastic import equivalent_radius
from stepload.contact.materials import Geometry, Sphere
from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray
from stepload.estimators.hunt_crossley import HuntCrossley, hunt_crossley
from stepload.estimators.loss import Loss, loss
from stepload.estimators.missing import Missing
from stepload.estimators.relaxation import HoldSamples, Relaxation, relaxation
from stepload.estimators.unloading import OPINION, Unloading, unloading
from stepload.evidence.identification import Identification
from stepload.evidence.inelastic import NOT_REPEATED
from stepload.record.rows import Phase
from stepload.results.model import NOTHING, Field, Table, interval, named, number, quantity, table
from stepload.results.press_data import LOADING, UNLOADING, PressData, holds_of
from stepload.units import format_quantity as f

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Hysteresis:
    """Creep compliance from the holds, unloading of every cycle that has one (or the reason of the
    first), loops of the cycles, damping; `Missing` where there is none."""

    relaxation: Relaxation | Missing
    unloading: tuple[Unloading, ...] | Missing
    loss: Loss | Missing
    hunt_crossley: HuntCrossley | Missing


def hysteresis_of(
    data: PressData, found: Identification, geometry: Geometry | None = None
) -> Hysteresis:
    """Compute all of them.

    Args:
        data: of the run.
        found: its identification: the law, K_s and the uncertainty sources.
        geometry: of the payload where it is known; a sphere on a flat plate gives a modulus.
    """
    deformation_m = data.travel_m - found.conditions.bend(data.force_n)
    return Hysteresis(
        _or_missing(lambda: _relaxation(data, deformation_m, found)),
        _or_missing(lambda: _unloadings(data, deformation_m, found, geometry)),
        _or_missing(lambda: _loss(data, deformation_m, found)),
        _or_missing(lambda: _damping(data, deformation_m, found)),
    )


def dissipation_of(found: Hysteresis | None) -> float | None:
    """d of Hunt and Crossley in s/m; None where it was not determined."""
    damping = found.hunt_crossley if found is not None else None
    return damping.dissipation_s_per_m if isinstance(damping, HuntCrossley) else None


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


def _cycles(data: PressData) -> list[int]:
    """Cycles with both loading and unloading."""
    up, down = (np.unique(data.cycle[data.branch(phases)]) for phases in (LOADING, UNLOADING))
    return [int(cycle) for cycle in np.intersect1d(up, down) if cycle > 0]


def _unloadings(
    data: PressData, deformation_m: FloatArray, found: Identification, geometry: Geometry | None
) -> tuple[Unloading, ...] | Missing:
    cycles = _cycles(data)
    if not cycles:
        return Missing("no cycle was unloaded in steps: plan `unload: true`")
    radius_m = None
    if isinstance(geometry, Sphere) and geometry.counter_radius_m is None:
        radius_m = equivalent_radius(geometry)
    fit, sources = found.fit, found.conditions.sources
    zero_sigma_m = (
        sum(line.zero_m**2 for line in found.budget.lines) ** 0.5 if found.budget else 0.0
    )
    every = []
    for cycle in cycles:
        mask = data.branch(UNLOADING, cycle)
        every.append(
            unloading(
                deformation_m[mask], data.force_n[mask], sources, cycle=cycle,
                # Depth counts from the zero of the first loading; later touches begin a new one.
                radius_m=radius_m if cycle == cycles[0] and found.budget else None,
                zero_m=fit.zero_m, zero_sigma_m=zero_sigma_m,
            )
        )  # fmt: skip
    made = tuple(each for each in every if isinstance(each, Unloading))
    return made or next(each for each in every if isinstance(each, Missing))


def _loss(data: PressData, deformation_m: FloatArray, found: Identification) -> Loss | Missing:
    cycles = _cycles(data)
    if not cycles:
        return Missing("no cycle was unloaded in steps: plan `unload: true`")
    mask = data.branch((*LOADING, *UNLOADING)) & np.isin(data.cycle, cycles)
    sources = found.conditions.sources
    return loss(
        data.time_s[mask], deformation_m[mask], data.force_n[mask], data.cycle[mask],
        lag_sigma_s=sources.lag_sigma_s,
        travel_sigma_m=NOT_REPEATED * sources.smooth_error_m,
        length_n=sources.smooth_length_n or 0.5 * float(data.force_n.max()),
    )  # fmt: skip


def _damping(
    data: PressData, deformation_m: FloatArray, found: Identification
) -> HuntCrossley | Missing:
    mask = data.first_loading()
    if not mask.any():
        return Missing("not determined: there is no loading")
    return hunt_crossley(
        data.time_s[mask], deformation_m[mask], data.force_n[mask], found.fit,
        found.conditions.sources, lag_corrected_s=data.lag_corrected_s,
    )  # fmt: skip


def hysteresis_data(found: Hysteresis) -> dict[str, Any]:
    """The object for programs: null where there is no result; `missing` says why."""
    parts = {each.name: getattr(found, each.name) for each in fields(found)}
    missing = {name: each.why for name, each in parts.items() if isinstance(each, Missing)}
    made = parts | dict.fromkeys(missing) | {"missing": missing}
    if isinstance(damping := found.hunt_crossley, HuntCrossley):
        made["hunt_crossley"] = asdict(damping) | {"alpha_s_per_m": damping.alpha_s_per_m}
    return made


_UNLOADING: tuple[Field[Unloading], ...] = (
    named("cycle", "cycle"),
    named("top_force_n", "from", quantity("N")),
    named("stiffness_n_per_m", "S at the top", quantity("N/m")),
    named("interval_n_per_m", "95 % interval", interval("N/m")),
    named("exponent", "n", number(".3f")),
    named("final_m", "rests at", quantity("m")),
    Field(
        lambda row: row.indentation and row.indentation.reduced_modulus_pa,
        "", "E_r, sphere", quantity("Pa"),
    ),
)  # fmt: skip


def hysteresis_tables(found: Hysteresis) -> list[Table]:
    """Tables for people: one of all results, and one of the unloading branches."""
    rows = [
        _row("relaxation in the holds", found.relaxation, _relaxed),
        _row("unloading stiffness", found.unloading, _unloaded),
        _row("loss per cycle", found.loss, _lost),
        _row("Hunt–Crossley damping", found.hunt_crossley, _damped),
    ]
    tables = [Table("Beside the law", ("result", "value", "what it is worth"), rows)]
    if not isinstance(found.unloading, Missing):
        tables.append(
            table("Unloading branch", _UNLOADING, found.unloading, [OPINION], page_only=True)
        )
    return tables


def _row(
    name: str, found: T | Missing, told: Callable[[T], tuple[str, str]]
) -> tuple[str, str, str]:
    return (name, *((NOTHING, found.why) if isinstance(found, Missing) else told(found)))


def _relaxed(found: Relaxation) -> tuple[str, str]:
    if not found.resolved:
        return NOTHING, found.why
    time = f", τ = {f(found.time_s, 's')}" if found.time_s is not None else ""
    return (
        f"creep {found.creep_share:.1%} ± {found.creep_sigma:.1%} (1 σ){time}; "
        f"{found.per_decade:+.2%} ± {found.per_decade_sigma:.2%} per decade of time",
        found.why or "at constant force, relative to the instantaneous deformation",
    )


def _unloaded(found: tuple[Unloading, ...]) -> tuple[str, str]:
    first = found[0]
    return (
        f"{f(first.stiffness_n_per_m, 'N/m')} at {f(first.top_force_n, 'N')}, "
        f"{interval('N/m')(first.interval_n_per_m)}",
        OPINION,
    )


def _lost(found: Loss) -> tuple[str, str]:
    shares = ", ".join(f"{c.share:.1%} ± {c.share_sigma:.1%}" for c in found.cycles)
    worth = "of the energy stored, cycle by cycle, ± 1 σ"
    if found.change is not None and found.change_sigma is not None:
        worth += f"; last minus first {_with_sigma(found.change, found.change_sigma)}"
    return shares, worth


def _with_sigma(share: float, sigma: float) -> str:
    """A share and its standard uncertainty in per cent, to two significant digits of the latter."""
    places = 1
    if 0.0 < sigma < math.inf:
        places = max(1 - int(f"{100.0 * sigma:.1e}".partition("e")[2]), 0)
    return f"{share:+.{places}%} ± {sigma:.{places}%}"


def _damped(found: HuntCrossley) -> tuple[str, str]:
    if found.dissipation_s_per_m is None or found.interval_s_per_m is None:
        return f"d < {found.upper_bound_s_per_m:.3g} s/m", found.why
    low, high = found.interval_s_per_m
    return f"d = {found.dissipation_s_per_m:.3g} s/m, [{low:.3g}, {high:.3g}]", found.why
