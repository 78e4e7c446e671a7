"""Judges a force channel by a push by hand; pure functions.

A push by hand stands in for the plate: it pushes the tool away from where the plate is, so whatever
a channel reads during it is what it will read when the arm presses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import RefusedError
from stepload.estimators.fit import FloatArray
from stepload.rig.samples import SixFloats

AXES = ("fx", "fy", "fz")
LEAST_PUSH_N = 10.0
NOISE_TIMES = 12.0
"""Least size of a push in standard deviations of the noise of a channel."""
CROSS_TALK = 0.5
"""Share of the largest component that another may have: a push within 27 degrees of the axis."""
AGREE = 0.3
"""Share by which two channels may differ in what they read of one push."""


@dataclass(frozen=True, slots=True)
class Channel:
    """A force channel at rest in free air: mean and standard deviation of each component in N.

    Shape (3,) for a sensor, (1,) for a channel that says of itself what pressing is (an arm's own).
    """

    name: str
    mean_n: FloatArray
    sigma_n: FloatArray

    @property
    def least_push_n(self) -> float:
        """The smallest push in N that the channel detects reliably."""
        return max(LEAST_PUSH_N, NOISE_TIMES * float(self.sigma_n.max()))


@dataclass(frozen=True, slots=True)
class Proven:
    """What the pushes proved: `axis` as a rig file has it ("" for a channel of one component).

    `cross_talk` is the largest other component over that along the axis; `push_n` the mean push.
    """

    axis: str
    cross_talk: float
    push_n: float


def judged(channel: Channel, pushes: Sequence[FloatArray]) -> Proven:
    """Axis and sign of a channel from what it read during each push, less its rest.

    Args:
        pushes: change of the mean reading in N, one array of the channel's shape for each push.

    Raises:
        RefusedError: it did not feel a push, felt it along no one axis, or felt two differently.
    """
    found = [_axis_of(channel, push) for push in pushes]
    if len(set(found)) > 1:
        raise RefusedError(
            f"{channel.name}: the pushes disagree: {' and '.join(found)}",
            hint="push the same way each time, along the tool, and let go in between",
        )
    index = AXES.index(found[0][1:]) if channel.mean_n.size > 1 else 0
    along = np.array([abs(push[index]) for push in pushes])
    across = [np.abs(np.delete(push, index)).max(initial=0.0) for push in pushes]
    axis = found[0] if channel.mean_n.size > 1 else ""
    return Proven(axis, float(np.max(across / along)), float(along.mean()))


def _axis_of(channel: Channel, push: FloatArray) -> str:
    size = np.abs(push)
    order = np.argsort(size)[::-1]
    best = int(order[0])
    if size[best] < channel.least_push_n:
        raise RefusedError(
            f"{channel.name}: it read {size[best]:.1f} N of a push, at least"
            f" {channel.least_push_n:.1f} N are needed to tell it from its noise",
            hint="push harder; if the other channel felt it: this one is dead, wrongly scaled, or"
            " not between the hand and the arm",
        )
    if channel.mean_n.size == 1:
        if push[0] < 0.0:
            raise RefusedError(
                f"{channel.name}: it read {push[0]:+.1f} N, as if pulled towards the plate, while"
                " the tool was pushed away from it",
                hint="either the push went the wrong way or the approach direction or the sign of"
                " this channel is wrong: settle which one before you change any of them",
            )
        return "+"
    second = int(order[1])
    if size[second] > CROSS_TALK * size[best]:
        raise RefusedError(
            f"{channel.name}: the push shows on two components, {AXES[best]} {push[best]:+.1f} N"
            f" and {AXES[second]} {push[second]:+.1f} N: which one is the axis is not clear",
            hint="push along the tool; a sensor that is mounted askew cannot be used",
        )
    return ("-" if push[best] < 0.0 else "+") + AXES[best]


def agreed(one: tuple[str, float], other: tuple[str, float], tolerance_n: float) -> None:
    """Check that two channels read the same push alike, each given by name and mean push in N.

    Raises:
        RefusedError: they differ by more than `tolerance_n` and 30 % of the larger.
    """
    off_n = abs(one[1] - other[1])
    limit_n = tolerance_n + AGREE * max(one[1], other[1])
    if off_n > limit_n:
        raise RefusedError(
            f"{one[0]} read {one[1]:.1f} N and {other[0]} {other[1]:.1f} N of the same push, which"
            f" differ by more than {limit_n:.1f} N",
            hint="one of them has a wrong gain, unit or divider: compare each with a known weight",
        )


def rotation(pose: SixFloats) -> FloatArray:
    """Rotation matrix (3, 3) of a pose's rotation vector: tool coordinates to those of the base."""
    vector = np.array(pose[3:], dtype=float)
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: FloatArray = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return turned


def off_the_tool_rad(pose: SixFloats, approach: Sequence[float]) -> float:
    """Angle between the approach direction, base frame, and the z axis of the tool."""
    direction = np.array(approach, dtype=float)
    cosine = float(rotation(pose)[:, 2] @ direction / np.linalg.norm(direction))
    return math.acos(float(np.clip(cosine, -1.0, 1.0)))


def turned_rad(one: SixFloats, other: SixFloats) -> float:
    """Angle of the rotation from one pose to another, however their rotation vectors are written.

    One that turns by half a circle is written in two ways.
    """
    cosine = 0.5 * (float(np.sum(rotation(one) * rotation(other))) - 1.0)
    return math.acos(float(np.clip(cosine, -1.0, 1.0)))
