"""Poses as tables for people and as an object for programs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stepload.identification.fit import FloatArray
from stepload.pose.chain import reach_m
from stepload.pose.compliance import WRONG_BY
from stepload.pose.rig_search import Posture, Row
from stepload.pose.search import TRAVELS_M
from stepload.pose.text import sentences, up
from stepload.report.model import Table
from stepload.units import format_quantity


def place_table(found: Posture) -> Table:
    """Position of the plate and joint angles of the arm."""
    rows = [
        (
            each.name, f"{np.hypot(each.tip_m[0], each.tip_m[1]) * 1e3:.0f} mm",
            f"{each.tip_m[2] * 1e3:.0f} mm", degrees(each.joints_rad),
            "-" if each.start_rad is None else degrees(each.start_rad),
        )
        for each in (*found.best, *found.calibrated)
    ]  # fmt: skip
    travel = format_quantity(found.task.travel_m, "m")
    columns = (
        "pose",
        "radius",
        "height",
        "joints at the plate, deg",
        f"at the start, {travel} back",
    )
    note = (
        "Radius: of the contact from the base's axis. Height: above the base's foot. The mirror "
        "image, with the shoulder on the other side, gives way alike."
        + " Joint 1 is for a plate along x of the base: it turns along with a plate elsewhere."
        * found.task.upright
    )
    return Table("Where to put the plate, and how to hold the arm", columns, rows, notes=(note,))


def stiffness_table(found: Posture) -> Table:
    """Stiffness of the arm there."""
    rows = [_figures(each) for each in (*found.best, *found.calibrated)]
    figures = found.poses.figures
    rows.append(
        (
            f"median of {len(figures.free_n_per_m)}",
            format_quantity(found.median_n_per_m, "N/m"),
            f"{np.median(figures.stuck_ratio):.2f}", "", f"{np.median(figures.stuck_share):.2f}",
            f"{np.median(figures.sideways):.2f}",
            f"{np.median(figures.tilt_rad_per_n) * 1e6:.3g}",
            format_quantity(found.median_k_max_n_per_m, "N/m"),
            _newton(float(np.median(found.poses.push_n))),
        )
    )  # fmt: skip
    columns = (
        "pose", "K_zz", "stuck ratio", "at most", "stuck share", "sideways", "tilt µrad/N",
        "K_max (34)", "push",
    )  # fmt: skip
    note = (
        "Stuck ratio: K_stuck/K_zz, at most: with every joint off by up to a factor of "
        f"{WRONG_BY:g}, upper end of 95 %. Stuck share: lateral over axial force while the tip "
        "sticks; with less friction than that it slides. Sideways: motion over axial motion of a "
        "tip that slides."
    )
    return Table("How the arm gives way there", columns, rows, notes=(note,))


def _figures(each: Row) -> tuple[str, ...]:
    way = each.figures
    return (
        each.name, format_quantity(float(way.free_n_per_m), "N/m"), f"{way.stuck_ratio:.2f}",
        up(each.largest.stuck_ratio), f"{way.stuck_share:.2f}", f"{way.sideways:.2f}",
        f"{way.tilt_rad_per_n * 1e6:.3g}", format_quantity(each.k_max_n_per_m, "N/m"),
        _newton(each.push_n),
    )  # fmt: skip


def _newton(force_n: float) -> str:
    return "-" if math.isnan(force_n) else f"{force_n:.0f} N"


def degrees(joints_rad: FloatArray) -> str:
    """Joint angles in the form typed at a pendant."""
    return " ".join(f"{each:.1f}" for each in np.degrees(joints_rad) + 0.0)


def data(found: Posture) -> dict[str, Any]:
    """The JSON object of a search."""
    return {
        "rig": found.rig,
        "arm": found.arm.name,
        "arm_source": found.arm.source,
        "press": found.task.press.tolist(),
        "tool": {"offset": list(found.tool.offset), "source": found.tool.source},
        "reach_m": reach_m(found.arm),
        "radius_m": list(found.task.radius_m),
        "height_m": list(found.task.height_m),
        "travel_m": found.task.travel_m,
        "joint_stiffness_n_m_per_rad": found.stiffness.values_n_m_per_rad.tolist(),
        "joint_stiffness_source": found.stiffness.source,
        "top_force_n": found.press.top_n,
        "payload": found.press.payload,
        "secant_n_per_m": found.press.secant_n_per_m,
        "poses": len(found.poses.joints_rad),
        "refused": found.poses.refused,
        "median_k_zz_n_per_m": found.median_n_per_m,
        "median_k_max_n_per_m": found.median_k_max_n_per_m,
        "best": [_row(each) for each in found.best],
        "calibrated": [_row(each) for each in found.calibrated],
        "travels_m": list(TRAVELS_M),
        "remarks": list(found.remarks),
        "answers": sentences(found),
        "places": [
            {"radius_m": float(radius), "height_m": float(height), "k_zz_n_per_m": float(most)}
            for radius, height, most in zip(*stiffest(found), strict=True)
        ],
    }  # fmt: skip


def _row(each: Row) -> dict[str, Any]:
    way = each.figures
    return {
        "name": each.name,
        "measured_n_per_m": each.measured_n_per_m,
        "x_m": float(each.tip_m[0]),
        "y_m": float(each.tip_m[1]),
        "z_m": float(each.tip_m[2]),
        "joints_rad": each.joints_rad.tolist(),
        "start_joints_rad": None if each.start_rad is None else each.start_rad.tolist(),
        "k_zz_n_per_m": float(way.free_n_per_m),
        "k_stuck_n_per_m": float(way.stuck_n_per_m),
        "stuck_ratio": float(way.stuck_ratio),
        "largest_stuck_ratio": each.largest.stuck_ratio,
        "flat_ratio": float(way.flat_ratio),
        "largest_flat_ratio": each.largest.flat_ratio,
        "stuck_share": float(way.stuck_share),
        "sideways": float(way.sideways),
        "tilt_rad_per_n": float(way.tilt_rad_per_n),
        "k_max_n_per_m": each.k_max_n_per_m,
        "push_n": each.push_n,
        "changes": each.changes.tolist(),
    }


def stiffest(found: Posture) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Radius, height (M,) of every reachable place, and K_zz of its stiffest pose."""
    place = np.round(np.stack([found.poses.radius_m, found.poses.tip_m[:, 2]], axis=-1), 6)
    unique, index = np.unique(place, axis=0, return_inverse=True)
    places: FloatArray = np.asarray(unique, dtype=np.float64)
    most = np.zeros(len(places))
    np.maximum.at(most, index.ravel(), found.poses.figures.free_n_per_m)
    return places[:, 0], places[:, 1], most
