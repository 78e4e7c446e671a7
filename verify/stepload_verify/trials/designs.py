"""Does a designed plan do what its design says? Whole dry runs of it, beside the paper's steps.

python -m stepload_verify.trials.designs 40

The plan is designed for the paper's plastic sphere on its rig, in 3 min. Printed for it and for
the paper's 50 N steps: what preflight reckons that a run takes, the half width that is reported
(median), how many runs are IDENTIFIED, and of how many of these the interval holds the truth.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stepload.design.make import Design, design
from stepload.design.written import text_of, write
from stepload.engine.first_loading import true_chord
from stepload.engine.rehearse import payload_truth
from stepload.envelope.envelope import envelope_of
from stepload.estimators.judge import ResultVerdict
from stepload.plan.load import load_plan
from stepload.plan.shipped import payload_folder, plan_path
from stepload.runner.choose import open_pool
from stepload.session.experiment import run_plan
from stepload_verify.trials.each import for_each

RIG, PAYLOAD = "stvf", payload_folder() / "plastic-sphere.yaml"
WITHIN_S, SURFACE = 180.0, "5 mm"


@dataclass(frozen=True, slots=True)
class Pressed:
    """One dry run: half width, whether it says IDENTIFIED, whether its interval holds the truth."""

    half_width: float
    identified: bool
    true: bool


def pressed(seed: int, plan_file: Path) -> Pressed:
    """One whole dry run, from plan to result."""
    plan = load_plan(plan_file)
    envelope = envelope_of(plan)
    with tempfile.TemporaryDirectory() as place:
        done = run_plan(envelope, dry_run=True, out=Path(place) / "run", seed=seed)
    found = done.data["headline"]
    truth = true_chord(
        payload_truth(plan.payload, envelope.theory, plan.rig.simulation),
        found["from_n"],
        found["to_n"],
    )
    low, high = found["interval_n_per_m"]
    return Pressed(
        (high - low) / (2.0 * found["value_n_per_m"]),
        found["verdict"] == ResultVerdict.IDENTIFIED,
        low <= truth <= high,
    )


def designed(out: Path, samples: int = 250) -> Design:
    """Design the plan and write it to `out`."""
    with open_pool(None, None) as pool:
        found = design(
            RIG, PAYLOAD, within_s=WITHIN_S, surface=SURFACE, samples=samples, seed=1, pool=pool
        )
    write(out, text_of(found, out, PAYLOAD, RIG, SURFACE, "stepload_verify.trials.designs"))
    return found


def line(name: str, duration_s: float, runs: Sequence[Pressed]) -> str:
    """What came of the runs of a plan."""
    known = [each for each in runs if each.identified]
    half = statistics.median(each.half_width for each in runs)
    return (
        f"{name}: {duration_s:.0f} s, half width ±{half:.1%}, IDENTIFIED {len(known)} of "
        f"{len(runs)}, of which {sum(each.true for each in known)} hold the truth"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=int, nargs="?", default=10, help="dry runs of each plan")
    runs = parser.parse_args().runs
    false = 0
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "designed.yaml"
        chosen = designed(file).chosen
        print(f"designed: {chosen.candidate.text}; predicted: {chosen.text}")
        for name, plan in (("designed", file), ("50 N steps", plan_path("plastic-sphere"))):
            found = for_each(partial(pressed, plan_file=plan), range(1, runs + 1))
            print(line(name, envelope_of(load_plan(plan)).duration_s, found), flush=True)
            false += sum(each.identified and not each.true for each in found)
    sys.exit(f"{false} runs are IDENTIFIED and false" if false > 0.1 * runs else 0)


if __name__ == "__main__":
    main()
