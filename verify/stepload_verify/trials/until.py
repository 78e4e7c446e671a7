"""Dry runs that end their loading early, beside the same runs up to the top force.

python -m stepload_verify.trials.until [N]

N worlds, none of them as the plan believes: payloads from a fifth of the believed stiffness to six
times it, smooth and rough, some that creep, a load path that is not as stiff as its table says, a
smooth error of the travel. Each is pressed twice with the same seed, with `procedure.until` and
without. Printed is how often the interval holds the true chord among the results that are called
identified, how wide it is, what force and time were saved, and the largest true force against F_c.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stepload.design.binomial import share as share_of
from stepload.engine.first_loading import true_chord
from stepload.engine.rehearse import payload_truth
from stepload.envelope.theory import theory_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Simulation
from stepload.plan.shipped import plan_path
from stepload_verify.trials.each import for_each
from stepload_verify.trials.whole import dry_run

ASKED = 0.15
TOP_N, LEVELS = 300.0, 12
PROMISED = 0.95


@dataclass(frozen=True, slots=True)
class Pressed:
    """One dry run: `covered` says whether its interval holds the true chord.

    `peak_share` is the largest true force over F_c, `half_width` is NaN where there is no interval.
    """

    status: str
    identified: bool
    covered: bool
    half_width: float
    top_n: float
    duration_s: float
    peak_share: float
    verdict: str


@dataclass(frozen=True, slots=True)
class Pair:
    """The same world pressed up to the top force, and no further than needed."""

    seed: int
    factor: float
    whole: Pressed
    until: Pressed


def world(seed: int, plan: Plan) -> Simulation:
    """Draw how the simulated rig differs from what the plan believes."""
    rng = np.random.default_rng(seed)
    stiffness = plan.rig.system_stiffness
    believed = stiffness.sigma_n_per_m / stiffness.stiffness_n_per_m
    smooth_m = stiffness.smooth_error_m or stiffness.msde_m
    return Simulation(
        seed=seed,
        law=("smooth", "rough")[seed % 2],
        payload_factor=float(np.exp(rng.uniform(math.log(0.2), math.log(6.0)))),
        stiffness_factor=float(np.exp(believed * rng.standard_normal())),
        kinematic_error_m=smooth_m,
        creep=float(rng.uniform(0.0, 0.01)) * (seed % 3 == 0),
    )


def plan_of(until: float | None) -> Plan:
    """The plastic sphere in twelve levels with short holds."""
    plan = load_plan(plan_path("plastic-sphere"))
    levels = tuple(TOP_N * (i + 1) / LEVELS for i in range(LEVELS))
    procedure = replace(
        plan.procedure, levels_n=levels, step_n=levels[0], load_rate_n_per_s=levels[0],
        hold_s=2.0, tare_s=3.0, until=until,
    )  # fmt: skip
    return replace(plan, procedure=procedure)


def press(plan: Plan, seed: int) -> Pressed:
    """One whole dry run, from plan to report."""
    data, peak_share = dry_run(plan, seed)
    headline = data.get("headline")
    covered, half_width = False, math.nan
    if headline is not None and headline["interval_n_per_m"] is not None:
        low, high = headline["interval_n_per_m"]
        payload = payload_truth(plan.payload, theory_of(plan.payload), plan.rig.simulation)
        covered = low <= true_chord(payload, headline["from_n"], headline["to_n"]) <= high
        half_width = (high - low) / (2.0 * headline["value_n_per_m"])
    told = data.get("until")
    return Pressed(
        status=str(data["status"]),
        identified=data["status"] == "completed" and data["verdict"] == "identified",
        covered=covered,
        half_width=half_width,
        top_n=told["level_n"] if told else TOP_N,
        duration_s=data["duration_s"],
        peak_share=peak_share,
        verdict=told["verdict"] if told else "",
    )


def pair(seed: int, asked: float = ASKED) -> Pair:
    """One world, pressed both ways."""
    whole, until = plan_of(None), plan_of(asked)
    simulation = world(seed, whole)
    one, other = (
        press(replace(plan, rig=replace(plan.rig, simulation=simulation)), seed)
        for plan in (whole, until)
    )
    return Pair(seed, simulation.payload_factor, one, other)


def told(name: str, runs: Sequence[Pressed], asked: float) -> str:
    """One line that sums up the runs of one way of pressing."""
    found = [run for run in runs if run.identified]
    held = share_of(sum(run.covered for run in found), len(found))
    narrow = sum(run.half_width <= asked for run in found)
    width = statistics.median([run.half_width for run in found]) if found else math.nan
    return (
        f"{name:8} identified {len(found):3} of {len(runs)}; truth in the interval "
        f"{held.count} of {held.of} [{held.low:.1%}, {held.high:.1%}]; half width, median "
        f"±{width:.1%}, as asked for in {narrow}; mean top "
        f"{statistics.mean(r.top_n for r in runs):.0f} N; mean time "
        f"{statistics.mean(r.duration_s for r in runs):.0f} s; largest force "
        f"{max(r.peak_share for r in runs):.3f} F_c"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("worlds", type=int, nargs="?", default=40)
    parser.add_argument("--asked", type=float, default=ASKED, help="half width, as a share")
    options = parser.parse_args()
    done = for_each(partial(pair, asked=options.asked), range(1, options.worlds + 1))
    for each in done:
        run = each.until
        print(
            f"{each.seed:4} K x {each.factor:5.2f}: {run.verdict:11} at {run.top_n:3.0f} N, "
            f"±{run.half_width:.1%} {'identified' if run.identified else run.status}"
            f"{'' if run.covered else ', truth outside'}"
        )
    whole, until = ([getattr(each, way) for each in done] for way in ("whole", "until"))
    print(told("whole", whole, options.asked))
    print(told("until", until, options.asked))
    for verdict in ("enough", "unreachable", "more"):
        kind = [each for each in done if each.until.verdict == verdict]
        if kind:
            print(
                f"{verdict:11} {len(kind):3} of {len(done)}: loaded to "
                f"{statistics.mean(e.until.top_n for e in kind) / TOP_N:.0%} of the top force, in "
                f"{statistics.mean(e.until.duration_s / e.whole.duration_s for e in kind):.0%} of "
                f"the time; as narrow as asked for in "
                f"{sum(e.until.identified and e.until.half_width <= options.asked for e in kind)}, "
                "up to the top force in "
                f"{sum(e.whole.identified and e.whole.half_width <= options.asked for e in kind)}"
            )
    found = [run for run in until if run.identified]
    held = share_of(sum(run.covered for run in found), len(found))
    safe = all(run.peak_share < 1.0 for run in [*whole, *until])
    no_gain = all(e.whole.identified or not e.until.identified for e in done)
    if not no_gain:
        print("identified only because it ended early:",
              [e.seed for e in done if e.until.identified and not e.whole.identified])  # fmt: skip
    return 0 if safe and held.high >= PROMISED else 1


if __name__ == "__main__":
    sys.exit(main())
