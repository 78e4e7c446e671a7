"""Is a sound rig ever stopped? Whole procedures on the simulated rig, one seed after another.

Prints per plan: runs, those stopped with their cause, the largest true force over F_lim, the time.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from functools import partial

from stepload.engine.loop import run_loop
from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.envelope.envelope import envelope_of
from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload.rig.world import load_world
from stepload_verify.campaign.incidents import NullRecorder
from stepload_verify.trials.each import for_each

PLANS = ("plastic-sphere", "ur5e-silicone-sphere", "ur16e-polyurethane-sphere")
SEEDS = 20


def one(name: str, seed: int) -> tuple[str, float]:
    """How the run ended, and its true peak force over F_lim."""
    plan = load_plan(plan_path(name))
    envelope = envelope_of(plan)
    rig = load_world()(world_for(envelope, seed=seed))
    for device in (rig.force, rig.second_force, rig.displacement, rig.arm):
        if device is not None:
            device.open(1.0)
    outcome = run_loop(Engine(envelope, Operator()), rig, NullRecorder())
    ended = outcome.status.value
    if outcome.cause is not None:
        ended += f", seed {seed}: {outcome.cause.rule} {outcome.cause.message}"
    return ended, rig.world.true_peak_force_n / envelope.force_limit_n


def main() -> None:
    names, stopped = sys.argv[1:] or PLANS, 0
    for name in names:
        start_s = time.monotonic()
        found = for_each(partial(one, name), range(SEEDS))
        peak = max(ratio for _, ratio in found)
        print(f"{name}: peak {peak:.3f} of F_lim, {time.monotonic() - start_s:.0f} s")
        for ended, count in Counter(ended for ended, _ in found).items():
            print(f"  {count:3} {ended}")
            stopped += count * (ended != "completed")
    sys.exit(f"{stopped} runs on sound rigs did not complete" if stopped else 0)


if __name__ == "__main__":
    main()
