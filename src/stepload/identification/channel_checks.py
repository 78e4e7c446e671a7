"""A gauge across the contact against the arm that pressed: both moved, and the record holds both.

Between two forces the gauge must change by what the arm travels less what the system gives way.
A gauge at the end of its range, or with a wrong scale, does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stepload.identification.chord import Chord
from stepload.identification.conditions import Conditions, linearity_errors
from stepload.identification.fit import FloatArray
from stepload.identification.lateral import GUIDED_COMPLIANCE, TURN_RAD_PER_N, UNKNOWN_FRICTION
from stepload.identification.loops import Path, Track, path_of
from stepload.identification.run_data import RunData
from stepload.identification.smooth import NORMAL_95, few_degrees
from stepload.units import beside_limit, format_quantity, percent

SIGMAS = 3.0
HARMLESS_SCALE = 0.02
"""Differences below this share of the deformation do not veto."""
USELESS = 0.5
"""Beyond this share of the deformation the arm's side says nothing of the gauge."""
STOPS = 3.0
"""A gauge that stands would have changed by more than this multiple of what counts as standing."""
FEW = 10
"""Samples of the force over which noise is taken out where a gauge begins to stand."""
LEAST_BELOW = 0.2
"""Least force below a standing gauge, as a share of that over which it stands."""
DELAY_S = 0.02
"""How late the arm may be behind the force because its load path is damped (1 σ)."""
NOT_CHECKED = "the gauge's scale was not checked against the arm's travel: "


def against_arm(run: RunData, main: Chord) -> tuple[list[str], list[str]]:
    """Doubts about the gauge over the first loading, and remarks, by the chord `main`.

    Both are empty where no gauge was read beside an arm, and where the system is what is pressed.
    """
    track, told = run.tracks[0][1], run.conditions
    if track.arm_m is None or told.kind == "system":
        return [], []
    if told.arm_sources is None:
        return [], [NOT_CHECKED + "the record does not say how far the system gives way"]
    top_n = max(float(loading.force_n.max()) for _, loading, _ in run.tracks)
    noise_n = told.sources.force_noise_n
    # The stretches follow from force and holds, so both paths have the same ones.
    gauge = path_of(track, top_n, noise_n)
    arm = path_of(replace(track, travel_m=track.arm_m), top_n, noise_n)
    weights = np.zeros(gauge.size)
    weights[gauge.force_n > 0.0] = main.weights
    side = _Sides(run, replace(told, sources=told.arm_sources), gauge, arm)
    doubts = side.standing()
    said_m, moved_m, sigma_m = side.compared(weights, main.from_n, main.to_n)
    allowed_m = max(SIGMAS * sigma_m, HARMLESS_SCALE * abs(moved_m))
    share = allowed_m / abs(moved_m) if moved_m else math.inf
    if not share <= USELESS:
        beside = f"{format_quantity(allowed_m, 'm')} beside {format_quantity(moved_m, 'm')}"
        why = f"what the arm says of the deformation is too uncertain ({beside})"
        return doubts, [NOT_CHECKED + why]
    off_m = abs(said_m - moved_m)
    if off_m > allowed_m:
        off, most = beside_limit(off_m, allowed_m, "m")
        doubts.append(
            f"from {format_quantity(main.from_n, 'N')} to {format_quantity(main.to_n, 'N')} the"
            f" gauge changes by {format_quantity(said_m, 'm')}, the arm's travel less the system's"
            f" deflection by {format_quantity(moved_m, 'm')}: {off} apart (allowed {most}); the"
            " gauge is at the end of its range or has a wrong scale, or K_s is not that of this run"
        )
    return doubts, [
        "the gauge's scale was checked against the arm's travel less the system's deflection: an "
        f"error below {percent(share, 2)} would not be seen"
    ]


