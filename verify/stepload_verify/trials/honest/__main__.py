"""Run the bench of honest answers.

    python bench/coverage.py --runs 1000 --seed 1              the mix: half ideal, half spoiled
    python bench/coverage.py --runs 1000 --seed 1 --held-out   worlds kept from tuning
    python bench/coverage.py --world creep --runs 200 --seed 1 one world
    python bench/coverage.py --world creep --seed 1000017      one case in detail

Exit code 1 where less is true than must be.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

import numpy as np

from stepload.evidence.answer import weigh
from stepload.results.pressed import pressed
from stepload_verify.trials.honest.answer import QUANTITIES, Outcome, evidence, judged
from stepload_verify.trials.honest.case import Case
from stepload_verify.trials.honest.held_out import HELD_OUT, HELD_OUT_IDEAL
from stepload_verify.trials.honest.measure import record
from stepload_verify.trials.honest.score import report, verdict
from stepload_verify.trials.honest.worlds import IDEAL, KNOWN, SPOILED, World, make

ALL: dict[str, World] = {**KNOWN, **{n: w for n, (w, _) in HELD_OUT_IDEAL.items()}, **HELD_OUT}
A_SEED = 1_000_000
"""Case seeds of one bench seed: this many times it, and counting."""


def mix(runs: int, seed: int, held_out: bool) -> Iterator[tuple[str, int]]:
    """Worlds and seeds of a bench: ideal and spoiled in turns, the spoiled worlds evenly."""
    ideal = HELD_OUT_IDEAL if held_out else IDEAL
    spoiled = list(HELD_OUT if held_out else SPOILED)
    rng = np.random.default_rng(seed)
    names, shares = list(ideal), np.array([share for _, share in ideal.values()])
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
    """The same from the evidence alone."""
    return judged(make(ALL, *case), evidence)


def show(world: str, seed: int) -> None:
    """One case in detail."""
    case = make(ALL, world, seed)
    outcome = judged(case)
    print(f"{world} {seed}: {case.story or 'nothing added'}\n{case.rig}\n{case.procedure}")
    print(f"gain {case.faults.gain:+.4f}, lag {case.faults.lag_s:.4f} s, {case.declared}")
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
    if outcome.scored:
        _show_gates(case)


def _show_gates(case: Case) -> None:
    for gate in weigh(pressed(*record(case))).gates:
        fires = "fires" if gate.fires else ""
        size = 1.0 / case.rig.depth_m if gate.unit == "m" else 1.0
        print(
            f"  gate {gate.name:14s} {size * gate.value:.5f} of {size * gate.threshold:.5f} {fires}"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry of the command."""
    parser = argparse.ArgumentParser(description="Must an answer called IDENTIFIED be true?")
    parser.add_argument("--runs", type=int, help="how many; without it and with --world: one case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--world", choices=sorted(ALL))
    parser.add_argument("--held-out", action="store_true", help="worlds kept from tuning")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="without the paper's fits")
    parser.add_argument("--json", type=Path, help="write every outcome there")
    told = parser.parse_args(arguments)
    if told.world and told.runs is None:
        show(told.world, told.seed)
        return 0
    runs = told.runs or 1000
    cases = list(mix(runs, told.seed, told.held_out))
    if told.world:
        cases = [(told.world, told.seed * A_SEED + i) for i in range(runs)]
    ask = quickly if told.quick else one
    start_s = time.perf_counter()
    if told.processes > 1:
        with ProcessPoolExecutor(told.processes) as pool:
            outcomes = list(pool.map(ask, cases, chunksize=16))
    else:
        outcomes = [ask(case) for case in cases]
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
