"""Coverage of the difference of two groups of runs on one arm that friction stiffens.

    python -m stepload_verify.trials.coupling.compared [--poses 30] [--seed 1]

In each pose the arm is calibrated once, dry and greased. Then one payload is pressed three times
with one friction, and a payload of the same law, or one that is 10 % stiffer, three times with the
same friction or another one. `stepload compare` reads them in three ways, see `coupling`: by a
force sensor that tells nothing across, with one number and with three. Counted is how often the
95 % interval of the difference holds the true one, and how often DIFFER is said where nothing is.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stepload.errors import SteploadError
from stepload.estimators.conditions import Conditions
from stepload.estimators.lateral_effect import Across
from stepload.evidence.difference import Agreement
from stepload.results.calibration import from_system_runs
from stepload.results.comparison import compare
from stepload.results.press_data import PressData
from stepload.results.run_record import SavedRun
from stepload_verify.trials.coupling.__main__ import (
    BLOCK_N_PER_M,
    DRY,
    GREASED,
    SETTINGS,
    Setting,
)
from stepload_verify.trials.coupling.measure import Bench, conditions, pressed, read, saved
from stepload_verify.trials.coupling.world import Contact

REPEATS = 3
UPRIGHT = np.array([0.0, 0.0, 1.0])
WAYS = ("one axis", "one", "three")


@dataclass(frozen=True, slots=True)
class Pair:
    """Frictions of both groups, and how much stiffer the second payload is."""

    says: str
    first: float
    second: float
    ratio: float = 1.0


PAIRS = (
    Pair("equal, both slide", 0.1, 0.1),
    Pair("equal, slides and sticks", 0.1, 0.6),
    Pair("equal, two dry contacts", 0.3, 0.5),
    Pair("10 % stiffer, slides and sticks", 0.1, 0.6, 1.1),
)


@dataclass(frozen=True, slots=True)
class Said:
    """One comparison: whether the interval holds the truth, its half width, and the verdict."""

    covered: bool
    half_width: float
    verdict: Agreement


def _law(setting: Setting, ratio: float, mu: float) -> Contact:
    k = (setting.secant_n_per_m * ratio) ** 1.5 / setting.top_n**0.5
    return Contact(k, 1.5, mu, UPRIGHT)


def compared(setting: Setting, pair: Pair, rng: np.random.Generator) -> dict[str, Said | None]:
    """One arm in one pose: calibrated, two groups pressed, and compared in every way."""
    bench = setting.bench(np.radians(1.0), rng)
    frictions = rng.uniform(*DRY), rng.uniform(*GREASED)
    blocks = [
        saved(bench, Contact(BLOCK_N_PER_M, 1.0, mu, UPRIGHT), number, rng)
        for number, mu in enumerate((*frictions, *frictions))
    ]
    one_way = conditions(bench, from_system_runs(blocks[::2]).record)
    one_way = replace(one_way, across=Across(at_share=one_way.across.at_share))
    three = conditions(bench, from_system_runs(blocks).record)
    laws = [_law(setting, 1.0, pair.first)] * REPEATS
    laws += [_law(setting, pair.ratio, pair.second)] * REPEATS
    data = [pressed(bench, law, rng) for law in laws]
    silent = [replace(each, across_n=None) for each in data]
    given: dict[str, tuple[Sequence[PressData], Conditions]] = {
        "one axis": (silent, one_way), "one": (data, one_way), "three": (data, three),
    }  # fmt: skip
    return {way: _said(_runs(bench, *given[way]), pair.ratio) for way in WAYS}


def _runs(bench: Bench, data: Sequence[PressData], told: Conditions) -> list[SavedRun]:
    """The runs as their records would give them."""
    metadata = {
        "rig": "trial", "arm": "arm: A 1, firmware 1", "force_axis": "+fz",
        "force_sensor": "cell: S 1, firmware 1, calibration none", "calibration": "sha256 1",
    }  # fmt: skip
    runs = []
    for number, each in enumerate(data):
        taken, known = read(each, told)
        own = metadata | {"run_id": f"r{number}"}
        runs.append(SavedRun(Path(f"r{number}.mcap"), taken, known, own, partial=False))
    return runs


def _said(runs: Sequence[SavedRun], ratio: float) -> Said | None:
    try:
        found = compare(runs, sizes=(REPEATS, REPEATS), tolerance=0.2).differences
    except SteploadError:
        return None
    if not found:
        return None
    low, high = found[0].interval
    return Said(low <= ratio - 1.0 <= high, found[0].half_width, found[0].verdict)


def _line(way: str, results: Sequence[Said | None], count: Callable[[Agreement], int]) -> str:
    got = [each for each in results if each is not None]
    if not got:
        return f"{way:9} nothing"
    half = 100.0 * float(np.median([each.half_width for each in got]))
    words = ", ".join(f"{word.value} {count(word)}" for word in Agreement)
    true = sum(each.covered for each in got)
    return f"{way:9} holds the truth {true} of {len(got)}, ± {half:.1f} %: {words}"


def main() -> None:
    """Print how often the interval holds the truth, for every arm, pair and way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    for place, setting in enumerate(SETTINGS[:2]):
        for number, pair in enumerate(PAIRS):
            rng = np.random.default_rng([asked.seed, place, number])
            all_said = [compared(setting, pair, rng) for _ in range(asked.poses)]
            print(f"{setting.arm} {setting.secant_n_per_m:.0e} N/m, {pair.says}", flush=True)
            for way in WAYS:
                results = [each[way] for each in all_said]

                def count(word: Agreement, results: Sequence[Said | None] = results) -> int:
                    return sum(each is not None and each.verdict is word for each in results)

                print("   ", _line(way, results, count), flush=True)


if __name__ == "__main__":
    main()
