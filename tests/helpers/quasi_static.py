"""A tip on springs pressed slowly onto a plate with friction, by root finding: no time, no mass.

A second implementation of what `stepload_drivers.sim.six_tip` integrates, to compare with: vectors
in the pressing frame, the state found by scipy for each small move of the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import root

from stepload.rig.mount import Mount


class Pressed(NamedTuple):
    """Tip and load (pressing frame), and depth along the plate's normal."""

    tip_m: np.ndarray
    load_n: np.ndarray
    depth_m: float
    slides: bool


def press(
    mount: Mount,
    k: float,
    n: float,
    surface_m: float,
    drives_m: Sequence[tuple[float, float, float]],
) -> list[Pressed]:
    """The state at each of `drives_m` (N, 3), gone through in this order from the origin."""
    compliance = np.array(mount.compliance_m_per_n)
    a, b = mount.plate_tilt_rad
    angle = np.hypot(a, b)
    normal = np.array([0.0, 0.0, 1.0])
    if angle:
        normal = np.array([b / angle * np.sin(angle), -a / angle * np.sin(angle), np.cos(angle)])
    touch = np.array([0.0, 0.0, surface_m])
    flat = np.eye(3) - np.outer(normal, normal)
    friction, stiffness, at = np.zeros(3), 0.0, np.zeros(3)
    states = []

    def contact(tip: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, bool]:
        depth = float(normal @ (tip - touch))
        if depth <= 0.0:
            return np.zeros(3), np.zeros(3), 0.0, False
        pressing = k * depth**n
        tangent = mount.tangential_ratio * n * pressing / depth
        kept = friction * min(1.0, tangent / stiffness) if stiffness else friction
        rubbed = kept + 0.5 * (stiffness + tangent) * flat @ (tip - at)
        size = float(np.linalg.norm(rubbed))
        slides = size > mount.friction_static * pressing
        if slides:
            rubbed = rubbed * mount.friction_static * pressing / size
        return pressing * normal + rubbed, rubbed, tangent, slides

    for drive in drives_m:
        goal = np.array(drive)
        # unknowns in units of 1 um, residuals likewise
        found = root(
            lambda tip, goal=goal: tip - 1e6 * (goal - compliance @ contact(1e-6 * tip)[0]),
            1e6 * (at if states and states[-1].depth_m > 0.0 else goal),
            method="hybr",
            tol=1e-11,
        )
        tip = 1e-6 * found.x
        load, friction, stiffness, slides = contact(tip)
        assert np.linalg.norm(tip - goal + compliance @ load) < 1e-10, found.message
        at = tip
        states.append(Pressed(tip, load, float(normal @ (tip - touch)), slides))
    return states
