"""Energy lost in each cycle, absolute and as a share of the energy stored: the loop of `runin`.

The loop is what is left between loading and unloading over the forces that both reach. It holds
everything that does not come back: hysteresis of the material, creep in the holds, plastic flow
(the first cycle only), and, unless a gauge measured across the contact, the friction and lost
motion of the rig. A lag of the force behind the position opens a loop as well; its size is in the
uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError
from stepload.estimators.blocks import BLOCK_S, blocks
from stepload.estimators.fit import FloatArray
from stepload.estimators.missing import Missing
from stepload.estimators.runin import run_in
from stepload.estimators.smooth import NORMAL_95, smooth_correlation

_GRID = 60
LEAST_SAMPLES = 20
"""A cycle of fewer samples has no loop."""


@dataclass(frozen=True, slots=True)
class CycleLoss:
    """The loop of one cycle.

    Attributes:
        cycle: its number.
        energy_j: energy lost; negative where the loop is the wrong way round.
        sigma_j: standard uncertainty, from noise and quanta as seen, the lag, and the error of
            travel that differs from branch to branch.
        stored_j: work done while loading, over the same forces.
        share: energy lost over work done.
        share_sigma: its standard uncertainty.
        resolved: whether the loss is beyond what these explain (95 %).
    """

    cycle: int
    energy_j: float
    sigma_j: float
    stored_j: float
    share: float
    share_sigma: float
    resolved: bool


@dataclass(frozen=True, slots=True)
class Loss:
    """The loops of a run.

    Attributes:
        cycles: in order.
        change: share of the last cycle minus that of the first; None with one cycle.
        change_sigma: its standard uncertainty: the lag is the same in both, noise and travel are
            not.
    """

    cycles: tuple[CycleLoss, ...]
    change: float | None
    change_sigma: float | None


def loss(
    time_s: FloatArray,
    deformation_m: FloatArray,
    force_n: FloatArray,
    cycle: NDArray[np.integer],
    *,
    lag_sigma_s: float,
    travel_sigma_m: float = 0.0,
    length_n: float = 1.0,
) -> Loss | Missing:
    """Loss of every cycle.

    Args:
        time_s, deformation_m, force_n: (N,) loading and unloading, in the order of time.
        cycle: (N,) number of the cycle; only cycles that were loaded and unloaded.
        lag_sigma_s: standard uncertainty of the time between force and position.
        travel_sigma_m: standard deviation of the error of travel that is another one in every
            branch, smooth over `length_n` of force.
    """
    numbers = [int(number) for number in np.unique(cycle) if number > 0]
    if not numbers:
        return Missing("no cycle was loaded and unloaded")
    short = [n for n in numbers if int((cycle == n).sum()) < LEAST_SAMPLES]
    if short:
        return Missing(f"cycle {short[0]} has fewer than {LEAST_SAMPLES} samples")
    try:
        found = run_in(
            deformation_m, force_n, cycle, secant_force_n=float(force_n.max()), lift_off=False
        )
    except (DomainError, np.linalg.LinAlgError) as error:
        return Missing(str(error).splitlines()[0])
    cycles, noises = [], []
    for each in found.cycles:
        mine = cycle == each.number
        late_j = lag_sigma_s * _lag_power(time_s[mine], deformation_m[mine], force_n[mine])
        own_j = math.hypot(each.loop_sigma_j, travel_sigma_m * _spread_n(force_n[mine], length_n))
        sigma_j = math.hypot(own_j, late_j)
        noises.append(own_j / each.stored_energy_j)
        cycles.append(
            CycleLoss(
                cycle=each.number,
                energy_j=each.loop_energy_j,
                sigma_j=sigma_j,
                stored_j=each.stored_energy_j,
                share=each.loop_energy_j / each.stored_energy_j,
                share_sigma=sigma_j / each.stored_energy_j,
                resolved=each.loop_energy_j > NORMAL_95 * sigma_j,
            )
        )
    if len(cycles) < 2:
        return Loss(tuple(cycles), None, None)
    change = cycles[-1].share - cycles[0].share
    return Loss(tuple(cycles), change, math.hypot(noises[0], noises[-1]))


def _spread_n(force_n: FloatArray, length_n: float) -> float:
    """Standard deviation in J of a loop whose two branches have an error of 1 m each, smooth over
    `length_n`: the root of twice the integral of its correlation over the forces of the loop."""
    grid = np.linspace(float(force_n.min()), float(force_n.max()), _GRID)
    step_n = float(grid[1] - grid[0])
    return step_n * math.sqrt(2.0 * float(smooth_correlation(grid, length_n).sum()))


def _lag_power(time_s: FloatArray, deformation_m: FloatArray, force_n: FloatArray) -> float:
    """∫ |Ḟ| |δ̇| dt in W: so many joules does a lag of 1 s open the loop, to first order."""
    data = blocks(time_s, deformation_m, force_n)
    if data.time_s.size < 3:
        return 0.0
    gap_s = np.diff(data.time_s)
    near = gap_s < 4.0 * BLOCK_S
    # The deformation follows the force monotonically; quanta of the position must not count.
    rise_n, rise_m = np.diff(data.force_n), np.diff(data.deformation_m)
    product = rise_n * rise_m
    return float(np.sum(np.maximum(product, 0.0)[near] / gap_s[near]))
