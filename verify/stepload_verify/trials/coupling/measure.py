"""The record of a simulated press on a block or a payload, and how the product reads it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stepload.envelope.conditions import ARM_MISALIGNMENT_RAD
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.lateral_coupling import Across
from stepload.plan.calibration import CalibrationRecord
from stepload.record.lag import measure_lag
from stepload.record.rows import Phase
from stepload.results.conditions import measured
from stepload.results.press_data import PressData, TouchPoint
from stepload.results.run_record import SavedRun
from stepload_verify.trials.coupling.world import Branches, Contact, FloatArray, press
from stepload_verify.trials.honest.measure import CLOCKS

RATE_HZ = 50.0
LEVELS, HOLD_S, RAMP_S = 10, 1.0, 1.0
TOUCH_SHARE = 0.02
NONLINEARITY = 0.002


@dataclass(frozen=True, slots=True)
class Bench:
    """An arm in a pose, and how well it measures.

    `compliance` (3, 3) in m/N, `sensor` (3, 3) the rotation of the sensor against the arm's axes.
    """

    compliance: FloatArray
    sensor: FloatArray
    top_n: float
    arm: bool
    position_noise_m: float
    position_resolution_m: float
    smooth_m: float
    force_noise_n: float


def pressed(bench: Bench, contact: Contact, rng: np.random.Generator) -> PressData:
    """Two cycles of load steps with holds, as `press_data` makes them of a record."""
    forces, phases, cycles, free = _course(bench.top_n)
    branches = press(bench.compliance, contact, bench.top_n)
    travel, across = np.zeros_like(forces), np.zeros((forces.size, 3))
    up = np.isin(phases, (Phase.LOAD, Phase.HOLD))
    for chosen, (at_m, force) in (
        (up & ~free, _rising(branches, bench.sensor, up=True)),
        (~up & ~free, _rising(branches, bench.sensor, up=False)),
    ):
        travel[chosen] = np.interp(forces[chosen], force[:, 2], at_m)
        for axis in range(3):
            across[chosen, axis] = np.interp(forces[chosen], force[:, 2], force[:, axis])
    travel = (
        travel + _smooth(forces, bench, rng) + rng.normal(0, bench.position_noise_m, travel.size)
    )
    quantum = bench.position_resolution_m
    travel = np.round(travel / quantum + rng.uniform()) * quantum
    measured_n = across + rng.normal(0.0, bench.force_noise_n, across.shape)
    time_s = np.arange(forces.size) / RATE_HZ
    begins = [int(np.flatnonzero((cycles == c) & ~free)[0]) for c in (1, 2)]
    travel = travel - travel[begins[0]]
    touches = tuple(
        TouchPoint(
            time_s=float(time_s[i]), position_m=float(travel[i]), force_n=float(measured_n[i, 2]),
            cycle=c, purpose=purpose, travel_m=float(travel[i]),
        )
        for i, c, purpose in zip(begins, (1, 2), ("first", "cycle"), strict=True)
    )  # fmt: skip
    return PressData(
        time_s=time_s, force_n=measured_n[:, 2], travel_m=travel, phase=phases, cycle=cycles,
        touches=touches, noise_n=bench.force_noise_n, zero_shift_n=0.0,
        lag=measure_lag(time_s, measured_n[:, 2], travel, ~free), lag_corrected_s=0.0,
        clocks=CLOCKS, gauge=False, across_n=measured_n[:, :2],
        lateral_noise_n=np.sqrt(2.0) * bench.force_noise_n, zero_step_n=0.0,
    )  # fmt: skip


def _rising(branches: Branches, sensor: FloatArray, *, up: bool) -> tuple[FloatArray, FloatArray]:
    """Travel (M,) and force as the sensor reads it (M, 3), its force along rising."""
    at_m, force = (branches.up_m, branches.up_n) if up else (branches.down_m, branches.down_n)
    read = force @ sensor.T
    order = np.argsort(read[:, 2], kind="stable")
    return at_m[order], read[order]


def _course(top_n: float) -> tuple[FloatArray, np.ndarray[Any, Any], np.ndarray[Any, Any], Any]:
    """Force along, phase, cycle, and whether in free air, of every sample (N,)."""
    levels = np.linspace(top_n / LEVELS, top_n, LEVELS)
    rows: list[tuple[FloatArray, Phase, int, bool]] = []
    ramp, hold = int(RAMP_S * RATE_HZ), int(HOLD_S * RATE_HZ)
    for cycle in (1, 2):
        rows.append((np.zeros(hold), Phase.GUARDED_APPROACH, cycle, True))
        before = TOUCH_SHARE * top_n
        for phases, targets in (
            ((Phase.LOAD, Phase.HOLD), levels),
            ((Phase.UNLOAD, Phase.UNLOAD_HOLD), levels[-2::-1]),
        ):
            for level in targets:
                rows.append((np.linspace(before, level, ramp), phases[0], cycle, False))
                rows.append((np.full(hold, level), phases[1], cycle, False))
                before = float(level)
    sizes = [row[0].size for row in rows]
    return (
        np.concatenate([row[0] for row in rows]),
        np.repeat([int(row[1]) for row in rows], sizes),
        np.repeat([row[2] for row in rows], sizes),
        np.repeat([row[3] for row in rows], sizes),
    )


def _smooth(force: FloatArray, bench: Bench, rng: np.random.Generator) -> FloatArray:
    """A position error (N,) that changes slowly with the force: over a fifth of the top."""
    grid = np.linspace(0.0, bench.top_n, 60)
    away = np.subtract.outer(grid, grid) / (0.2 * bench.top_n)
    root = np.linalg.cholesky(np.exp(-0.5 * away**2) + 1e-6 * np.eye(grid.size))
    return np.asarray(np.interp(force, grid, bench.smooth_m * (root @ rng.standard_normal(60))))


def saved(bench: Bench, block: Contact, number: int, rng: np.random.Generator) -> SavedRun:
    """A system run against a block that is known to 10 %."""
    data = pressed(bench, block, rng)
    sources = Sources(None, smooth_length_n=0.2 * bench.top_n, nonlinearity=NONLINEARITY,
                      position_resolution_m=bench.position_resolution_m)  # fmt: skip
    told = Conditions(
        sources, bench.top_n, TOUCH_SHARE * bench.top_n, bench.position_resolution_m,
        kind="system", theory_k=block.k, theory_n=block.n, pose="down", arm=bench.arm,
    )  # fmt: skip
    metadata = {"rig": "trial", "force_axis": "+fz", "run_id": f"run{number}",
                "started": "2026-01-01T00:00:00+00:00"}  # fmt: skip
    return SavedRun(Path(f"run{number}.mcap"), data, told, metadata, partial=False)


def conditions(bench: Bench, record: CalibrationRecord) -> Conditions:
    """The conditions of a payload run with this record, as a plan makes them."""
    table, k_s = record.deflection_force_n, record.stiffness_n_per_m
    pair = record.across_m_per_n, record.across_sigma_m_per_n, record.at_share
    c, size, share = ((each[0], each[1]) if each else None for each in pair)
    return Conditions(
        Sources(
            system_stiffness_n_per_m=k_s,
            system_stiffness_sigma_n_per_m=record.deflection_common * k_s
            if table else record.sigma_n_per_m,
            smooth_error_m=record.smooth_error_m or 0.0, smooth_degrees=record.smooth_degrees,
            smooth_length_n=record.smooth_length_n, force_noise_n=bench.force_noise_n,
            position_noise_m=bench.position_noise_m, nonlinearity=NONLINEARITY,
            position_resolution_m=bench.position_resolution_m,
            deflection_force_n=table, deflection_m=record.deflection_m,
            deflection_sigma_m=record.deflection_sigma_m,
        ),
        secant_force_n=bench.top_n,
        touch_force_n=TOUCH_SHARE * bench.top_n,
        position_resolution_m=bench.position_resolution_m,
        rough_length_m=0.0,
        pose="down",
        across=Across(c, size or (0.0, 0.0), record.across_correlation, share, record.share_reach),
        arm=bench.arm,
        misalignment_rad=ARM_MISALIGNMENT_RAD if bench.arm else 0.0,
        yields_m_per_n=1.0 / k_s,
    )  # fmt: skip


def as_before(told: Conditions) -> Conditions:
    """The conditions as an earlier version knew them: K_s alone, and nothing about arms."""
    return replace(told, across=Across(), arm=False, misalignment_rad=0.0, yields_m_per_n=0.0)


def read(data: PressData, told: Conditions) -> tuple[PressData, Conditions]:
    """The data as the product takes them: travel due to the lateral force is subtracted first."""
    if data.across_n is not None:
        taken_m = told.across.taken_m(data.force_n, data.across_n)
        data = replace(data, travel_m=data.travel_m - taken_m)
    return data, measured(told, data)
