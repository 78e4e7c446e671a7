"""Evaluation of every pose of a grid that an arm can reach, and choice of the best places."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from stepload.errors import BadInputError, RefusedError
from stepload.identification.fit import BoolArray, FloatArray, IntArray
from stepload.plan.kinematics import ArmKinematics
from stepload.pose.chain import (
    Tool,
    frames,
    jacobian,
    reach_m,
)
from stepload.pose.compliance import GivesWay, compliance, gives_way
from stepload.pose.inverse import BRANCHES, check_closed_form, inverse
from stepload.pose.pose_checks import clear, mobile, push_n
from stepload.units import format_quantity

STEP = 0.05
"""Step of the grid, as a share of the reach."""
MOST_STEPS = 60
SMALLEST_RADIUS, LARGEST_RADIUS, LOWEST, HIGHEST = 0.3, 1.2, -0.4, 0.9
"""Default range of the grid, as shares of the reach; nearer to the base there is no room for a
plate."""
TURNS = 8
"""Number of directions about the base, and of tool rotations, that are tried if they matter."""
LARGEST_TURN_RAD = 0.7
"""Largest turn of a joint between start and plate; beyond it the arm does not go straight down."""
ALIKE = 1.1
"""Stiffnesses within this factor count as equal: the lower stuck share is preferred."""
APART = 0.15
"""Places nearer than this share of the reach count as one place."""
BEST = 5
TRAVELS_M = (2e-3, 2e-2)
"""Travel of a press, and of a start pose that is off."""
MOST = 0.01
"""Largest acceptable change over the first of them: a good calibration knows K_s as well."""
TWINS = 1e-7
"""Figures that differ by less belong to one arm configuration and its mirror image."""


@dataclass(frozen=True, slots=True)
class Task:
    """Requirements on a pose.

    Attributes:
        press: unit vector of the press in the base, shape (3,).
        radius_m, height_m: from and to, of the contact from the base's axis and above its foot.
        travel_m: distance of the start back along the press, which must be reachable in the same
            configuration.
        force_n: force that the joints must be able to push.
    """

    press: FloatArray
    radius_m: tuple[float, float]
    height_m: tuple[float, float]
    travel_m: float
    force_n: float

    @property
    def upright(self) -> bool:
        """Whether the press is along the base's axis, so that no direction about it differs."""
        return bool(math.hypot(self.press[0], self.press[1]) < 1e-9)


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses that can be reached; arrays with one entry each.

    Attributes:
        joints_rad: (N, 6); `start_rad` those of the start.
        tip_m: contact points (N, 3) in the base.
        jacobian: (N, 6, 6).
        figures: stiffness of the arm there.
        push_n: largest push of the joints there, NaN where that is not known.
        changes: of C_zz when the arm draws back by each of `TRAVELS_M`, (N, 2).
        refused: reasons why other poses were refused, with the number of configurations.
    """

    joints_rad: FloatArray
    start_rad: FloatArray
    tip_m: FloatArray
    jacobian: FloatArray
    figures: GivesWay
    push_n: FloatArray
    changes: FloatArray
    refused: dict[str, int]

    @property
    def radius_m(self) -> FloatArray:
        """Of the contact, from the base's axis."""
        return np.hypot(self.tip_m[:, 0], self.tip_m[:, 1])


def direction(x: float, y: float, z: float) -> FloatArray:
    """The unit vector of a press.

    Raises:
        BadInputError: it has no length, or is not finite.
    """
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 1e-6):
        raise BadInputError(
            f"--press {x:g} {y:g} {z:g} is no direction", hint="down is: --press 0 0 -1"
        )
    return np.array([x, y, z]) / length


def _steps(ends: tuple[float, float], step: float) -> FloatArray:
    """Numbers from one end to the other, about `step` apart, to a millimetre."""
    low, high = ends
    count = min(math.ceil((high - low) / step - 1e-9), MOST_STEPS)
    return np.round(np.linspace(low, high, count + 1), 3)


