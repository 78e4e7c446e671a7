"""Run-in: chord and loop of every cycle, from the virgin one to the steady one.

Cycles without lift-off measure shakedown: asperities and material settle while the bodies stay
together. Cycles with lift-off also measure seating, and the residual indentation as the shift of
the touch. Virgin and steady cycle are two results; their mean is a property of nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError
from stepload.identification.fit import Fit, FloatArray
from stepload.identification.inverse_law import joint

STEADY_CYCLES = 3
SECANT_CHANGE = 0.01
ENERGY_CHANGE = 0.10
SPAN_OF_THREE = 3.31
"""Span of three equal values, in standard deviations, that is not exceeded in 95 %."""
RESOLVED_LOOP = 0.02
"""A loop thinner than this share of the stored energy counts as closed: its change is noise."""

_CELLS = 40


@dataclass(frozen=True, slots=True)
class Cycle:
    """One cycle.

    Attributes:
        fit: joint fit of the loading branch.
        chord_n_per_m: while loading, between the same two forces in every cycle.
        loop_energy_j: area between loading and unloading over the forces that both branches of
            every cycle reach.
        loop_sigma_j: its standard uncertainty from noise and quanta, as the data show them.
        stored_energy_j: work done while loading, over the same forces.
        start_m: deformation at the lower force while loading.
    """

    number: int
    fit: Fit
    chord_n_per_m: float
    loop_energy_j: float
    loop_sigma_j: float
    stored_energy_j: float
    start_m: float


@dataclass(frozen=True, slots=True)
class RunIn:
    """Result of the cycles.

    Attributes:
        lift_off: whether the contact was opened between them.
        virgin: the first cycle, where the contact had not been pressed before; None otherwise.
        steady: the last cycle, once the last three agree; None while they do not.
        secant_change, energy_change: relative span of chord and loop energy over the last three.
        secant_tolerance: allowed change of the chord, max(1 %, 2u).
        energy_tolerance: that of the loop energy, 10 % or what the noise of the loops explains.
        shakedown_m: shift of the deformation at the lower force from the first cycle to the last.
        residual_indentation_m: shift of the touch; None without lift-off or touch points.
    """

    cycles: tuple[Cycle, ...]
    lift_off: bool
    virgin: Cycle | None
    steady: Cycle | None
    secant_tolerance: float
    secant_change: float
    energy_change: float
    energy_tolerance: float
    shakedown_m: float
    residual_indentation_m: float | None


def run_in(
    deformation_m: FloatArray,
    force_n: FloatArray,
    cycle: NDArray[np.integer],
    *,
    secant_force_n: float,
    lift_off: bool,
    virgin: bool = True,
    secant_sigma: float = 0.0,
    touch_m: FloatArray | None = None,
) -> RunIn:
    """Evaluate the cycles of a run.

    Args:
        deformation_m, force_n: (N,) loading and unloading in the order of time, one zero for all.
        cycle: (N,) number of the cycle of each sample; samples with 0 belong to none.
        secant_force_n: where the secants of the fits are taken.
        lift_off: whether the contact was opened between cycles.
        virgin: whether the contact had not been pressed before the first cycle.
        secant_sigma: relative standard uncertainty u of a cycle's secant by noise and quanta.
        touch_m: (C,) travel at the touches.

    Raises:
        DomainError: no cycle, or one that was not both loaded and unloaded.
    """
    numbers = [int(number) for number in np.unique(cycle) if number > 0]
    if not numbers:
        raise DomainError("no sample belongs to a cycle", hint="plan at least one cycle")
    tops = [float(force_n[cycle == number].max()) for number in numbers]
    high = 0.98 * min(tops)
    loading_low, loop_low = (max(low, 0.05 * high) for low in _lowest(force_n, cycle, numbers))
    cycles = tuple(
        _evaluate(
            number,
            deformation_m[cycle == number],
            force_n[cycle == number],
            np.linspace(loading_low, high, _CELLS),
            np.linspace(loop_low, high, _CELLS),
            secant_force_n,
        )
        for number in numbers
    )
    last = cycles[-STEADY_CYCLES:]
    chords = np.array([c.chord_n_per_m for c in last])
    loops = np.array([c.loop_energy_j for c in last])
    stored = float(np.mean([c.stored_energy_j for c in last]))
    secant_change = float(np.ptp(chords) / chords.mean())
    energy = max(abs(float(loops.mean())), RESOLVED_LOOP * stored)
    energy_change = float(np.ptp(loops)) / energy
    noise = math.sqrt(float(np.mean([c.loop_sigma_j**2 for c in last])))
    energy_tolerance = max(ENERGY_CHANGE, SPAN_OF_THREE * noise / energy)
    tolerance = max(SECANT_CHANGE, 2.0 * secant_sigma)
    steady = (
        len(last) == STEADY_CYCLES
        and secant_change < tolerance
        and energy_change < energy_tolerance
    )
    residual = None
    if lift_off and touch_m is not None and touch_m.size > 1:
        residual = float(touch_m[-1] - touch_m[0])
    return RunIn(
        cycles=cycles,
        lift_off=lift_off,
        virgin=cycles[0] if virgin else None,
        steady=cycles[-1] if steady else None,
        secant_tolerance=tolerance,
        secant_change=secant_change,
        energy_change=energy_change,
        energy_tolerance=energy_tolerance,
        shakedown_m=cycles[-1].start_m - cycles[0].start_m,
        residual_indentation_m=residual,
    )


def _on_grid(force_n: FloatArray, deformation_m: FloatArray, grid_n: FloatArray) -> FloatArray:
    """Deformation of a branch on a grid of forces, means over a grid step: noise in force and
    quanta average out, and a hold counts as one place."""
    step = float(grid_n[1] - grid_n[0])
    index = np.round((force_n - grid_n[0]) / step).astype(np.intp)
    inside = (index >= -1) & (index <= grid_n.size)
    index = index[inside] + 1
    count = np.bincount(index)
    used = count > 0
    if not used.any():
        raise DomainError("a branch of a cycle has no sample between the two forces compared")
    force = np.bincount(index, force_n[inside])[used] / count[used]
    deformation = np.bincount(index, deformation_m[inside])[used] / count[used]
    return np.asarray(np.interp(grid_n, force, deformation))


def _lowest(
    force_n: FloatArray, cycle: NDArray[np.integer], numbers: list[int]
) -> tuple[float, float]:
    """The lowest force that the loading of every cycle reaches, and that both branches do."""
    loading = unloading = 0.0
    for number in numbers:
        force = force_n[cycle == number]
        top = int(np.argmax(force))
        if top < 2 or top > force.size - 3:
            raise DomainError(
                f"cycle {number} has no loading or no unloading branch",
                hint="plan `unload: true` for run-in",
            )
        loading = max(loading, float(force[: top + 1].min()))
        unloading = max(unloading, float(force[top:].min()))
    return loading, max(loading, unloading)


def _evaluate(
    number: int,
    deformation_m: FloatArray,
    force_n: FloatArray,
    grid_n: FloatArray,
    loop_n: FloatArray,
    secant_force_n: float,
) -> Cycle:
    # A hold at the top belongs to both branches, half to each: they are split at its middle.
    at_top = np.flatnonzero(force_n >= 0.99 * force_n.max())
    top = int(at_top[at_top.size // 2])
    loading_n, loading_m = force_n[: top + 1], deformation_m[: top + 1]
    up, loop_up = (_on_grid(loading_n, loading_m, grid) for grid in (grid_n, loop_n))
    down = _on_grid(force_n[top:], deformation_m[top:], loop_n)
    span_n, span_m = float(grid_n[-1] - grid_n[0]), float(up[-1] - up[0])
    if not span_m > 0.0:
        raise DomainError(f"the deformation of cycle {number} does not rise with force")
    stored_j = float(np.trapezoid(loop_n, loop_up))
    if not stored_j > 0.0:
        raise DomainError(f"cycle {number} stored no energy: it was not loaded and unloaded")
    gap = down - loop_up
    noise_m = float(np.std(np.diff(gap, 2))) / math.sqrt(6.0)
    step_n = float(loop_n[1] - loop_n[0])
    return Cycle(
        number=number,
        fit=joint(up, grid_n, secant_force_n=secant_force_n),
        chord_n_per_m=span_n / span_m,
        # ∮ F dδ = ∫ (δ_unloading − δ_loading) dF
        loop_energy_j=float(np.trapezoid(gap, loop_n)),
        loop_sigma_j=noise_m * step_n * math.sqrt(loop_n.size),
        stored_energy_j=stored_j,
        start_m=float(up[0]),
    )
