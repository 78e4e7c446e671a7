"""ROS 2 messages that a record does not hold: the tared wrench, and the pose of the tool."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stepload.record.layout import HEADER, KINDS, MESSAGE_HEAD, RECORD_HEAD, STREAMS, Topic
from stepload.rig.samples import Number

_SEPARATOR = "=" * 80 + "\n"
_POSE = (
    "std_msgs/Header header\ngeometry_msgs/Pose pose\n"
    + HEADER
    + _SEPARATOR
    + "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n"
    + "geometry_msgs/Quaternion orientation\n"
    + _SEPARATOR
    + "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    + _SEPARATOR
    + "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
)
_RAW = STREAMS["force"].topics[0]
TARED = Topic(0, "/force/tared", _RAW.schema, _RAW.definition, _RAW.fields, "force")
POSE = Topic(
    0,
    "/arm/pose",
    "geometry_msgs/msg/PoseStamped",
    _POSE,
    dict.fromkeys(("x", "y", "z", "qx", "qy", "qz", "qw"), KINDS[Number]),
    "base",
)


def wrench_message(time_ns: int, wrench: Sequence[float]) -> bytes:
    """A geometry_msgs/WrenchStamped in CDR."""
    return _message(TARED, time_ns, wrench)


def pose_message(time_ns: int, pose: Sequence[float]) -> bytes:
    """A geometry_msgs/PoseStamped in CDR of x, y, z in m and a rotation vector in rad."""
    return _message(POSE, time_ns, (*pose[:3], *quaternion(pose[3:])))


def quaternion(rotation_rad: Sequence[float]) -> tuple[float, float, float, float]:
    """(x, y, z, w) of a rotation vector."""
    angle = math.hypot(*rotation_rad)
    share = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    x, y, z = (share * each for each in rotation_rad)
    return x, y, z, math.cos(0.5 * angle)


def _message(topic: Topic, time_ns: int, numbers: Sequence[float]) -> bytes:
    record = np.frombuffer(bytearray(topic.template()), topic.dtype)
    record["stamp_s"], record["stamp_ns"] = divmod(time_ns, 10**9)
    record["words"] = np.asarray(numbers, np.float64).view(np.uint64)
    return record.tobytes()[RECORD_HEAD + MESSAGE_HEAD :]