def grid(arm: ArmKinematics, tool: Tool, task: Task) -> Iterator[FloatArray]:
    """Contact frames (N, 4, 4) in the base: all places, by direction and rotation of the tool.

    For an upright press all directions about the base are equivalent, and for a tool on the
    flange's axis all its rotations.
    """
    step = STEP * reach_m(arm)
    by_height = np.meshgrid(_steps(task.radius_m, step), _steps(task.height_m, step))
    radius, height = (each.ravel() for each in by_height)
    down = _turned_to(task.press)
    free = tool.on_axis and arm.high_rad[-1] - arm.low_rad[-1] >= math.tau
    for azimuth in np.linspace(0.0, math.tau, 1 if task.upright else TURNS, endpoint=False):
        for turn in np.linspace(0.0, math.tau, 1 if free else TURNS, endpoint=False):
            made = np.tile(np.eye(4), (len(radius), 1, 1))
            made[:, :3, :3] = down @ Rotation.from_euler("z", turn).as_matrix()
            made[:, 0, 3], made[:, 1, 3] = radius * math.cos(azimuth), radius * math.sin(azimuth)
            made[:, 2, 3] = height
            yield made


def _turned_to(press: FloatArray) -> FloatArray:
    """A rotation (3, 3) whose z is along the press."""
    x = np.cross([0.0, 1.0, 0.0], press)
    x = np.array([1.0, 0.0, 0.0]) if np.linalg.norm(x) < 1e-6 else x / np.linalg.norm(x)
    return np.stack([x, np.cross(press, x), press], axis=-1)


def search(arm: ArmKinematics, stiffness: FloatArray, tool: Tool, task: Task) -> Poses:
    """Every pose of the grid that can be reached.

    Raises:
        RefusedError: the arm has no closed-form inverse, or it reaches no place of the grid.
    """
    check_closed_form(arm)
    found = [_reached(arm, stiffness, tool, task, contact) for contact in grid(arm, tool, task)]
    refused = {key: sum(each.refused[key] for each in found) for key in found[0].refused}
    if not any(len(each.joints_rad) for each in found):
        why = max(refused, key=lambda key: refused[key])
        raise RefusedError(
            f"{arm.name} reaches no place with its contact {_range(task.radius_m)} from the base's "
            f"axis and {_range(task.height_m)} above its foot; most often: {why}",
            hint="other places with --radius and --height, a shorter --travel or --tool",
        )
    figures = GivesWay(
        *(np.concatenate([getattr(e.figures, name) for e in found]) for name in GivesWay.__slots__)
    )
    joints, start, tip, j, push, moved = (
        np.concatenate([getattr(each, name) for each in found])
        for name in ("joints_rad", "start_rad", "tip_m", "jacobian", "push_n", "changes")
    )
    return Poses(joints, start, tip, j, figures, push, moved, refused)


def _range(ends: tuple[float, float]) -> str:
    low, high = (format_quantity(each, "m") for each in ends)
    return low if low == high else f"{low} to {high}"


def _reached(
    arm: ArmKinematics, stiffness: FloatArray, tool: Tool, task: Task, contact: FloatArray
) -> Poses:
    """The reachable poses of contact frames (N, 4, 4), in all configurations of the arm."""
    flange = contact @ np.linalg.inv(tool.matrix)
    above = flange.copy()
    above[:, :3, 3] -= task.travel_m * task.press
    here, start = (inverse(arm, each).reshape(-1, 6) for each in (flange, above))
    tip = np.repeat(contact[:, :3, 3], BRANCHES, axis=0)
    refused = {"out of reach": int(np.sum(~np.isfinite(here[:, 0])))}
    kept = np.isfinite(here[:, 0])

    def keep(good: BoolArray, why: str) -> None:
        nonlocal kept
        refused[why] = int(np.sum(kept & ~good))
        kept = kept & good

    straight = np.isfinite(start[:, 0])
    straight &= np.nan_to_num(np.max(np.abs(start - here), axis=1), nan=9.0) < LARGEST_TURN_RAD
    keep(straight, "no straight way from the start")
    placed = frames(arm, np.nan_to_num(here))
    placed_start = frames(arm, np.nan_to_num(start))
    floor = np.minimum(0.0, tip[:, 2])
    stands = clear(arm, placed, tip, floor)
    stands &= clear(arm, placed_start, tip - task.travel_m * task.press, floor)
    keep(stands, "the arm would meet its table, its base or itself")
    j = jacobian(placed, tip)
    keep(mobile(j, reach_m(arm)), "stretched, folded or with two axes in line")
    push = push_n(arm, placed, j, task.press)
    keep(~(push < task.force_n), "the joints cannot push that hard")
    moved = changes(arm, stiffness, tool, here)
    keep(moved[:, 0] <= MOST, f"stiffness that changes by more than {MOST:.0%} over a press")
    figures = gives_way(compliance(j[kept], stiffness), task.press)
    place = np.repeat(np.arange(len(contact)), BRANCHES)
    turned = np.sum(np.abs(here), axis=1)
    picked = _unlike(place[kept], figures, turned[kept])
    chosen = np.flatnonzero(kept)[picked]
    return Poses(
        here[chosen], start[chosen], tip[chosen], j[chosen], figures.at(picked), push[chosen],
        moved[chosen], refused,
    )  # fmt: skip


