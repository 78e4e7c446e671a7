"""A record with two cycles and a pause, made without an engine."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from stepload.record.reader import Event, Recording
from stepload.record.rows import ArmColumns, ForceColumns, Phase, TickColumns

STIFFNESS_N_PER_M = 2e6
RATE_HZ = 1000.0
SURFACE_M = 3e-3
SETS_M = (0.0, 5e-6, 8e-6)
"""How far the surface of the payload has moved when each contact begins."""
PURPOSES = ("first", "cycle", "resume")
LATERAL_N = 12.0
BIAS_N = np.array([4.0, -2.0, 1.0])


def recorded(*, lateral: bool = True, noise_n: float = 0.0) -> Recording:
    """Tare for 1 s, then three contacts of 4 s: in free air 1 s, touch, up to 100 N and down.

    The first two are cycles 1 and 2, the third is cycle 2 again, after a pause. The zero of all
    three components of force drifts by 0.1 N/s.
    """
    time_s = np.arange(0.0, 14.0, 1.0 / RATE_HZ)
    deep_m = np.full(time_s.size, -1e-4)
    phase = np.full(time_s.size, int(Phase.TARE))
    cycle = np.ones(time_s.size, np.int64)
    events = []
    for number, (shift_m, purpose) in enumerate(zip(SETS_M, PURPOSES, strict=True)):
        start_s = 1.0 + 4.0 * number
        on = (time_s >= start_s + 1.0) & (time_s < start_s + 4.0)
        press = np.interp(time_s, start_s + np.array([0.0, 0.99, 1.0, 2.5, 4.0]),
                          [-1e-4, -1e-4, 0.0, 5e-5, 0.0])  # fmt: skip
        here = (time_s >= start_s) & (time_s < start_s + 4.0)
        deep_m[here] = press[here] + shift_m
        rising = on & (time_s < start_s + 2.5)
        phase[here] = int(Phase.GUARDED_APPROACH)
        phase[on], phase[rising] = int(Phase.UNLOAD), int(Phase.LOAD)
        cycle[here] = min(number + 1, 2)
        events.append(
            Event(start_s + 1.0, "touch", {
                "position_m": SURFACE_M + shift_m, "force_n": 1.0, "cycle": min(number + 1, 2),
                "purpose": purpose,
            })
        )  # fmt: skip
    for kind, end_s in (("tare", 1.0), ("zero_shift", 14.0)):
        drift_n = 0.1 * (end_s - 0.5)
        events.append(
            Event(end_s, kind, {
                "time_s": end_s, "duration_s": 0.99, "mean_n": BIAS_N[2] + drift_n, "noise_n": 0.1,
            })
        )  # fmt: skip
    force_n = STIFFNESS_N_PER_M * np.maximum(deep_m - np.interp(
        time_s, [0.0, 5.0, 5.001, 9.0, 9.001], [0.0, 0.0, SETS_M[1], SETS_M[1], SETS_M[2]]
    ), 0.0)  # fmt: skip
    wrench = np.zeros((time_s.size, 6))
    wrench[:, 2] = force_n + BIAS_N[2] + 0.1 * time_s
    if lateral:
        share = force_n / 100.0 * LATERAL_N
        wrench[:, 0] = 0.6 * share + BIAS_N[0] + 0.1 * time_s
        wrench[:, 1] = 0.8 * share + BIAS_N[1] + 0.1 * time_s
        wrench[:, :2] += np.random.default_rng(1).normal(0.0, noise_n, (time_s.size, 2))
    zeros, count = np.zeros(time_s.size), np.arange(time_s.size)
    none = np.full(time_s.size, math.nan)
    healthy = np.zeros(time_s.size, np.int64)
    return Recording(
        path=Path("run.mcap"),
        force=ForceColumns(
            receive_time_s=time_s, sequence=count, device_time_s=none, status=healthy,
            temperature_c=none, wrench=wrench,
        ),
        second_force=None,
        arm=ArmColumns(
            receive_time_s=time_s, sequence=count, device_time_s=none, status=healthy,
            position_m=SURFACE_M + deep_m, force_n=none, pose=np.zeros((time_s.size, 6)),
            wrench=np.full((time_s.size, 6), math.nan),
        ),
        displacement=None,
        ticks=TickColumns(
            time_s=time_s, target_m=zeros, force_n=zeros, second_force_n=zeros,
            predicted_peak_n=zeros, limit_n=zeros, compliance_m_per_n=zeros, level_n=zeros,
            late_s=zeros, phase=phase, cycle=cycle, step=np.ones(time_s.size, np.int64),
        ),
        events=tuple(sorted(events, key=lambda event: event.time_s)),
        metadata={"force_axis": "+fz"}, outcome={}, attachments={}, results={}, partial=False,
        damage="",
    )  # fmt: skip
