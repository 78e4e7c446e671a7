"""Slip events: jumps of the lateral force that no change of the load explains.

The lateral force follows the load with the running ratio r of the two. Its deviation from that over
40 ms is compared with the noise and with a share of the load (six axes, item 5)::

    |ΔF_across - r ΔF| > max(6 σ √(2/k), 1 % of F)        means over k samples, 8 ms

three samples in a row at 500 Hz. A contact that slides smoothly makes no such jump: it shows in its
lateral share.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stepload.estimators.wrench import Wrench

MEAN_S, COMPARED_S, LASTS_S = 0.008, 0.04, 0.006
RATIO_S = 0.3
"""Time before a sample over which the ratio r is taken."""
SIGMAS, SHARE = 6.0, 0.01
LEAST_SHARE = 0.02
"""Below this share of the top force slips are not looked for: a touch is no slip."""
STEADY = 0.5
"""Largest change just before and after a jump, as a part of the jump."""


@dataclass(frozen=True, slots=True)
class Slip:
    """One slip event: its time, the axial force, and the jump of the lateral force.

    `seen_s` is the time at which the samples up to then suffice to detect it.
    """

    time_s: float
    force_n: float
    jump_n: float
    cycle: int
    rising: bool
    seen_s: float


@dataclass(frozen=True, slots=True)
class _Windows:
    """Lengths in samples: of a mean, of the comparison, of a row, of the ratio."""

    mean: int
    apart: int
    row: int
    ratio: int


def _windows(period_s: float) -> _Windows:
    mean = max(round(MEAN_S / period_s), 1)
    return _Windows(
        mean, max(round(COMPARED_S / period_s), 2 * mean, 2), max(round(LASTS_S / period_s), 1),
        max(round(RATIO_S / period_s), 4),
    )  # fmt: skip


def smallest_seen_n(noise_n: float, period_s: float, force_n: float) -> float:
    """The smallest jump in N that is certain to be detected at an axial force."""
    own = noise_n * math.sqrt(2.0 / _windows(period_s).mean)
    return max(SIGMAS * own, SHARE * force_n) + 2.0 * own


def slips_of(wrench: Wrench, top_n: float) -> tuple[Slip, ...]:
    """Every slip event, in the order of time.

    Evaluated branch by branch: where the load reverses, friction does too, without a jump.

    Args:
        wrench: samples in contact, finite.
        top_n: the largest force of the run in N.
    """
    found: list[Slip] = []
    steps_s = np.diff(wrench.time_s)
    usual_s = float(np.median(steps_s)) if steps_s.size else 0.0
    if not usual_s > 0.0:
        return ()
    new = (np.diff(wrench.cycle) != 0) | (np.diff(wrench.rising.view(np.int8)) != 0)
    new |= steps_s > 10.0 * usual_s
    edges = [0, *(np.flatnonzero(new) + 1).tolist(), wrench.time_s.size]
    windows = _windows(usual_s)
    for begin, end in pairwise(edges):
        found += _in_branch(wrench, slice(begin, end), windows, LEAST_SHARE * top_n)
    return tuple(found)


def _in_branch(wrench: Wrench, part: slice, w: _Windows, least_n: float) -> Iterator[Slip]:
    time_s, force_n = wrench.time_s[part], wrench.force_n[part]
    last = force_n.size - w.mean - w.apart
    if last < w.row:
        return
    columns = np.column_stack([force_n, wrench.across_n[part]])
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(columns, axis=0)])
    means = (sums[w.mean :] - sums[: -w.mean]) / w.mean
    change = means[w.apart :] - means[: -w.apart]
    begins = np.maximum(np.arange(change.shape[0]) + w.mean - w.ratio, 0)
    before = sums[w.mean : w.mean + change.shape[0]] - sums[begins]
    load_n = means[w.apart :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(before[:, :1] > 0.0, before[:, 1:] / before[:, :1], 0.0)
    left = change[:, 1:] - ratio * change[:, :1]
    size = np.hypot(left[:, 0], left[:, 1])
    noise = wrench.noise_n * np.sqrt(2.0 / w.mean) * np.hypot(1.0, np.hypot(*ratio.T))
    allowed = np.maximum(SIGMAS * noise, SHARE * load_n)
    over = (size > allowed) & (load_n > least_n) & (means[: -w.apart, 0] > least_n)
    for begin, end in _rows_of(over, w.row):
        peak = begin + int(np.argmax(size[begin:end]))
        sides = left[max(peak - w.apart, 0)], left[min(peak + w.apart, size.size - 1)]
        beside = max(float(np.hypot(*each)) for each in sides)
        if beside > STEADY * size[peak]:
            continue  # it continues: a slide or a corner of the ramp, no jump
        quarter = (end - begin) // 4
        inner = left[begin + quarter : end - quarter].mean(axis=0)
        jump = float(np.hypot(*(inner - 0.5 * (sides[0] + sides[1]))))
        middle = peak + (w.mean + w.apart) // 2
        seen = begin + w.row - 1 + w.apart + w.mean - 1
        yield Slip(
            float(time_s[middle]), float(load_n[peak]), jump, int(wrench.cycle[part][0]),
            bool(wrench.rising[part][0]), float(time_s[seen]),
        )  # fmt: skip


def _rows_of(over: np.ndarray, least: int) -> Iterator[tuple[int, int]]:
    """Begin and end of every run of at least this many true values."""
    steps = np.flatnonzero(np.diff(over.view(np.int8), prepend=0, append=0))
    for begin, end in zip(steps[::2].tolist(), steps[1::2].tolist(), strict=True):
        if end - begin >= least:
            yield begin, end