def _unlike(place: IntArray, figures: GivesWay, turned: FloatArray) -> IntArray:
    """Indices of poses without the mirror image of another one at the same place.

    An arm with its shoulder on the other side is its own mirror image with the same stiffness: of
    the two, the one with the smaller sum of joint angles is kept.
    """
    stiffness, share = np.log(figures.free_n_per_m), figures.stuck_share
    order = np.lexsort((share, stiffness, place))
    new = np.ones(len(order), dtype=bool)
    for values in (place, stiffness, share):
        steps = np.abs(np.diff(values[order])) > TWINS
        new[1:] = steps if values is place else new[1:] | steps
    group = np.cumsum(new)
    by_turn = np.lexsort((turned[order], group))
    first = np.flatnonzero(np.diff(group[by_turn], prepend=0))
    return np.sort(order[by_turn[first]])


def best(poses: Poses, reach: float, many: int = BEST) -> list[int]:
    """Indices of the best poses, each of another place, the best first.

    Among the poses within `ALIKE` of the stiffest one, that with the least stuck share; then the
    same among the poses that are further away.
    """
    left = np.ones(len(poses.joints_rad), dtype=bool)
    stiffness, share = poses.figures.free_n_per_m, poses.figures.stuck_share
    found: list[int] = []
    while np.any(left) and len(found) < many:
        alike = left & (stiffness >= np.max(stiffness[left]) / ALIKE)
        index = int(np.argmin(np.where(alike, np.round(share, 6), np.inf)))
        found.append(index)
        left &= np.linalg.norm(poses.tip_m - poses.tip_m[index], axis=1) > APART * reach
    return found


def changes(
    arm: ArmKinematics, stiffness: FloatArray, tool: Tool, joints_rad: FloatArray
) -> FloatArray:
    """Relative change of C_zz of poses (N, 6) when they draw back by each of `TRAVELS_M`: (N, 2).

    Along the tool's own axis, in the same arm configuration.
    """
    placed = frames(arm, joints_rad)
    contact = placed[:, -1] @ tool.matrix
    press = contact[:, :3, 2]
    here = _axial(arm, stiffness, tool, joints_rad)
    found = []
    for travel in TRAVELS_M:
        moved = placed[:, -1].copy()
        moved[:, :3, 3] -= travel * press
        ways = inverse(arm, moved)
        away = np.nan_to_num(np.max(np.abs(ways - joints_rad[:, None]), axis=-1), nan=np.inf)
        nearest = ways[np.arange(len(ways)), np.argmin(away, axis=1)]
        found.append(np.abs(_axial(arm, stiffness, tool, nearest) / here - 1.0))
    return np.stack(found, axis=-1)


def _axial(
    arm: ArmKinematics, stiffness: FloatArray, tool: Tool, joints_rad: FloatArray
) -> FloatArray:
    """C_zz (N,) along the tool's own axis."""
    placed = frames(arm, joints_rad)
    contact = placed[:, -1] @ tool.matrix
    lever = np.einsum("nij,ni->nj", jacobian(placed, contact[:, :3, 3])[:, :3], contact[:, :3, 2])
    return np.asarray(np.sum(lever**2 / stiffness, axis=-1))
