"""Poses in words: the best one, its benefit, and how reliable the figures are."""

from __future__ import annotations

import math

import numpy as np

from stepload.pose.chain import reach_m
from stepload.pose.compliance import WRONG_BY
from stepload.pose.rig_search import Posture, Row
from stepload.pose.search import TRAVELS_M
from stepload.units import format_quantity, percent

WORTH = 1.1
"""Least ratio of stiffness for which a change of the pose is recommended."""


def sentences(found: Posture) -> list[str]:
    """Sentences on a search, each item one or two."""
    tool = format_quantity(math.dist(found.tool.offset[:3], (0.0, 0.0, 0.0)), "m")
    return [
        _best(found),
        *(_calibration(found, each) for each in found.calibrated),
        _payload(found),
        _stuck(found.best[0]),
        f"Joint stiffness: {found.stiffness.source}. Tool: {tool} ({found.tool.source}). Links, "
        "bearings, tool, sensor and plate make a rig softer, most where the arm is stiffest.",
        _near(found.best[0]),
        "This is a ranking and no calibration: calibrate in the pose that you choose.",
        *found.remarks,
    ]


def up(value: float) -> str:
    """A bound with two decimals, rounded up."""
    return f"{math.ceil(value * 100.0 - 1e-9) / 100.0:.2f}"


def _n_per_m(value: float) -> str:
    return format_quantity(value, "N/m")


def _best(found: Posture) -> str:
    first = found.best[0]
    radius_m, stiffness = math.hypot(*first.tip_m[:2]), float(first.figures.free_n_per_m)
    low_m, high_m = found.task.radius_m
    edge = radius_m < low_m + 1e-3 and low_m < high_m
    return (
        f"The best of {len(found.poses.joints_rad)} poses of {found.arm.name}: plate at "
        f"{radius_m * 1e3:.0f} mm from the base's axis ({radius_m / reach_m(found.arm):.2f} of the "
        f"reach), contact at a height of {first.tip_m[2] * 1e3:.0f} mm. K_zz is "
        f"{_n_per_m(stiffness)}, {stiffness / found.median_n_per_m:.2g} times the median, "
        f"{_n_per_m(found.median_n_per_m)}."
        + " It is at the smallest radius; --radius sets how near a plate may stand."
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


def _payload(found: Posture) -> str:
    press, most = found.press, found.best[0].k_max_n_per_m
    top = format_quantity(press.top_n, "N")
    if press.gauge:
        return (
            f"A gauge across the contact takes K_s out of the chain: K_max is {_n_per_m(most)} at "
            f"{top} in every pose."
        )
    limits = f"{_n_per_m(found.median_k_max_n_per_m)} at the median pose, {_n_per_m(most)} at best"
    if press.resolution_binds(found.median_n_per_m):
        limits += " (limited by the resolution of the travel)"
    if not press.payload:
        return f"At {top} K_max (34) is {limits}."
    secant = press.secant_n_per_m
    told = "no pose will do"
    if secant <= most:
        told = "it needs a good pose"
    if secant <= found.median_k_max_n_per_m:
        told = "most poses will do, and a stiffer one narrows the interval"
    return (
        f"{press.payload} has a secant stiffness of {_n_per_m(secant)} at {top}; K_max (34) is "
        f"{limits}: {told}{press.why and '; ' + press.why}."
    )


def _stuck(first: Row) -> str:
    figures, most = first.figures, first.largest
    return (
        f"Held sideways the tip of pose 1 is {figures.stuck_ratio:.2f} times as stiff (stuck "
        f"ratio), at most {up(most.stuck_ratio)} times with joints off by a factor of {WRONG_BY:g}"
        f" (95 %); a flat contact {figures.flat_ratio:.2f} times, at most {up(most.flat_ratio)}. "
        "rig.system_stiffness.stuck_ratio multiplies the K_s of this pose: calibrate in it first. "
        f"A tip sticks where friction is above {figures.stuck_share:.2f}."
    )


def _near(first: Row) -> str:
    told = ", ".join(
        f"{percent(share, 2)} over {format_quantity(travel, 'm')}"
        for share, travel in zip(first.changes, TRAVELS_M, strict=True)
        if np.isfinite(share)
    )
    return f"Along the press C_zz of pose 1 changes by {told}."
