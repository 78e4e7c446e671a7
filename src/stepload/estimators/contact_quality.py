"""How the contact of one run was made: lateral force, slip, place of the contact and tilt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepload.estimators.contact_point import NO_HOLDS, ContactPoint, contact_points
from stepload.estimators.missing import Missing
from stepload.estimators.shares import (
    BranchShare,
    Loop,
    branch_shares,
    change_of_share,
    loop_of,
)
from stepload.estimators.slips import Slip, slips_of, smallest_seen_n
from stepload.estimators.wrench import Wrench

NOT_IN_DATA = "not in the data: the force sensor tells nothing across the pressing axis"
NO_LEVER = "where the plate is touched is not known: rig.force.lever is not stated"
NO_TORQUE = "where the plate is touched is not in the data: the force sensor tells no torque"
LEAST_SAMPLES = 20


@dataclass(frozen=True, slots=True)
class ContactQuality:
    """How the contact of one run was made.

    Attributes:
        branches: the lateral share (lateral over axial force), branch by branch.
        loop: comparison of the shares while loading and unloading.
        change: by how much the share changed from cycle 1 to 2, and its uncertainty; None without
            a second loading.
        slips: detected slip events; `unseen_n` is the smallest jump at the top force that is
            certain to be detected.
        points: place of the contact, hold by hold; `Missing` gives the reason where it is not
            known.
    """

    branches: tuple[BranchShare, ...]
    loop: Loop
    change: tuple[float, float] | None
    slips: tuple[Slip, ...]
    unseen_n: float
    points: tuple[ContactPoint, ...] | Missing

    @property
    def share(self) -> float:
        """Median size of the lateral share over the forces of the first loading."""
        return self.branches[0].size

    @property
    def eccentric(self) -> ContactPoint | None:
        """The place at the largest force, the most accurate one; None where it is not known."""
        if isinstance(self.points, Missing):
            return None
        return max(self.points, key=lambda point: point.force_n)


def contact_quality(wrench: Wrench | None, lever_m: float | None) -> ContactQuality | Missing:
    """Evaluate how the contact of a run was made.

    Args:
        wrench: its samples in contact; None where the sensor has one axis only.
        lever_m: from the sensor's origin to the contact; None where it is not stated.
    """
    if wrench is None:
        return Missing(NOT_IN_DATA)
    wrench = wrench.finite()
    top_n = float(wrench.force_n.max()) if wrench.force_n.size else 0.0
    if wrench.force_n.size < LEAST_SAMPLES or not top_n > 0.0:
        return Missing("not in the data: too few samples in contact")
    branches = branch_shares(wrench, top_n)
    loop = loop_of(branches) if branches else None
    if loop is None:
        return Missing("not in the data: there is no loading")
    period_s = float(np.median(np.diff(wrench.time_s)))
    points: tuple[ContactPoint, ...] | Missing
    if wrench.torque_n_m is None:
        points = Missing(NO_TORQUE)
    elif not lever_m:
        points = Missing(NO_LEVER)
    else:
        points = contact_points(wrench, lever_m) or Missing(NO_HOLDS)
    return ContactQuality(
        tuple(branches), loop, change_of_share(branches), slips_of(wrench, top_n),
        smallest_seen_n(wrench.noise_n, period_s, top_n) if period_s > 0.0 else float("inf"),
        points,
    )  # fmt: skip
