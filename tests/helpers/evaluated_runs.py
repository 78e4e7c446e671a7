"""Evaluations of runs made by hand: a plan of the package, samples drawn here, no engine."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.plan.load import load_plan
from stepload.record.lag import Lag
from stepload.record.outcome import Lateness, RunOutcome, RunStatus
from stepload.record.reader import Event, Recording
from stepload.record.rows import Phase
from stepload.report.analyse import Evaluation, identify_payload
from stepload.report.conditions import measured, planned
from stepload.report.levels import Level, levels_of
from stepload.report.press_data import PressData, TouchPoint

ROOT = Path(__file__).resolve().parents[2]
K, N, KS, RATE_HZ, REST = 6.57e8, 1.5, 3.49e6, 100.0, 100
TOLD = {
    "run_id": "0123456789ab", "plan": "sphere", "started": "2026-03-04T05:06:07+00:00",
    "stepload": "0.1.0", "python": "3.11.7", "system": "Linux", "operator": "A. Tester",
    "specimen": "S-17", "batch": "B7", "tags": "lot=3\nsurface=polished", "notes": "",
    "force_axis": "+fz", "rig": "STVF", "calibration": "declared", "payload": "plastic sphere",
    "arm": "axis: A 7", "force_sensor": "cell: S2 3", "sha256 plan.yaml": "ab" * 32,
}  # fmt: skip


def a_preflight() -> Preflight:
    """Of the paper's plastic sphere."""
    return preflight_of(load_plan(ROOT / "procedures" / "plastic-sphere.yaml"))


def pressed(levels: int, cycles: int = 2, creep_m: float = 0.0, pull_n: float = 0.0
            ) -> tuple[PressData, tuple[Event, ...]]:  # fmt: skip
    """Loadings and unloadings in steps up to 300 N; every hold creeps, and the end may pull."""
    rng = np.random.default_rng(3)
    parts: list[tuple[Phase, int, np.ndarray[Any, Any], float]] = []
    events, clock = [], 0
    tops = np.linspace(300.0 / levels, 300.0, levels)
    for cycle in range(1, cycles + 1):
        before = 0.0
        for way, phases in ((tops, (Phase.LOAD, Phase.HOLD)),
                            (tops[-2::-1], (Phase.UNLOAD, Phase.UNLOAD_HOLD))):  # fmt: skip
            for level in way:
                ramp = np.linspace(before, level, 60)
                parts += [(phases[0], cycle, ramp, 0.0)]
                parts += [(phases[1], cycle, np.full(REST, level), creep_m)]
                clock, before = clock + ramp.size + REST, float(level)
                step = int(np.argmin(np.abs(tops - level))) + 1
                told = {
                    "cycle": cycle, "step": step, "level_n": float(level), "held_s": REST / RATE_HZ,
                    "loading": phases[1] is Phase.HOLD, "settled": step != 2,
                }  # fmt: skip
                events.append(Event(clock / RATE_HZ, "held", told))
        parts += [(Phase.RETRACT, cycle, np.full(20, -pull_n), 0.0)]
        clock += 20
    force = np.concatenate([part[2] for part in parts])
    late = np.concatenate([np.linspace(0.0, part[3], part[2].size) for part in parts])
    travel = (np.maximum(force, 0.0) / K) ** (1.0 / N) + force / KS + late
    touch = TouchPoint(
        time_s=0.0, position_m=5e-3, force_n=4.0, cycle=1, purpose="first", travel_m=0.0
    )
    again = touch.model_copy(update={"position_m": 5e-3 + 2e-6, "purpose": "again"})
    end = {"time_s": clock / RATE_HZ, "travel_m": 1e-6, "purpose": "last"}
    last = touch.model_copy(update=end)
    data = PressData(
        time_s=np.arange(force.size) / RATE_HZ,
        force_n=force + 0.5 * rng.standard_normal(force.size),
        travel_m=np.round(travel / 1e-6) * 1e-6,
        phase=np.concatenate([np.full(part[2].size, int(part[0])) for part in parts]),
        cycle=np.concatenate([np.full(part[2].size, part[1]) for part in parts]),
        touches=(touch, again, last), noise_n=0.5, zero_shift_n=0.1, lag=Lag(0.0, 1e-4, "made"),
        lag_corrected_s=0.0, clocks=(), gauge=False,
    )  # fmt: skip
    return data, tuple(events)


def evaluated(
    preflight: Preflight,
    made: tuple[PressData, tuple[Event, ...]] | None,
    *,
    identified: bool = True,
    status: RunStatus = RunStatus.COMPLETED,
    dry_run: bool = False,
    **told: str,
) -> Evaluation:
    """The evaluation of such data; `None`: the run ended before it touched anything."""
    data, events = made if made is not None else (None, ())
    end_s = float(data.time_s[-1]) if data is not None else 1.0
    ticks = SimpleNamespace(
        time_s=np.linspace(0.0, end_s, 50), predicted_peak_n=np.linspace(0.0, 310.0, 50)
    )
    nothing = cast(Any, None)
    recording = Recording(
        path=Path("run.mcap"), force=nothing, second_force=None, arm=nothing, displacement=None,
        ticks=cast(Any, ticks), events=events, metadata=TOLD | told,
        outcome={}, attachments={}, results=None,
        partial=False, damage="",
    )  # fmt: skip
    outcome = RunOutcome(
        status, None, "The run ended as it did.", False, (), 0.0, end_s, 300.0, 0.1, 6, 2, (), (),
        Lateness(1000, 3, 2.5e-3, 1e-5),
    )  # fmt: skip
    found, levels = None, tuple[Level, ...]()
    if data is not None:
        conditions = measured(planned(preflight), data)
        levels = levels_of(data, events, conditions)
        if identified:
            found = identify_payload(data, conditions)
    problem = "" if found else "there is nothing to identify"
    return Evaluation(
        preflight, outcome, recording, dry_run, data=data, identification=found, problem=problem,
        levels=levels,
    )  # fmt: skip
