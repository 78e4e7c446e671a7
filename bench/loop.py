"""The run's loop in real time beside an empty one: how late ticks begin, and what a tick costs.

    python bench/loop.py [--seconds 10]

Both keep the same absolute deadlines with the same precautions, one after the other, several times.
The run's loop drains two streams, judges, commands and records (the writer is another process); the
samples are those of a dry run, handed out tick by tick as if they had just arrived.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepload.engine.loop import run_loop
from stepload.engine.operator import Operator
from stepload.engine.realtime import realtime_conditions
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.record.recorder import Recorder
from stepload.rig.clock import MonotonicClock
from stepload.rig.world import load_world

PLAN = Path(__file__).parents[1] / "procedures" / "ur5e-silicone-sphere.yaml"
ROUNDS = 3


def engine_for(plan: Plan) -> Engine:
    return Engine(preflight_of(plan), Operator())


class Canned:
    """A device that hands out one recorded batch a tick; it takes any command."""

    def __init__(self, batches: list[list[Any]], period_s: float, rate_hz: float) -> None:
        self._batches = iter(batches)
        self.period_s, self.rate_hz, self.has_force = period_s, rate_hz, True

    def drain(self) -> list[Any]:
        return next(self._batches)

    def command(self, position_m: float) -> None:
        """Nothing moves."""

    def held_m(self) -> float:
        """Where the recorded arm stood when its run began."""
        return 0.0

    def fault(self) -> None:
        """Never."""

    def safe(self, timeout_s: float) -> None:
        """Always."""

    retract = safe


@dataclass
class CannedRig:
    """What `run_loop` needs of a rig."""

    arm: Any
    force: Any
    clock: Any
    displacement: Any = None
    second_force: Any = None


def batches(plan: Plan, ticks: int) -> Iterator[tuple[list[Any], list[Any]]]:
    """Force and arm samples of the first ticks of a dry run."""
    rig, engine = load_world()(world_for(preflight_of(plan))), engine_for(plan)
    rig.force.open(1.0)
    rig.arm.open(1.0)
    for _ in range(ticks):
        now_s = rig.clock.now_s()
        force, arm = rig.force.drain(), rig.arm.drain()
        yield force, arm
        target_m, done = engine.tick(now_s, force, arm)
        if done:
            return
        if target_m == target_m:
            rig.arm.command(target_m)
        rig.clock.sleep_until(now_s + rig.arm.period_s)


def run_once(plan: Plan, recorded: list[tuple[list[Any], list[Any]]]) -> tuple[list[float], float]:
    """Lateness of every tick and CPU time per tick of the run's loop, in s."""
    period_s = 1.0 / plan.rig.arm.rate_hz
    clock = MonotonicClock()
    start_s = clock.now_s() + 0.05

    def shifted(samples: list[Any]) -> list[Any]:
        return [
            sample._replace(receive_time_s=sample.receive_time_s + start_s) for sample in samples
        ]

    force = Canned([shifted(pair[0]) for pair in recorded], period_s, plan.rig.force.rate_hz)
    arm = Canned([shifted(pair[1]) for pair in recorded], period_s, 1.0 / period_s)
    rates_hz = {"force": plan.rig.force.rate_hz, "arm": 1.0 / period_s, "tick": 1.0 / period_s}
    late_s: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        recorder = Recorder(
            Path(folder),
            rates_hz=rates_hz,
            clock=clock,
            metadata={},
            attachments={},
            lossless=False,
        )
        engine = engine_for(plan)
        tick = engine.tick

        def counted(*given: Any) -> Any:
            late_s.append(engine.late_s)
            target_m, done = tick(*given)
            return target_m, done or len(late_s) == len(recorded)

        engine.tick = counted  # type: ignore[method-assign]
        cpu_s = time.thread_time()
        run_loop(engine, CannedRig(arm, force, clock), recorder)
        cpu_s = time.thread_time() - cpu_s
        recorder.finish({}, "")
    if engine.cause is not None:
        raise SystemExit(f"the canned run was stopped: {engine.cause}")
    return late_s, cpu_s / len(late_s)


def empty_once(period_s: float, ticks: int) -> tuple[list[float], float]:
    """The same of a loop that does nothing."""
    clock = MonotonicClock()
    late_s = []
    cpu_s = time.thread_time()
    with realtime_conditions(virtual=False):
        deadline_s = clock.now_s()
        for _ in range(ticks):
            now_s = clock.now_s()
            late_s.append(now_s - deadline_s)
            deadline_s += period_s * max(1.0, late_s[-1] // period_s)
            clock.sleep_until(deadline_s)
    return late_s, (time.thread_time() - cpu_s) / ticks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="of each loop in each round")
    options = parser.parse_args()
    plan = load_plan(PLAN)
    period_s = 1.0 / plan.rig.arm.rate_hz
    recorded = list(batches(plan, round(options.seconds / period_s)))
    print(f"{'loop':8}{'p50 late':>10}{'p99 late':>10}{'p99.9':>10}{'worst':>10}{'overruns':>10}"
          f"{'CPU/tick':>10}")  # fmt: skip
    results: dict[str, list[tuple[float, float]]] = {"run": [], "empty": []}
    for _ in range(ROUNDS):
        for name in results:
            late_s, cpu_s = (
                run_once(plan, recorded) if name == "run" else empty_once(period_s, len(recorded))
            )
            late_s.sort()
            p50, p99, p999 = (
                late_s[int(len(late_s) * share)] * 1e6 for share in (0.5, 0.99, 0.999)
            )
            overruns = sum(late > period_s for late in late_s)
            results[name].append((p99, cpu_s))
            print(f"{name:8}{p50:8.0f}µs{p99:8.0f}µs{p999:8.0f}µs{late_s[-1] * 1e3:8.1f}ms"
                  f"{overruns:10d}{cpu_s * 1e6:8.1f}µs", flush=True)  # fmt: skip
    run, empty = ([statistics.median(column) for column in zip(*rows, strict=True)]
                  for rows in results.values())  # fmt: skip
    print(f"p99 lateness, run / empty: {run[0] / empty[0]:.2f}; CPU per tick, run / empty: "
          f"{run[1] / empty[1]:.1f}; share of the period: {run[1] / period_s:.1%}")  # fmt: skip


if __name__ == "__main__":
    main()
