"""Are the intervals true, and how narrow are they? Drawn worlds with errors as a plan states them.

    python bench/sharpness.py --runs 300

Each run presses a payload quasi-static: those of two plans by their theory, then bodies whose
curves are of boundary elements. K_s, its table, the smooth error, the gain and the linearity are
drawn from what the plan states, noise and quanta too. A row tells how often the interval of a
figure held its truth, how often it was identified and true, and its half width over 1.96 times the
rms error.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from stepload_verify.trials.boundary.curves import contacts
from stepload_verify.trials.sharp import (
    Row,
    World,
    of_contacts,
    of_plan,
    score,
    stated,
    table,
    unstated,
)

HOME = Path(__file__).parents[1]
PLANS = ("procedures/plastic-sphere.yaml", "bench/sharp/ur5e-silicone.yaml")


def shown(found: Mapping[str, list[Row]]) -> Iterator[str]:
    """A line for each figure."""
    for kind, each in found.items():
        told = score(each)
        half = f"±{told.half:.3f}" if kind == "n" else f"{told.half:.2%}"
        yield (
            f"  {kind:18} {told.held:5.3f} {told.identified:11.2f} {told.true:14.3f}"
            f" {half:>11} {told.ratio:14.2f}"
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Are the intervals true, and how narrow?")
    parser.add_argument("plans", nargs="*", type=Path, default=[HOME / each for each in PLANS])
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unstated", action="store_true", help="K_s and its σ alone are stated")
    told = parser.parse_args()
    bodies = of_contacts(HOME / PLANS[0], list(contacts()))
    worlds: list[World] = [*map(of_plan, told.plans), *bodies]
    all_rows: dict[str, list[Row]] = {}
    print(f"{'figure':20} held  identified  true of those  half width  over 1.96 rms")
    start_s = time.perf_counter()
    for world in worlds:
        print(world.name, flush=True)
        found, refused = table(world, told.runs, told.seed, unstated if told.unstated else stated)
        if refused:
            print(f"  {refused} refused")
        for kind, each in found.items():
            all_rows.setdefault(kind, []).extend(each)
        print("\n".join(shown(found)), flush=True)
    print("all worlds")
    print("\n".join(shown(all_rows)))
    print(f"{(time.perf_counter() - start_s) / told.runs / len(worlds) * 1e3:.0f} ms a run")


if __name__ == "__main__":
    main()
