"""Step-load runs of known worlds, quasi-static, as `identification` takes them.

Written apart from the program's own rehearsals: the errors are drawn sample by sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from stepload.identification.conditions import Conditions, Sources
from stepload.identification.fit import FloatArray
from stepload.identification.lateral import LateralForce
from stepload.identification.loops import Track
from stepload.identification.run_data import RunData

Law = Callable[[FloatArray], FloatArray]
HERTZ_K = 6.57e8


def hertz(force_n: FloatArray) -> FloatArray:
    """Deformation of the paper's plastic sphere."""
    return np.asarray((np.maximum(force_n, 0.0) / HERTZ_K) ** (2.0 / 3.0))


@dataclass(frozen=True)
class World:
    """One world: what is pressed, and what is wrong with it; SI units."""

    law: Law = hertz
    top_n: float = 300.0
    levels: int = 6
    hold_s: float = 3.0
    cycles: int = 2
    unload: bool = True
    rate_hz: float = 100.0
    system_n_per_m: float = 3.49e6
    system_off: float = 0.0
    system_sigma: float = 0.01
    quantum_m: float = 2e-6
    position_noise_m: float = 0.2e-6
    force_noise_n: float = 0.7
    smooth_m: float = 0.54e-6
    smooth_length_n: float = 50.0
    loop: float = 0.01
    creep: float = 0.0
    creep_tau_s: float = 5.0
    damping_s: float = 0.0
    drift_m_per_s: float = 0.0
    set_m: float = 0.0
    lateral: float | None = 0.0
    limit_n: float | None = None
    said: dict[str, Any] = field(default_factory=dict)


def press(world: World, seed: int = 0) -> RunData:
    """Press a world once."""
    rng = np.random.default_rng(seed)
    force, cycle, unloading, held = _course(world)
    time = np.arange(force.size) / world.rate_hz
    ideal = world.law(force)
    top_m = float(world.law(np.array([world.top_n]))[0])
    share = force / world.top_n
    deformation = ideal + unloading * 2.4 * world.loop * share * (1.0 - share) * top_m
    if world.creep:
        deformation += world.creep * _late(ideal, world.creep_tau_s * world.rate_hz)
    if world.damping_s:
        deformation = _late(deformation, world.damping_s * world.rate_hz)
    after_first = (cycle > 1) | (unloading > 0)
    # What yielded stays: all of it without force, none of it where the top is reached again.
    deformation += world.set_m * after_first * (1.0 - share)
    deformation += world.drift_m_per_s * time + _smooth(force, world, rng)
    stiffness = world.system_n_per_m * (1.0 + world.system_off)
    travel = deformation + force / stiffness + rng.uniform(0.0, 1.0) * world.quantum_m
    travel += world.position_noise_m * rng.standard_normal(force.size)
    if world.quantum_m:
        travel = np.round(travel / world.quantum_m) * world.quantum_m
    measured = force + world.force_noise_n * rng.standard_normal(force.size)
    tracks = []
    for number in range(1, world.cycles + 1):
        pair = []
        for branch in (0, 1):
            mask = (cycle == number) & (unloading == branch) & (force > 0.01 * world.top_n)
            pair.append(Track(time[mask], measured[mask], travel[mask], held[mask]))
        tracks.append((number, pair[0], pair[1] if world.unload else None))
    sources = Sources(
        world.system_n_per_m, world.system_sigma * world.system_n_per_m,
        smooth_error_m=world.smooth_m, smooth_length_n=world.smooth_length_n,
        force_noise_n=world.force_noise_n, position_noise_m=world.position_noise_m,
        position_resolution_m=world.quantum_m, gain_sigma=0.005,
        **straight_table(world.system_n_per_m, world.top_n),
    )  # fmt: skip
    conditions = Conditions(
        sources, world.top_n, 3.0, world.quantum_m, elastic_limit_n=world.limit_n,
        rough_length_m=0.0,
    )  # fmt: skip
    made = RunData(
        tracks, conditions,
        lateral_force=LateralForce("guided", world.lateral, relative=0.3 * (world.lateral or 0.0)),
    )  # fmt: skip
    return told(made, **world.said)


def straight_table(stiffness_n_per_m: float, top_n: float) -> dict[str, Any]:
    """A deflection table of a system that bends in proportion to the force."""
    force_n = (0.1 * top_n, 2.0 * top_n)
    return {
        "deflection_force_n": force_n,
        "deflection_m": tuple(each / stiffness_n_per_m for each in force_n),
        "deflection_sigma_m": (0.0, 0.0),
    }


def told(run: RunData, **changes: Any) -> RunData:
    """The run with other statements, by the names of its own, its conditions' or its sources'."""
    sources, conditions, own = (
        {each.name: changes[each.name] for each in fields(of) if each.name in changes}
        for of in (Sources, Conditions, RunData)
    )
    assert {*sources, *conditions, *own} == {*changes}
    conditions = {"sources": replace(run.conditions.sources, **sources)} | conditions
    return replace(run, conditions=replace(run.conditions, **conditions), **own)


def _course(world: World) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Force, cycle, whether unloading, number of the hold, (N,) each."""
    levels = np.linspace(world.top_n / world.levels, world.top_n, world.levels)
    rows: list[tuple[int, int, int, FloatArray]] = []
    ramp, rest = int(world.rate_hz), int(world.rate_hz * world.hold_s)
    for cycle in range(1, world.cycles + 1):
        before, number = 0.0, 0
        for branch, targets in ((0, levels), (1, levels[-2::-1])):
            for level in targets:
                number += 1
                rows.append((cycle, branch, 0, np.linspace(before, level, ramp)))
                rows.append((cycle, branch, number, np.full(rest, level)))
                before = level
    columns = [np.concatenate([np.full(row[3].size, row[k]) for row in rows]) for k in range(3)]
    return np.concatenate([row[3] for row in rows]), columns[0], columns[1], columns[2]


def _late(prompt: FloatArray, samples: float) -> FloatArray:
    """What follows with one time constant, of so many samples."""
    keep = np.exp(-1.0 / samples)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], prompt))


def _smooth(force: FloatArray, world: World, rng: np.random.Generator) -> FloatArray:
    grid = np.linspace(0.0, 1.05 * world.top_n, 80)
    away = np.subtract.outer(grid, grid) / world.smooth_length_n
    root = np.linalg.cholesky(np.exp(-0.5 * away**2) + 1e-6 * np.eye(grid.size))
    return np.asarray(np.interp(force, grid, world.smooth_m * (root @ rng.standard_normal(80))))


def there_and_back(force_n: FloatArray, travel_m: FloatArray, conditions: Conditions) -> RunData:
    """One loading given as samples (N,), and the same way back."""
    time = np.arange(force_n.size, dtype=float) / 100.0
    held = np.zeros(force_n.size, dtype=int)
    back = Track(time + time[-1], force_n[::-1], travel_m[::-1], held)
    return RunData(
        [(1, Track(time, force_n, travel_m, held), back)],
        conditions,
        
    )  # fmt: skip
