"""What a payload meets while the arm draws back, where friction has held it sideways.

    python -m stepload_verify.trials.unloading

Sound arms of the campaign with six axes, all with a lateral share of 25 % where the tip sticks, are
pressed at several frictions, on a square plate and on one tilted by 28 deg. Printed is the largest
|f|/g(t) over F_c up to the end of the pressing, and over the whole run. While the force along the
axis goes down, friction that clings goes down less; it slides at the end with a share of mu, and of
F_c only g(mu) is left then.

Then the same with mu in the plan (payload.friction), at the top force that preflight allows with
it, or at the plan's where that is less. "refused": no force is left that this rig can press.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

from stepload.engine.tick import Engine
from stepload.envelope.changes import with_top
from stepload.envelope.envelope import Envelope, envelope_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import WorldView
from stepload_verify.campaign.mounts import draw_stance, mounted
from stepload_verify.campaign.scenario import TWO_CHANNELS, draw
from stepload_verify.campaign.single import run_scenario

SEED = 21
SHARE = 0.25
COUPLING = 0.6
FRICTIONS = (0.3, 0.45, 0.6)
INDICES = (4, 6, 8, 12)
TILTS_DEG = (0.0, 28.0)
SAFE_SHARE = 0.99
"""Of the largest safe top force: it is rounded when it is written."""
REFUSED = "refused"
_PRESSING = (Phase.LOAD, Phase.HOLD)


@dataclass(frozen=True, slots=True)
class Clung:
    """One run. `pressed`, `whole`: the largest |f|/g(t) over F_c in the pressing, and in all."""

    index: int
    n: float
    friction: float
    tilt_deg: float
    ended: str
    top: float
    pressed: float
    whole: float


def cling(template: Plan, index: int, friction: float, tilt_deg: float, *, stated: bool) -> Clung:
    """The sound arm `index` with this friction, nothing else wrong.

    Args:
        stated: whether the plan says so too, and presses what preflight allows then.
    """
    scenario = draw(template, SEED, TWO_CHANNELS, index, (), "six")
    stance = replace(
        draw_stance(Random(index), ur=True), coupling=COUPLING, lateral=COUPLING / SHARE,
        friction=friction, kinetic_share=1.0, tilt_rad=math.radians(tilt_deg), turn_rad=0.0,
        dry_ratio=1.0,
    )  # fmt: skip
    truth = mounted(scenario.truth, scenario.envelope, stance, ())
    worlds: list[WorldView] = []
    pressed_n = 0.0

    def begin(_engine: Engine, world: WorldView) -> None:
        worlds.append(world)

    def look(row: TickRow) -> None:
        nonlocal pressed_n
        if row.phase in _PRESSING:
            pressed_n = worlds[0].true_peak_equivalent_n

    if stated:
        scenario = replace(scenario, envelope=_stated(scenario.plan, friction))
        if scenario.envelope.limits is None:
            return Clung(
                index, truth.payload.n, friction, tilt_deg, REFUSED, math.nan, math.nan, math.nan
            )
    found, _ = run_scenario(replace(scenario, truth=truth), None, look, begin)
    limit_n = found.elastic_limit_n
    top_n = scenario.plan.procedure.top_force_n
    return Clung(
        index, truth.payload.n, friction, tilt_deg, found.rule or found.status, top_n / limit_n,
        pressed_n / limit_n, found.peak_ratio,
    )  # fmt: skip


def _stated(plan: Plan, friction: float) -> Envelope:
    """What preflight makes of the plan with this friction in it, at a top force that it allows."""
    plan = replace(plan, payload=replace(plan.payload, friction=friction))
    found = envelope_of(plan)
    safe_n = SAFE_SHARE * found.largest_safe_force_n
    if 0.0 < safe_n < plan.procedure.top_force_n:
        found = envelope_of(with_top(plan, safe_n).make())
    return found


def table(template: Plan, *, stated: bool) -> Iterator[Clung]:
    """Every arm at every friction, on every plate."""
    for tilt_deg in TILTS_DEG:
        for index in INDICES:
            for friction in FRICTIONS:
                yield cling(template, index, friction, tilt_deg, stated=stated)


def main() -> None:
    """Print both tables."""
    template = load_plan(Path("procedures/campaign.yaml"))
    for stated in (False, True):
        print("mu in the plan" if stated else "mu not in the plan")
        print("run    n   mu  tilt  ended by   top/F_c  pressing  whole run")
        for row in table(template, stated=stated):
            print(
                f"{row.index:3d} {row.n:5.2f} {row.friction:4.2f} {row.tilt_deg:5.0f}"
                f"  {row.ended:9s} {row.top:8.2f} {row.pressed:9.3f} {row.whole:10.3f}"
            )


if __name__ == "__main__":
    main()