class _Sides:
    """What both sides say between two places of the first loading."""

    def __init__(self, run: RunData, told: Conditions, gauge: Path, arm: Path) -> None:
        """`told` are the conditions with the sources of the arm's travel."""
        self._run, self._told = run, told
        self._gauge, self._arm = gauge, arm

    def compared(
        self, weights: FloatArray, from_n: float, to_n: float
    ) -> tuple[float, float, float]:
        """Change of the gauge, the same by the arm, and their combined standard uncertainty, in m.

        Args:
            weights: (B,) of the path; their sum is 0.
        """
        told, sources, own = self._told, self._told.sources, self._run.conditions.sources
        bend = told.bend(self._gauge.force_n)
        moved_m = float(weights @ (self._arm.travel_m - bend))
        at = np.array([from_n, to_n])
        bent_m = abs(float(np.diff(told.bend(at))[0]))
        share = self._run.lateral_force.share or 0.0
        aside = UNKNOWN_FRICTION if told.arm else GUIDED_COMPLIANCE * share
        quantum_m = math.hypot(sources.position_resolution_m, own.position_resolution_m)
        noise_m = math.hypot(sources.position_noise_m, own.position_noise_m)
        per_n = bent_m / abs(to_n - from_n) if to_n != from_n else 0.0
        late_m = float(weights @ self._gauge.rate_n_per_s) * per_n * max(DELAY_S, own.lag_sigma_s)
        sigma_m = math.hypot(
            *np.diff(told.bend_sigma(at)),
            *told.table_sigma(at),
            math.sqrt(2.0) * sources.smooth_error_m * few_degrees(sources.smooth_degrees),
            aside * bent_m,
            *np.diff(told.uncovered_sigma(at)),
            *(per_n * linearity_errors(self._gauge.force_n, sources.nonlinearity) @ weights),
            sources.gain_sigma * bent_m,
            own.force_noise_n * per_n * math.sqrt(float(weights**2 @ (1.0 / self._gauge.count))),
            quantum_m / math.sqrt(6.0),
            noise_m * math.sqrt(float(weights**2 @ (1.0 / self._gauge.count))),
            late_m,
            0.5 * (self._run.zero_step_n or 0.0) * per_n,
            sources.temperature_sigma_k * sources.position_m_per_k,
            (self._run.arm_drift_m_per_s or 0.0) * float(weights @ self._gauge.time_s),
            told.gauge_offset_m * TURN_RAD_PER_N * (to_n - from_n),
        )
        return float(weights @ self._gauge.travel_m), moved_m, sigma_m

    def standing(self) -> list[str]:
        """The doubt that a gauge stands up to the top; empty where it moves to its end.

        Such a gauge is at the end of its range if the arm goes on, or if it moved on at a pace just
        below, unless the arm says that the payload has come to a stop.
        """
        own, path, track = self._run.conditions.sources, self._gauge, self._run.tracks[0][1]
        top = int(np.argmax(path.force_n))
        still_m = own.position_resolution_m + SIGMAS * math.sqrt(2.0) * own.position_noise_m
        before_top = track.time_s < path.time_s[top]
        away = before_top & (np.abs(track.travel_m - path.travel_m[top]) > still_m)
        first = int(np.flatnonzero(away)[-1]) + 1 if away.any() else 0
        begun_s, some = float(track.time_s[first]), slice(first, first + FEW)
        from_n, to_n = float(track.force_n[some].mean()), float(path.force_n[top])
        noise_n = own.force_noise_n * math.hypot(FEW**-0.5, path.count[top] ** -0.5)
        if to_n - from_n <= SIGMAS * noise_n + own.force_resolution_n:
            return []
        begin = min(int(np.searchsorted(path.time_s, begun_s)), top)
        weights = np.zeros(path.size)
        weights[top] += 1.0
        weights[begin] -= 1.0
        part_n = float(path.force_n[begin])
        _, moved_m, sigma_m = self.compared(weights, part_n, to_n)
        between = f"from {format_quantity(from_n, 'N')} to {format_quantity(to_n, 'N')}"
        at_end = "the gauge has come to the end of its range"
        if moved_m > still_m + SIGMAS * sigma_m:
            size = format_quantity(moved_m, "m")
            return [f"{between} the gauge stands, while the payload gives way by {size}: {at_end}"]
        pace = self._pace_m_per_n(begin - 1, to_n - from_n)
        missed_m = pace * (to_n - from_n)
        stopped = moved_m + SIGMAS * sigma_m < 0.5 * pace * (to_n - part_n)
        if stopped or missed_m <= STOPS * still_m:
            return []
        size = format_quantity(missed_m, "m")
        return [
            f"{between} the gauge stands; at its pace below it would change by {size}: {at_end}"
        ]

    def _pace_m_per_n(self, begin: int, reach_n: float) -> float:
        """How the gauge changes over the force just below a place; 0 where too little is below."""
        path = self._gauge
        if begin < 1:
            return 0.0
        below = np.flatnonzero(path.force_n[:begin] <= path.force_n[begin] - reach_n)
        low = int(below[-1]) if below.size else 0
        rise_n = float(path.force_n[begin] - path.force_n[low])
        if not rise_n > LEAST_BELOW * reach_n:
            return 0.0
        return float(path.travel_m[begin] - path.travel_m[low]) / rise_n


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
