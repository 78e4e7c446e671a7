"""Arms drawn at random that press all that preflight allows at the friction that their plan states.

    python -m stepload_verify.trials.unloading_dice 60

Friction 0.1 to 0.6, the plate tilted by up to 30 deg, the tip sticking at a share of up to 0.6, and
the top force at 0.99 of the largest safe one. Printed are how the runs ended, and those that came
nearest to F_c: the largest |f|/g(t) over F_c, pressing and drawing back.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

from stepload.envelope.changes import with_top
from stepload.envelope.envelope import Envelope, envelope_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload_verify.campaign.mounts import draw_stance, mounted
from stepload_verify.campaign.scenario import TWO_CHANNELS, draw
from stepload_verify.campaign.single import run_scenario

SEED = 33
SAFE_SHARE = 0.99
REFUSED = "refused"
SHARES = (0.1, 0.2, 0.3)
"""Values of the plan's `procedure.max_lateral_share`."""
SHOWN = 6


@dataclass(frozen=True, slots=True)
class Cast:
    """One run; `peak` is the largest |f|/g(t) over F_c, 0 where the plan was refused."""

    index: int
    friction: float
    tilt_deg: float
    share: float
    ended: str
    peak: float


def cast(template: Plan, index: int) -> Cast:
    """Draw run `2 * index` of the campaign, whose even runs are arms, and press it."""
    chance = Random(f"unloading {SEED} {index}")
    scenario = draw(template, SEED, TWO_CHANNELS, 2 * index, (), "six")
    friction, share = chance.uniform(0.1, 0.6), chance.uniform(0.03, 0.6)
    coupling = min(chance.uniform(0.2, 1.3), 0.95 / share)
    tilt_deg, limit = chance.uniform(0.0, 30.0), chance.choice(SHARES)
    stance = replace(
        draw_stance(Random(index), ur=True), coupling=coupling, lateral=coupling / share,
        friction=friction, kinetic_share=chance.uniform(0.6, 1.0), dry_ratio=1.0,
        tilt_rad=math.radians(tilt_deg), stated_ratio=None,
    )  # fmt: skip
    envelope = _pressed_hard(scenario.plan, friction, limit)
    if envelope.limits is None:
        return Cast(index, friction, tilt_deg, share, REFUSED, 0.0)
    truth = mounted(scenario.truth, envelope, stance, ())
    found, _ = run_scenario(replace(scenario, envelope=envelope, truth=truth))
    return Cast(index, friction, tilt_deg, share, found.rule or found.status, found.peak_ratio)


def _pressed_hard(plan: Plan, friction: float, share: float) -> Envelope:
    """The plan with this friction at the largest top force that is safe then."""
    plan = replace(
        plan,
        payload=replace(plan.payload, friction=friction),
        procedure=replace(plan.procedure, max_lateral_share=share),
    )
    found = envelope_of(plan)
    if found.largest_safe_force_n <= 0.0:
        return found
    return envelope_of(with_top(plan, SAFE_SHARE * found.largest_safe_force_n).make())


def main() -> None:
    """Press as many arms as the command line says and print how the runs ended."""
    template = load_plan(Path("procedures/campaign.yaml"))
    casts = [cast(template, index) for index in range(int(sys.argv[1]))]
    print(", ".join(f"{ended} {count}" for ended, count in Counter(c.ended for c in casts).items()))
    print("run    mu  tilt  sticks at  ended by   |f|/g/F_c")
    for each in sorted(casts, key=lambda c: c.peak)[: -SHOWN - 1 : -1]:
        print(
            f"{each.index:3d}  {each.friction:4.2f}  {each.tilt_deg:4.0f}  {each.share:9.2f}"
            f"  {each.ended:9s} {each.peak:10.3f}"
        )


if __name__ == "__main__":
    main()
