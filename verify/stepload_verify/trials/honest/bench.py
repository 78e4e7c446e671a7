"""Run the bench of honest answers: half of the runs are ideal, half spoiled.

    python bench/coverage.py --runs 1000 --seed 1
    python bench/coverage.py --runs 1000 --seed 1 --world creep

Exit code 1 where less is true than must be.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from stepload_verify.trials.honest.answer import QUANTITIES, answer, evidence, judged
from stepload_verify.trials.honest.score import report, verdict
from stepload_verify.trials.honest.worlds import IDEAL, KNOWN, SPOILED, make

A_SEED = 1_000_000
"""Case seeds of one bench seed: this many times it, and counting."""


def mix(runs: int, seed: int) -> Iterator[tuple[str, int]]:
    """Worlds and seeds of a bench: ideal by their shares and spoiled in turns, these evenly."""
    rng = np.random.default_rng(seed)
    names, shares = list(IDEAL), np.array([share for _, share in IDEAL.values()])
    spoiled, order = list(SPOILED), list[str]()
    for i in range(runs):
        if i % 2 == 0:
            world = names[int(rng.choice(len(names), p=shares / shares.sum()))]
        else:
            if not order:
                order = [spoiled[j] for j in rng.permutation(len(spoiled))]
            world = order.pop()
        yield world, seed * A_SEED + i


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry of the command."""
    parser = argparse.ArgumentParser(description="Must an answer called IDENTIFIED be true?")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--world", choices=sorted(KNOWN))
    parser.add_argument("--quick", action="store_true", help="without the paper's fits")
    parser.add_argument("--json", type=Path, help="write every outcome there")
    told = parser.parse_args(arguments)
    cases = list(mix(told.runs, told.seed))
    if told.world:
        cases = [(told.world, told.seed * A_SEED + i) for i in range(told.runs)]
    ask = evidence if told.quick else answer
    outcomes = [judged(make(KNOWN, *case), ask) for case in cases]
    print(report(outcomes))
    if told.json:
        told.json.write_text(json.dumps([asdict(each) for each in outcomes]))
    stated = {each.quantity for outcome in outcomes for each in outcome.scored}
    wanted = [name for name in QUANTITIES[:2] if name in stated]
    met = bool(wanted) and all(verdict(outcomes, name).met for name in wanted)
    return 0 if met or told.world else 1
