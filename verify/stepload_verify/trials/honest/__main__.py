"""Run the bench of honest answers.

    python bench/coverage.py --runs 1000 --seed 1              the mix: half ideal, half spoiled
    python bench/coverage.py --runs 1000 --seed 1 --held-out   worlds kept from tuning
    python bench/coverage.py --world creep --runs 200 --seed 1 one world
    python bench/coverage.py --world creep --seed 1000017      one case in detail
    python bench/coverage.py --dynamic --runs 300 --seed 1     pressed by the engine, from a record

Exit code 1 where less is true than must be.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from stepload_verify.trials.dynamic import press as dynamic
from stepload_verify.trials.dynamic import worlds as dynamic_worlds
from stepload_verify.trials.each import for_each
from stepload_verify.trials.honest.answer import QUANTITIES, Outcome, evidence, judged
from stepload_verify.trials.honest.held_out import HELD_OUT, HELD_OUT_IDEAL
from stepload_verify.trials.honest.score import report, verdict
from stepload_verify.trials.honest.worlds import IDEAL, KNOWN, SPOILED, World, make

ALL: dict[str, World] = {**KNOWN, **{n: w for n, (w, _) in HELD_OUT_IDEAL.items()}, **HELD_OUT}
A_SEED = 1_000_000
"""Case seeds of one bench seed: this many times it, and counting."""
DYNAMIC = dict.fromkeys(dynamic_worlds.IDEAL, 1.0), list(dynamic_worlds.SPOILED)
TUNED = {name: share for name, (_, share) in IDEAL.items()}, list(SPOILED)
KEPT = {name: share for name, (_, share) in HELD_OUT_IDEAL.items()}, list(HELD_OUT)


def mix(
    runs: int, seed: int, ideal: Mapping[str, float], spoiled: Sequence[str]
) -> Iterator[tuple[str, int]]:
    """Worlds and seeds of a bench: ideal by their shares and spoiled in turns, these evenly."""
    rng = np.random.default_rng(seed)
    names, shares = list(ideal), np.array(list(ideal.values()))
    order: list[str] = []
    for i in range(runs):
        if i % 2 == 0:
            world = names[int(rng.choice(len(names), p=shares / shares.sum()))]
        else:
            if not order:
                order = [spoiled[j] for j in rng.permutation(len(spoiled))]
            world = order.pop()
        yield world, seed * A_SEED + i


def one(case: tuple[str, int]) -> Outcome:
    """The outcome of a world and a seed."""
    return judged(make(ALL, *case))


def quickly(case: tuple[str, int]) -> Outcome:
    """The outcome of a world and a seed, without the paper's fits."""
    return judged(make(ALL, *case), evidence)


def dynamically(case: tuple[str, int]) -> Outcome:
    """The outcome of a world and a seed that the engine presses."""
    return dynamic.judged(*case)


def dynamically_quick(case: tuple[str, int]) -> Outcome:
    """The outcome of a case that the engine presses, without the paper's fits."""
    return dynamic.judged(*case, quick=True)


def show(world: str, seed: int) -> None:
    """One case in detail."""
    case = make(ALL, world, seed)
    print(f"{case.rig}\n{case.procedure}")
    print(f"gain {case.faults.gain:+.4f}, lag {case.faults.lag_s:.4f} s, {case.declared}")
    _show(judged(case))


def show_dynamic(world: str, seed: int) -> None:
    """One case in detail that the engine presses; its plan and record are kept."""
    directory = Path(tempfile.mkdtemp(prefix=f"{world}-{seed}-"))
    outcome = dynamic.judged(world, seed, keep=directory)
    print(f"{directory}: peak {outcome.peak:.3f} F_c {outcome.stop}")
    _show(outcome)


def _show(outcome: Outcome) -> None:
    """Print the answers."""
    print(f"{outcome.world} {outcome.seed}: {outcome.family}, {outcome.story or 'nothing added'}")
    if outcome.problem:
        print(f"{'BROKEN' if outcome.broken else 'refused'}: {outcome.problem}")
    for each in outcome.scored:
        said = each.answer
        print(
            f"{each.quantity}: {said.value_n_per_m:.5g} [{said.low_n_per_m:.5g}, "
            f"{said.high_n_per_m:.5g}] N/m, {said.from_n:.4g} -> {said.to_n:.4g} N, "
            f"{said.verdict}; true {each.truth_n_per_m}, {100 * each.off:+.2f} %, "
            f"{'holds' if each.true else 'DOES NOT HOLD'}"
        )
        for reason in said.why:
            print(f"    {reason}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry of the command."""
    parser = argparse.ArgumentParser(description="Must an answer called IDENTIFIED be true?")
    parser.add_argument("--runs", type=int, help="how many; without it and with --world: one case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--world")
    parser.add_argument("--held-out", action="store_true", help="worlds kept from tuning")
    parser.add_argument("--dynamic", action="store_true", help="pressed by the whole engine")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="without the paper's fits")
    parser.add_argument("--json", type=Path, help="write every outcome there")
    told = parser.parse_args(arguments)
    known = dynamic_worlds.ALL if told.dynamic else ALL
    if told.world and told.world not in known:
        parser.error(f"--world is one of {', '.join(sorted(known))}")
    if told.world and told.runs is None:
        (show_dynamic if told.dynamic else show)(told.world, told.seed)
        return 0
    runs = told.runs or 1000
    worlds = DYNAMIC if told.dynamic else KEPT if told.held_out else TUNED
    cases = list(mix(runs, told.seed, *worlds))
    if told.world:
        cases = [(told.world, told.seed * A_SEED + i) for i in range(runs)]
    ask = quickly if told.quick else one
    if told.dynamic:
        ask = dynamically_quick if told.quick else dynamically
    start_s = time.perf_counter()
    outcomes = for_each(ask, cases, told.processes)
    took_s = time.perf_counter() - start_s
    print(f"{runs} runs, seed {told.seed}, {1e3 * took_s / runs:.0f} ms a run")
    print(report(outcomes))
    if told.json:
        told.json.write_text(json.dumps([asdict(each) for each in outcomes]))
    stated = {each.quantity for outcome in outcomes for each in outcome.scored}
    wanted = [name for name in QUANTITIES[:2] if name in stated]
    met = bool(wanted) and all(verdict(outcomes, name).met for name in wanted)
    return 0 if met or told.world else 1


if __name__ == "__main__":
    sys.exit(main())
