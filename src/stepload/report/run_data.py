"""A run in the form that is judged."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stepload.identification.conditions import Conditions
from stepload.identification.fit import FloatArray
from stepload.identification.lateral import LateralForce, alignment_of, lateral_force
from stepload.identification.loops import Track
from stepload.identification.run_data import RunData
from stepload.record.rows import Phase
from stepload.report.curve_zero import NEAR_TOP
from stepload.report.model import finite
from stepload.report.press_data import LOADING, UNLOADING, PressData, holds_of
from stepload.report.quality import quality_of

CLOSING_OPENING = (
    Phase.GUARDED_APPROACH,
    Phase.DWELL,
    Phase.TOUCH_RETRACT,
    Phase.UNLOAD,
    Phase.RETRACT,
)
SIGMAS = 6.0
"""Least pull, in standard deviations of one sample, that is not an extreme of the noise."""


def pressed(data: PressData, conditions: Conditions) -> RunData:
    """The cycles of a run that was loaded, with the known errors."""
    tracks = []
    for number in np.unique(data.cycle[data.branch(LOADING)]).tolist():
        loading = _track(data, data.branch(LOADING, number))
        unloading = data.branch(UNLOADING, number)
        tracks.append((number, loading, _track(data, unloading) if unloading.sum() > 1 else None))
    peak_n = float(data.force_n[data.branch(LOADING)].max())
    aside = lateral_force_of(data, conditions)
    return RunData(
        tracks=tracks,
        conditions=conditions,
        doubts=(*data.doubts, *above_limit(conditions, peak_n)),
        zero_step_n=finite(data.zero_step_n),
        lateral_force=aside,
        alignment=alignment_of(conditions, quality_of(data, conditions.lever_m), aside.share),
        arm_drift_m_per_s=_arm_drift(data),
        adhesive=pulls(data),
        looked=data.looked,
        notes=tuple(conditions.table_remarks(peak_n)),
    )


def above_limit(conditions: Conditions, top_n: float) -> tuple[str, ...]:
    """A doubt that blocks every figure of a press up to `top_n`, where that is above F_c."""
    limit_n = conditions.elastic_limit_n
    if limit_n is None or top_n <= limit_n:
        return ()
    return (
        f"forces up to {top_n:.4g} N, above the elastic limit of {limit_n:.4g} N: the payload may "
        "have yielded",
    )


def _track(data: PressData, mask: NDArray[np.bool_]) -> Track:
    held = holds_of(data.phase[mask])
    arm_m = None if data.arm_m is None else data.arm_m[mask]
    second_n = None if data.second_n is None else data.second_n[mask]
    return Track(data.time_s[mask], data.force_n[mask], data.travel_m[mask], held, arm_m, second_n)


def _arm_drift(data: PressData) -> float | None:
    """Drift of the arm's position between the touches in m/s, what the payload set included."""
    ends = [touch for touch in data.touches if touch.purpose in ("first", "again", "cycle", "last")]
    if data.arm_m is None or len(ends) < 2 or not ends[-1].time_s > ends[0].time_s:
        return None
    return (ends[-1].position_m - ends[0].position_m) / (ends[-1].time_s - ends[0].time_s)


def lateral_force_of(data: PressData, conditions: Conditions) -> LateralForce:
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
    return lateral_force(conditions, share, size, away)


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
