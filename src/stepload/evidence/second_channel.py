"""A second force channel against the first: the slope of one over the other tells their gains.

Both felt the same contact. A slope further from 1 than both channels state refuses every figure:
one of the two gains is wrong, and the record does not say which.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import NORMAL_95
from stepload.evidence.loops import Track, path_of
from stepload.evidence.run_data import RunData
from stepload.units import percent

LEAST_PLACES = 4
"""Places of different force that a slope needs at least."""


def against_second(run: RunData) -> tuple[list[str], list[str]]:
    """A doubt that blocks every figure where the channels' gains differ, and a remark.

    Both are empty without a second channel of which the rig states how far it may differ.
    """
    share, sources = run.conditions.second_share, run.conditions.sources
    if share is None:
        return [], []
    found = _slope(run)
    if found is None:
        return [], []
    off, sigma = found[0] - 1.0, found[1]
    allowed = share + NORMAL_95 * math.hypot(sources.gain_sigma, sources.nonlinearity, sigma)
    most = percent(allowed, 2)
    said = f"the second force channel changes by {percent(abs(off), 2)} "
    said += f"{'less' if off < 0.0 else 'more'} than the first"
    if abs(off) > allowed:
        said += f" (allowed {most}): one of the two gains is wrong; load both with a known weight"
        return [said], []
    return [], [f"{said} (± {percent(NORMAL_95 * sigma, 2)}; from {most} on it refuses)"]


def _slope(run: RunData) -> tuple[float, float] | None:
    """Slope of the second channel over the first and its standard uncertainty; None without.

    Least squares over the means of all stretches, an own zero for each cycle. What scatters about
    the line (friction of an arm's own force, which turns round with the motion) is the uncertainty.
    """
    blocks = [np.concatenate(each, axis=1) for each in _cycles(run)]
    places = sum(block.shape[1] for block in blocks)
    if places < LEAST_PLACES + len(blocks):
        return None
    centred = [_centred(block) for block in blocks]
    first, second, count = np.concatenate(centred, axis=1)
    square = float(count @ first**2)
    if not square > 0.0:
        return None
    slope = float(count @ (first * second)) / square
    rest = second - slope * first
    variance = float(count @ rest**2) / (places - len(blocks) - 1)
    return slope, math.sqrt(variance / square)


def _cycles(run: RunData) -> Iterator[list[FloatArray]]:
    """Per cycle (3, B) of its branches: first channel, second channel, weight of each stretch."""
    top_n = max(float(loading.force_n.max()) for _, loading, _ in run.tracks)
    noise_n = run.conditions.sources.force_noise_n
    for _, loading, unloading in run.tracks:
        blocks = [_means(track, top_n, noise_n) for track in (loading, unloading) if track]
        if made := [block for block in blocks if block is not None]:
            yield made


def _means(track: Track, top_n: float, noise_n: float) -> FloatArray | None:
    if track.second_n is None:
        return None
    known = np.isfinite(track.second_n)
    if known.sum() < 2:
        return None
    kept = {name: getattr(track, name)[known] for name in ("time_s", "force_n", "held")}
    path = path_of(Track(travel_m=track.second_n[known], **kept), top_n, noise_n)
    # A long hold is one place, not many: what does not scatter in it is common to all its samples.
    weight = np.minimum(path.count, float(np.median(path.count)))
    return np.stack([path.force_n, path.travel_m, weight])


def _centred(block: FloatArray) -> FloatArray:
    first, second, count = block
    return np.stack([
        first - np.average(first, weights=count), second - np.average(second, weights=count), count
    ])  # fmt: skip
