"""How long the engine thinks per tick: a whole healthy run recorded on the simulated rig, then its
samples fed to a fresh engine, nothing else running. Prints µs per tick for both arm classes.
"""

from __future__ import annotations

import gc
import sys
import time
from pathlib import Path
from typing import Any

from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.rig.world import load_world

PLANS = ("plastic-sphere", "ur5e-silicone-sphere")
REPEATS = 5


def _engine(plan: Plan) -> Engine:
    return Engine(preflight_of(plan), Operator())


def _inputs(plan: Plan) -> list[tuple[Any, ...]]:
    """What the engine was given in each tick of one run."""
    rig, engine = load_world()(world_for(preflight_of(plan))), _engine(plan)
    rig.force.open(1.0)
    rig.arm.open(1.0)
    if rig.second_force:
        rig.second_force.open(1.0)
    inputs: list[tuple[Any, ...]] = []
    done = False
    while not done:
        now_s = rig.clock.now_s()
        second = rig.second_force.drain() if rig.second_force else ()
        given = (now_s, rig.force.drain(), rig.arm.drain(), (), second)
        inputs.append(given)
        target_m, done = engine.tick(*given)
        if target_m == target_m:
            rig.arm.command(target_m)
        rig.clock.sleep_until(now_s + rig.arm.period_s)
    if engine.cause is not None:
        sys.exit(f"{plan.name}: not a healthy run: {engine.cause}")
    return inputs


def main() -> None:
    print(f"{'plan':24} {'ticks':>8} {'µs/tick':>8} {'worst of':>9}")
    for name in PLANS:
        plan = load_plan(Path("procedures") / f"{name}.yaml")
        inputs = _inputs(plan)
        took = []
        for _ in range(REPEATS):
            tick = _engine(plan).tick
            gc.disable()
            start = time.process_time()
            for given in inputs:
                tick(*given)
            took.append((time.process_time() - start) / len(inputs) * 1e6)
            gc.enable()
        print(f"{name:24} {len(inputs):8} {min(took):8.2f} {max(took):9.2f}")


if __name__ == "__main__":
    main()
