"""How soon a slip is seen in the data, and how soon R12 sees a share across the axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stepload.engine.watch import Breach, ForceWatch
from stepload.engine.wrench import WrenchRules
from stepload.envelope.limits import RunLimits
from stepload.estimators.slips import Slip, slips_of
from stepload.estimators.wrench import Wrench
from stepload.rig.samples import ForceSample

RATE_HZ = 500.0
JUMPS_N, NOISES_N = (1.9, 0.5, 0.0), (0.03, 0.1, 0.3)
LASTS_S, TOP_N, SHARE = 10.0, 50.0, 0.15
NEAR_S = 0.06
"""A slip that is told so near to the true one is that."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Jumps of one size at one noise: how long after it each was seen; how many were not, and how
    many were seen that there were not. Sizes as told, in N."""

    jump_n: float
    noise_n: float
    latency_s: tuple[float, ...]
    sizes_n: tuple[float, ...]
    missed: int
    false: int


def slips_seen(runs: int, seed: int) -> Iterator[Seen]:
    """Ramps and holds up to 50 N in 10 s with one jump somewhere; none of 0 N."""
    for jump_n in JUMPS_N:
        for noise_n in NOISES_N:
            rng = np.random.default_rng([seed, round(10 * jump_n), round(100 * noise_n)])
            latency, sizes, missed, false = [], [], 0, 0
            for _ in range(runs):
                at_s, found = _with_jump(jump_n, noise_n, rng)
                hits = [slip for slip in found if abs(slip.time_s - at_s) < NEAR_S and jump_n > 0.0]
                false += len(found) - len(hits)
                missed += not hits
                latency += [slip.seen_s - at_s for slip in hits[:1]]
                sizes += [slip.jump_n for slip in hits[:1]]
            yield Seen(jump_n, noise_n, tuple(latency), tuple(sizes), missed, false)


def _with_jump(
    jump_n: float, noise_n: float, rng: np.random.Generator
) -> tuple[float, tuple[Slip, ...]]:
    time_s = np.arange(0.0, LASTS_S, 1.0 / RATE_HZ)
    force_n = np.interp(time_s, np.linspace(0.0, LASTS_S, 6), [5.0, 20.0, 20.0, 40.0, 40.0, TOP_N])
    at_s = float(rng.uniform(1.0, LASTS_S - 1.0))
    across_n = np.zeros((time_s.size, 2))
    across_n[:, 0] = SHARE * force_n * (1.0 - 0.1 * force_n / TOP_N) - jump_n * (time_s >= at_s)
    size = time_s.size
    wrench = Wrench(
        time_s, force_n + rng.normal(0.0, noise_n, size),
        across_n + rng.normal(0.0, noise_n, (size, 2)), np.ones(size, bool), np.ones(size, int),
        np.zeros(size, int), noise_n,
    )  # fmt: skip
    return at_s, slips_of(wrench, TOP_N)


def r12_latency_s(
    limits: RunLimits, share: float, along_n: float, noise_n: float, rng: np.random.Generator
) -> float:
    """From a share that is suddenly there to the breach of R12, one fresh sample in each period."""
    watch = ForceWatch("force", "+fz", full_scale_n=math.inf, stale_s=1.0, identical_counts=0,
                       clock_s=1.0)  # fmt: skip
    rules, period_s = WrenchRules(limits, Breach), limits.period_s
    for tick in range(4000):
        now_s, there = tick * period_s, tick >= 2000
        noise = rng.normal(0.0, noise_n, 3)
        across = (share if there else 0.0) * along_n
        wrench = (across + noise[0], noise[1], along_n + noise[2], 0.0, 0.0, 0.0)
        watch.take([ForceSample(tick, now_s, math.nan, 0, wrench, math.nan)], now_s)
        breach = rules.judge_across(watch.smooth_across_n, float(wrench[2]), along_n, along_n)
        if breach is not None:
            return math.nan if not there else (tick - 2000 + 1) * period_s
    return math.inf
