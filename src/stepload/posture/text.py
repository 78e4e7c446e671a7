"""Poses in words: the best one, its benefit, and how reliable the ranking is."""

from __future__ import annotations

import math

import numpy as np

from stepload.posture.chain import reach_m
from stepload.posture.ranking_uncertainty import WRONG_BY
from stepload.posture.rig_search import Posture, Row
from stepload.posture.stiffness_gradient import TRAVELS_M
from stepload.units import format_quantity


def sentences(found: Posture) -> list[str]:
    """Sentences on a search, each item one or two."""
    return [
        _best(found),
        *(_calibration(found, each) for each in found.calibrated),
        *_payload(found),
        _stuck(found.best[0]),
        _rests_on(found),
        *_doubt(found),
        _near(found),
        "This is a ranking and no calibration: calibrate in the pose that you choose.",
        *found.remarks,
    ]


WORTH = 1.1
"""Least ratio of stiffness for which a change of the pose is recommended."""
HOLDS = 0.9
"""Least rank correlation at which an order is called reliable."""


def up(value: float) -> str:
    """A bound with two decimals, rounded up."""
    return f"{math.ceil(value * 100.0 - 1e-9) / 100.0:.2f}"


def _n_per_m(value: float) -> str:
    return format_quantity(value, "N/m")


def _best(found: Posture) -> str:
    first = found.best[0]
    radius = math.hypot(first.tip_m[0], first.tip_m[1])
    gain = float(first.figures.free_n_per_m) / found.median_n_per_m
    edge = (
        radius < found.task.radius_m[0] + 1e-3 and found.task.radius_m[0] < found.task.radius_m[1]
    )
    return (
        f"The best of {len(found.poses.joints_rad)} poses of {found.arm.name} has its plate "
        f"{radius * 1e3:.0f} mm from the base's axis ({radius / reach_m(found.arm):.2f} of the "
        f"reach), the contact at a height of {first.tip_m[2] * 1e3:.0f} mm: K_zz is "
        f"{_n_per_m(float(first.figures.free_n_per_m))}, {gain:.2g} times that of the median pose, "
        f"{_n_per_m(found.median_n_per_m)}."
        + " No nearer place was looked at; --radius says how near a plate may stand."
        * edge
    )


def _calibration(found: Posture, each: Row) -> str:
    assert each.measured_n_per_m is not None
    first = found.best[0]
    stiffest = float(first.figures.free_n_per_m)
    said = f"At the pose of {each.name} K_s is {_n_per_m(each.measured_n_per_m)}"
    if stiffest < WORTH * each.measured_n_per_m:
        return f"{said}: no pose that was looked at is much stiffer."
    said += f"; the best reaches {_n_per_m(stiffest)}"
    if found.press.gauge:
        return f"{said}."
    return (
        f"{said}: payloads up to {_n_per_m(first.k_max_n_per_m)} instead of "
        f"{_n_per_m(each.k_max_n_per_m)} (34)."
    )


def _payload(found: Posture) -> list[str]:
    press, first = found.press, found.best[0]
    top = format_quantity(press.top_n, "N")
    if press.gauge:
        return [
            "A gauge across the contact takes K_s out of the chain: no pose changes K_max "
            f"({_n_per_m(first.k_max_n_per_m)} at {top})."
        ]
    limits = (
        f"{_n_per_m(found.median_k_max_n_per_m)} at the median pose and "
        f"{_n_per_m(first.k_max_n_per_m)} at the best"
    )
    if press.resolution_binds(found.median_n_per_m):
        limits += " (the resolution of the travel decides it at both, not the pose)"
    if not press.payload:
        return [f"At {top} K_max (34) is {limits}."]
    secant = press.secant_n_per_m
    if secant <= found.median_k_max_n_per_m:
        told = "most poses will do, and a stiffer one narrows the interval"
    elif secant <= first.k_max_n_per_m:
        told = "it needs a good pose"
    else:
        told = "no pose will do"
    why = f"; {press.why}" if press.why else ""
    return [
        f"{press.payload} has a secant stiffness of {_n_per_m(secant)} at {top}; K_max (34) is "
        f"{limits}: {told}{why}."
    ]


def _stuck(first: Row) -> str:
    figures, most = first.figures, first.largest
    return (
        f"Held sideways the tip of pose 1 is {figures.stuck_ratio:.2f} times as stiff (stuck "
        f"ratio), at most {up(most.stuck_ratio)} times with joints that are off by a factor of "
        f"{WRONG_BY:g} (upper end of 95 %); a flat contact, which holds the tool's rotation too, "
        f"{figures.flat_ratio:.2f} times, at most {up(most.flat_ratio)}. The ratio "
        "multiplies the K_s of this pose (rig.system_stiffness.stuck_ratio), never that of a "
        "profile: calibrate in the pose first. A tip sticks "
        f"where friction is above {figures.stuck_share:.2f}."
    )


def _rests_on(found: Posture) -> str:
    tool = format_quantity(math.dist(found.tool.offset[:3], (0.0, 0.0, 0.0)), "m")
    return (
        f"Joint stiffness: {found.stiffness.source}. Tool: {tool} ({found.tool.source}). Only the "
        "joints give way here; links, bearings, tool, sensor and plate make a rig softer, most so "
        "where the arm is stiffest."
    )


def _doubt(found: Posture) -> list[str]:
    seen = found.ranking
    if seen is None:
        return ["There are too few poses here to tell how the joints' doubt changes their order."]
    order = "but the order holds" if seen.stiffness_worst >= HOLDS else "and the order is unsure"
    return [
        f"With every joint off by up to a factor of {WRONG_BY:g}, K_zz is off by a factor of "
        f"{seen.off_by[0]:.2f} to {seen.off_by[1]:.2f}, {order}: rank correlation "
        f"{seen.stiffness:.2f} ({seen.stiffness_worst:.2f} in the worst twentieth), of the stuck "
        f"share {seen.share:.2f}; the stiffest tenth still has {seen.top_tenth:.2g} times the "
        "median."
    ]


def _near(found: Posture) -> str:
    own = found.best[0].changes
    (median_2, worst_2), (median_20, worst_20) = found.typical_changes
    travels = [format_quantity(each, "m") for each in TRAVELS_M]
    told = ", ".join(
        f"{share:.1%} over {travel}"
        for share, travel in zip(own, travels, strict=True)
        if np.isfinite(share)
    )
    return (
        f"A calibration holds near its pose: along the press C_zz of pose 1 changes by {told}; of "
        f"all poses by {median_2:.1%} over {travels[0]} and {median_20:.1%} over {travels[1]} in "
        f"the median, {worst_2:.1%} and {worst_20:.1%} in a tenth of them or more."
    )
