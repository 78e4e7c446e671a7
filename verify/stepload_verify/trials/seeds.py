"""Dry runs of a plan over many seeds: secant of the believed fit against the simulated truth.

python -m stepload_verify.trials.seeds --seeds 20 --law declared

Also whether the stated interval holds the truth, and the true peak force against F_c. The simulated
contact is smooth unless `--law` says otherwise; the truth is the secant from the mean plane.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from stepload.engine.first_loading import true_secant
from stepload.engine.rehearse import payload_truth
from stepload.envelope.theory import theory_of
from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload_verify.trials.each import for_each
from stepload_verify.trials.whole import dry_run

PLAN = plan_path("plastic-sphere")
TOLERANCE = 0.03


@dataclass(frozen=True)
class Seeded:
    """One dry run; ratios to the truth."""

    seed: int
    status: str
    believe: str
    secant_ratio: float
    joint_ratio: float
    covered: bool
    peak_ratio: float


def run_seed(seed: int, plan_file: Path = PLAN, law: str = "smooth") -> Seeded:
    """One whole dry run, from plan to report."""
    plan = load_plan(plan_file)
    simulation = replace(plan.rig.simulation, law=law)
    plan = replace(plan, rig=replace(plan.rig, simulation=simulation))
    data, peak_share = dry_run(plan, seed)
    fits = data["fits"]
    believed = fits[data["believe"]]
    truth = true_secant(
        payload_truth(plan.payload, theory_of(plan.payload), simulation),
        believed["secant_force_n"],
    )
    low, high = data["interval_secant_n_per_m"]
    return Seeded(
        seed=seed,
        status=data["status"],
        believe=data["believe"],
        secant_ratio=believed["secant_n_per_m"] / truth,
        joint_ratio=fits["joint"]["secant_n_per_m"] / truth,
        covered=low <= truth <= high,
        peak_ratio=peak_share,
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--plan", type=Path, default=PLAN, help="the plastic sphere by default")
    parser.add_argument("--law", default="smooth", choices=("smooth", "rough", "declared"))
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    one_run = partial(run_seed, plan_file=options.plan, law=options.law)
    done = for_each(one_run, range(1, options.seeds + 1))
    if options.json:
        print(json.dumps([asdict(one) for one in done]))
    else:
        print(f"{'seed':>4} {'status':10} {'believed':9} {'secant/truth':>13} {'joint/truth':>12} "
              f"{'covered':>8} {'peak/F_c':>9}")  # fmt: skip
        for one in done:
            print(f"{one.seed:4} {one.status:10} {one.believe:9} {one.secant_ratio:13.4f} "
                  f"{one.joint_ratio:12.4f} {one.covered!s:>8} {one.peak_ratio:9.3f}")  # fmt: skip
        errors = [abs(one.joint_ratio - 1.0) for one in done]
        print(
            f"{len(done)} seeds: |joint/truth - 1| median {statistics.median(errors):.2%}, "
            f"max {max(errors):.2%}; truth in the interval {sum(o.covered for o in done)} times; "
            f"largest peak {max(o.peak_ratio for o in done):.3f} F_c"
        )
    good = all(
        abs(o.joint_ratio - 1.0) <= TOLERANCE and o.peak_ratio < 1.0 and o.status == "completed"
        for o in done
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
