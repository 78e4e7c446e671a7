"""From the data of a run and its conditions to the input of the evidence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.evidence.askew import askew_of
from stepload.evidence.path import Track
from stepload.evidence.pressed import Pressed, Touch
from stepload.evidence.sideways import GUIDED_COMPLIANCE, Sideways, sideways
from stepload.record.rows import Phase
from stepload.results.curve import PreparedCurve
from stepload.results.curve_zero import SAME_PEAK, Branch
from stepload.results.model import finite
from stepload.results.press_data import LOADING, UNLOADING, PressData, holds_of
from stepload.results.quality import quality_of

CLOSING_OPENING = (
    Phase.GUARDED_APPROACH,
    Phase.DWELL,
    Phase.TOUCH_RETRACT,
    Phase.UNLOAD,
    Phase.RETRACT,
)
SIGMAS = 6.0
"""Least pull, in standard deviations of one sample, that is not an extreme of the noise."""
NEAR_TOP = 0.5
"""Least share of the largest force at which the lateral force is evaluated."""
BEFORE_TOUCH_S = 0.05
"""Time before a touch over which the speed of the approach is measured."""


def pressed(data: PressData, conditions: Conditions) -> Pressed:
    """The cycles of a run that was loaded, with the known errors."""
    tracks = []
    for number in np.unique(data.cycle[data.branch(LOADING)]).tolist():
        loading = _track(data, data.branch(LOADING, number))
        unloading = data.branch(UNLOADING, number)
        tracks.append((number, loading, _track(data, unloading) if unloading.sum() > 1 else None))
    peak_n = float(data.force_n[data.branch(LOADING)].max())
    aside = sideways_of(data, conditions)
    return _pressed(
        conditions,
        peak_n,
        data.doubts,
        tracks=tracks,
        touches=_touches(data),
        zero_step_n=finite(data.zero_step_n),
        sideways=aside,
        askew=askew_of(conditions, quality_of(data, conditions.lever_m), aside.share),
        arm_drift_m_per_s=_arm_drift(data),
        adhesive=pulls(data),
        looked=data.looked,
        notes=(*filter(None, [conditions.structure_note]), *conditions.table_remarks(peak_n)),
    )


def pressed_curve(curve: PreparedCurve) -> Pressed:
    """The cycles of a curve from elsewhere with the known errors."""
    cycles = curve.cycles
    top_n = max(float(each.loading.force_n.max()) for each in cycles)
    if float(cycles[0].loading.force_n.max()) >= SAME_PEAK * top_n:
        tracks = [
            (each.number, _joined(each.loading, each.hold),
             None if each.unloading is None else _joined(each.unloading, None))
            for each in cycles
        ]  # fmt: skip
    else:
        tracks = [(1, *_grown(curve, top_n))]
    shares = [share for each in cycles if (share := _share(each.loading)) is not None]
    share = max(shares, default=None)
    relative = 0.0 if share is None else GUIDED_COMPLIANCE * share
    return _pressed(
        curve.conditions,
        top_n,
        curve.doubts,
        tracks=tracks,
        sideways=Sideways("guided", share, relative=relative),
        adhesive=curve.adhesion_n > 0.0,
        timed=cycles[0].loading.time_s is not None,
        law_doubts=curve.law_doubts,
    )


def _pressed(conditions: Conditions, top_n: float, doubts: tuple[str, ...], **own: Any) -> Pressed:
    """A press up to `top_n` under its conditions; above F_c one doubt more blocks every figure."""
    limit_n = conditions.elastic_limit_n
    if limit_n is not None and top_n > limit_n:
        above = (
            f"forces up to {top_n:.4g} N, above the elastic limit of {limit_n:.4g} N: the payload "
            "may have yielded"
        )
        doubts = (*doubts, above)
    return Pressed(conditions=conditions, doubts=doubts, **own)


def _joined(branch: Branch, hold: Branch | None) -> Track:
    parts = [branch] if hold is None or not hold.force_n.size else [branch, hold]
    force_n = np.concatenate([part.force_n for part in parts])
    times = [part.time_s for part in parts if part.time_s is not None]
    # Without a time the rows of the whole file stand for it: those of a branch begin where the
    # one before has ended.
    time_s = np.concatenate(times or [part.row for part in parts])
    held = np.concatenate(
        [np.full(part.force_n.size, number, dtype=np.intp) for number, part in enumerate(parts)]
    )
    return Track(time_s, force_n, np.concatenate([part.travel_m for part in parts]), held)


def _grown(curve: PreparedCurve, top_n: float) -> tuple[Track, Track | None]:
    """For growing cycles: the first loading, and the unloading from the top."""
    parts: list[Track] = []
    reached_n, unloading = -math.inf, None
    for each in curve.cycles:
        track = _joined(each.loading, each.hold)
        new = track.force_n > reached_n
        if new.any():
            parts.append(
                Track(track.time_s[new], track.force_n[new], track.travel_m[new], track.held[new])
            )
            reached_n = max(reached_n, float(track.force_n.max()))
            unloading = each.unloading
        if reached_n >= SAME_PEAK * top_n:
            break
    fields = ("time_s", "force_n", "travel_m", "held")
    loading = Track(*(np.concatenate([getattr(p, name) for p in parts]) for name in fields))
    return loading, None if unloading is None else _joined(unloading, None)


def _share(branch: Branch) -> float | None:
    if branch.lateral_n is None:
        return None
    high = branch.force_n > NEAR_TOP * float(branch.force_n.max())
    return float(np.median(branch.lateral_n[high]) / np.mean(branch.force_n[high]))


def _track(data: PressData, mask: NDArray[np.bool_]) -> Track:
    held = holds_of(data.phase[mask])
    arm_m = None if data.arm_m is None else data.arm_m[mask]
    second_n = None if data.second_n is None else data.second_n[mask]
    return Track(data.time_s[mask], data.force_n[mask], data.travel_m[mask], held, arm_m, second_n)


def _touches(data: PressData) -> tuple[Touch, Touch] | None:
    """The touch that began the first loading, and the last one."""
    first = [touch for touch in data.touches if touch.purpose in ("first", "again")][-1:]
    later = [touch for touch in data.touches if touch.purpose in ("cycle", "last")][-1:]
    if not first or not later:
        return None
    one, other = (
        Touch(t.time_s, t.travel_m, t.force_n, _blur_m(data, t.time_s))
        for t in (first[0], later[0])
    )
    return one, other


def _arm_drift(data: PressData) -> float | None:
    """Drift of the arm's position between the touches in m/s, what the payload set included."""
    ends = [touch for touch in data.touches if touch.purpose in ("first", "again", "cycle", "last")]
    if data.arm_m is None or len(ends) < 2 or not ends[-1].time_s > ends[0].time_s:
        return None
    return (ends[-1].position_m - ends[0].position_m) / (ends[-1].time_s - ends[0].time_s)


