"""Does a designed plan do what its design says? Whole dry runs of it, beside the paper's steps.

python -m stepload_verify.trials.designs 40
python -m stepload_verify.trials.designs 20 PAYLOAD RIG --truth creep=0.01 --truth law=smooth

Without a payload the plan is designed for the paper's plastic sphere on its rig, in 3 min, and the
paper's 50 N steps are run beside it. Printed is what preflight reckons that a run takes, the half
width that is reported (median), how many runs are IDENTIFIED, how many of these lie within 1/t of
the truth and of how many the interval holds it. `--truth` changes a key of the simulated rig, with
the name and the unit of `Simulation`, in the runs and not in the design.
"""

from __future__ import annotations

import argparse
import math
import re
import statistics
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from stepload.design.make import Design, design
from stepload.design.written import text_of, write
from stepload.engine.first_loading import true_chord
from stepload.engine.rehearse import payload_truth
from stepload.envelope.envelope import envelope_of
from stepload.envelope.theory import theory_of
from stepload.estimators.judge import ResultVerdict
from stepload.plan.load import load_plan
from stepload.plan.shipped import payload_folder, plan_path
from stepload.runner.choose import open_pool
from stepload_verify.trials.each import for_each
from stepload_verify.trials.whole import dry_run

RIG, PAYLOAD = "stvf", payload_folder() / "plastic-sphere.yaml"
WITHIN_S, SURFACE = 180.0, "5 mm"
FIGURE = re.compile(r"[-+±]?\d[\d.,]*(?: ?[kµnM]?[NmKs%](?:/\w+)?)?")
Truth = tuple[tuple[str, str | float], ...]


@dataclass(frozen=True, slots=True)
class Pressed:
    """One dry run: half width, whether it says IDENTIFIED, and what is true of it.

    `right`: its headline lies within 1/t of the truth; `true`: its interval holds the truth.
    """

    half_width: float
    identified: bool
    right: bool
    true: bool
    peak_share: float
    status: str
    reasons: tuple[str, ...]


def pressed(seed: int, plan_file: Path, truth: Truth = ()) -> Pressed:
    """One whole dry run, from plan to result."""
    plan = load_plan(plan_file)
    simulation = replace(plan.rig.simulation, **dict(truth))  # type: ignore[arg-type]
    plan = replace(plan, rig=replace(plan.rig, simulation=simulation))
    data, peak_share = dry_run(plan, seed)
    found, reasons = data["headline"], tuple(data["reasons"])
    if not found or not found["interval_n_per_m"]:
        return Pressed(math.inf, False, False, False, peak_share, data["status"], reasons)
    true_n_per_m = true_chord(
        payload_truth(plan.payload, theory_of(plan.payload), simulation),
        found["from_n"],
        found["to_n"],
    )
    low, high = found["interval_n_per_m"]
    value = found["value_n_per_m"]
    return Pressed(
        (high - low) / (2.0 * value) if None not in (low, high) else math.inf,
        found["verdict"] == ResultVerdict.IDENTIFIED,
        abs(value / true_n_per_m - 1.0) <= 1.0 / plan.identify.accuracy_t,
        None not in (low, high) and low <= true_n_per_m <= high,
        peak_share,
        data["status"],
        reasons,
    )


def designed(
    out: Path,
    samples: int = 250,
    *,
    payload: Path = PAYLOAD,
    rig: str = RIG,
    within_s: float = WITHIN_S,
) -> Design:
    """Design the plan and write it to `out`."""
    with open_pool(None, None) as pool:
        found = design(
            rig, payload, within_s=within_s, surface=SURFACE, samples=samples, seed=1, pool=pool
        )
    write(out, text_of(found, out, payload, rig, SURFACE, "stepload_verify.trials.designs"))
    return found


def line(name: str, duration_s: float, runs: Sequence[Pressed]) -> str:
    """One line that sums up the runs of a plan."""
    known = [each for each in runs if each.identified]
    half = statistics.median(each.half_width for each in runs)
    return (
        f"{name}: {duration_s:.0f} s, half width ±{half:.1%}, IDENTIFIED {len(known)} of "
        f"{len(runs)}, of which {sum(each.right for each in known)} are right within 1/t and "
        f"{sum(each.true for each in known)} hold the truth; "
        f"{sum(each.status != 'completed' for each in runs)} were stopped; largest true force "
        f"{max(each.peak_share for each in runs):.3f} F_c"
    )


def why_not(runs: Sequence[Pressed]) -> list[str]:
    """The reasons of runs that are not IDENTIFIED, without figures, the most frequent first."""
    said = Counter(
        text
        for each in runs
        if not each.identified
        for text in {FIGURE.sub("…", reason) for reason in each.reasons}
    )
    return [f"    {count} × {reason}" for reason, count in said.most_common(4)]


def _truth(text: str) -> tuple[str, str | float]:
    key, _, value = text.partition("=")
    try:
        return key, float(value)
    except ValueError:
        return key, value


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=int, nargs="?", default=10, help="dry runs of each plan")
    parser.add_argument("payload", type=Path, nargs="?", default=PAYLOAD)
    parser.add_argument("rig", nargs="?", default=RIG)
    parser.add_argument("--within", type=float, default=WITHIN_S, help="seconds")
    parser.add_argument("--samples", type=int, default=250, help="simulated runs of each plan")
    parser.add_argument("--truth", type=_truth, action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--processes", type=int)
    given = parser.parse_args()
    runs, truth, false = given.runs, tuple(given.truth), 0
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "designed.yaml"
        chosen = designed(
            file, given.samples, payload=given.payload, rig=given.rig, within_s=given.within
        ).chosen
        print(f"designed: {chosen.candidate.text}; predicted: {chosen.text}", flush=True)
        plans = {"designed": file}
        if given.payload == PAYLOAD and given.rig == RIG:
            plans["50 N steps"] = plan_path("plastic-sphere")
        for name, plan in plans.items():
            do = partial(pressed, plan_file=plan, truth=truth)
            found = for_each(do, range(1, runs + 1), given.processes)
            print(line(name, envelope_of(load_plan(plan)).duration_s, found))
            print("\n".join(why_not(found)), flush=True)
            false += sum(each.identified and not each.true for each in found)
    sys.exit(f"{false} runs are IDENTIFIED and false" if false > 0.1 * runs else 0)


if __name__ == "__main__":
    main()
