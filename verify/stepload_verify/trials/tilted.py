"""Rigs with six axes that are tilted as far as their plan says, and wrong sideways on purpose.

    python -m stepload_verify.trials.tilted 3000

Rigs and faults of devices are those of `stepload campaign --axes six`, half of them without faults.
Where the plan says that the plate may be tilted by 7 deg it is tilted by 4 to 7, else by up to 3.
Two in five have a tip that sticks more than stated, two in five are dragged sideways by 32 to 60 %.
Printed is how the runs ended, and which came nearest to F_c: the largest |f|/g(t) over F_c.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from random import Random

from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload_verify.campaign.mounts import STEEPEST_RAD, mounted
from stepload_verify.campaign.result import Result
from stepload_verify.campaign.scenario import (
    PLANTS,
    TWO_CHANNELS,
    draw,
    hazard_of,
    kinds_from,
    stance_of,
)
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign.truth import Anomaly, anomaly_of

SEED = 5
KINDS = tuple(kind for kind in kinds_from("all", "six") if kind != PLANTS)
SHOWN = 8
STEEP_DEG = (4.0, math.degrees(STEEPEST_RAD))
SIDEWAYS = ("stuck stiffer than stated", "dragged sideways")


def tilted(template: Plan, index: int) -> Result:
    """Run the rig `index` of a campaign with anomalies drawn here."""
    chance = Random(f"tilted {SEED} {index}")
    scenario = draw(template, SEED, TWO_CHANNELS, index, KINDS, "six")
    anomalies: list[Anomaly] = []
    if scenario.plan.rig.plate_tilt_rad is not None:
        anomalies.append(Anomaly("plate tilted", math.radians(chance.uniform(*STEEP_DEG))))
    way = int(2.5 * chance.random())
    if way < len(SIDEWAYS):
        anomalies.append(anomaly_of(SIDEWAYS[way], chance, scenario.plan))
    wrong = tuple(anomalies)
    stance = stance_of(SEED, TWO_CHANNELS, index)
    truth = mounted(replace(scenario.truth, mount=None), scenario.envelope, stance, wrong)
    if chance.random() < 0.5:
        truth = replace(truth, faults=())
    hazard = hazard_of(truth.faults, scenario.plan, wrong)
    changed = replace(scenario, truth=truth, healthy=False, anomalies=wrong, hazard=hazard)
    return run_scenario(changed)[0]


def main() -> None:
    """Print how they ended, and the worst."""
    template = load_plan(Path("procedures/campaign.yaml"))
    rows = [tilted(template, index) for index in range(int(sys.argv[1]))]
    ended = Counter(row.rule or row.status for row in rows)
    print(", ".join(f"{name} {count}" for name, count in ended.most_common()))
    for apart in ("", *sorted({row.hazard for row in rows} - {""})):
        some = sorted((row for row in rows if row.hazard == apart), key=lambda row: -row.peak_ratio)
        above = sum(row.peak_ratio > 1.0 for row in some)
        print(f"{apart or 'no hazard'}: {len(some)} runs, {above} above F_c")
        for row in some[:SHOWN]:
            end = row.rule or row.status
            print(f"  {row.index:5d} {row.peak_ratio:.3f} {end:9s} {', '.join(row.wrong)}")


if __name__ == "__main__":
    main()