def _blur_m(data: PressData, time_s: float) -> float:
    """Travel between two samples on the way to a touch, in m."""
    end = int(np.searchsorted(data.time_s, time_s, side="right"))
    begin = int(np.searchsorted(data.time_s, time_s - BEFORE_TOUCH_S))
    way = data.travel_m[begin:end]
    return abs(float(way[-1] - way[0])) / (way.size - 1) if way.size > 1 else 0.0


def sideways_of(data: PressData, conditions: Conditions) -> Sideways:
    """The lateral share, and its effect on the uncertainty.

    The size counts near the top force, noise taken out; with its sign the share is the slope of
    force across over force along.
    """
    share, size, away = None, None, 0.0
    if data.across_n is not None:
        mask = data.branch(LOADING)
        mask &= data.force_n > NEAR_TOP * float(data.force_n[mask].max())
        force_n, across_n = data.force_n[mask], data.across_n[mask]
        noise_n = data.lateral_noise_n if math.isfinite(data.lateral_noise_n) else 0.0
        share = force_n @ across_n / (force_n @ force_n)
        size = _share_size(across_n, force_n, noise_n)
        apart_n = across_n - np.outer(force_n, conditions.across.at_share or (0.0, 0.0))
        away = _share_size(apart_n, force_n, noise_n)
    return sideways(conditions, share, size, away)


def pulls(data: PressData) -> bool:
    """Whether the tared force falls below zero by more than noise where a contact closes or opens.

    An arm that shakes its sensor at a reversal looks the same; then an additional law is tried,
    which can only widen the intervals of figures that rest on a zero.
    """
    about = np.isin(data.phase, CLOSING_OPENING)
    if not about.any():
        return False
    return bool(float(data.force_n[about].min()) < -SIGMAS * data.noise_n)


def _share_size(across_n: FloatArray, force_n: FloatArray, noise_n: float) -> float:
    """Size of lateral forces (N, 2) over axial forces (N,), noise subtracted."""
    square = float(np.mean(np.sum(across_n**2, axis=1))) - noise_n**2
    return math.sqrt(max(square, 0.0)) / float(force_n.mean())
