"""The configuration of an arm as texts of a record, and the difference of two poses.

The stiffness of a serial arm along its tool changes with its joints: K = 1/Σ (l_i²/k_i), with the
lever arms l_i of the force about the joints. Of 16,000 tool-down poses of four UR arms the change
of ln K, all joints off by the same angle the worst way round, is 1.2 to 1.5 per rad in the median
and 3.3 per rad at the most (docs/calibrate.md says what was assumed).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from stepload.rig.device import ArmConfiguration

STIFFNESS_PER_RAD = 3.4
"""Largest relative change of an arm's stiffness per rad of the largest joint difference."""
JOINT_TOLERANCE_RAD = 3e-3
"""Keeps the change of the stiffness below 1 %, which a good calibration knows it to."""
TCP_TOLERANCE_M, TCP_TOLERANCE_RAD = 1e-3, 3e-3
"""The TCP is a setting that is typed in: either the same one, or another."""

JOINTS, TCP = "arm_joints_rad", "arm_tcp_offset"
_PAYLOAD, _SPEED = "arm_payload_kg", "arm_speed_fraction"


def joint_distance_rad(one: Sequence[float], other: Sequence[float]) -> float:
    """Largest difference of a joint's angle; inf for another number of joints.

    A joint turned by whole turns stands where it stood.
    """
    if len(one) != len(other):
        return math.inf
    return max((abs(math.remainder(a - b, math.tau)) for a, b in zip(one, other, strict=True)),
               default=0.0)  # fmt: skip


def differences(one: ArmConfiguration, other: ArmConfiguration) -> list[str]:
    """Differences of two configurations beyond the tolerances; what is not reported is skipped.

    Each text gives the difference and the tolerance, `one` first.
    """
    found = []
    if one.joints_rad and other.joints_rad:
        off_rad = joint_distance_rad(one.joints_rad, other.joints_rad)
        if off_rad > JOINT_TOLERANCE_RAD:
            found.append(
                f"a joint is off by {math.degrees(off_rad):.2f}° "
                f"(allowed {math.degrees(JOINT_TOLERANCE_RAD):.2f}°)"
            )
    if other_tcp := _another_tcp(one, other):
        found.append(other_tcp)
    return found


def stiffness_change(one: ArmConfiguration, other: ArmConfiguration) -> float:
    """The share by which the stiffness may differ between two poses that differ; 1 at the most.

    It is 1 with another TCP, or where the joints are not reported.
    """
    if _another_tcp(one, other) or not (one.joints_rad and other.joints_rad):
        return 1.0
    return min(1.0, STIFFNESS_PER_RAD * joint_distance_rad(one.joints_rad, other.joints_rad))


def _another_tcp(one: ArmConfiguration, other: ArmConfiguration) -> str:
    """The difference of the TCPs; "" where there is none, or one of the two is not reported."""
    if not (one.tcp_offset and other.tcp_offset):
        return ""
    off_m = math.dist(one.tcp_offset[:3], other.tcp_offset[:3])
    turned_rad = math.dist(one.tcp_offset[3:], other.tcp_offset[3:])
    if off_m <= TCP_TOLERANCE_M and turned_rad <= TCP_TOLERANCE_RAD:
        return ""
    return f"the TCP is another one, off by {off_m * 1e3:.1f} mm and {turned_rad:.3f} rad"


def to_texts(stands: ArmConfiguration | None) -> dict[str, str]:
    """The arm's configuration as metadata of a record; empty where the arm reports none."""
    if stands is None:
        return {}
    told = {JOINTS: _text(stands.joints_rad), TCP: _text(stands.tcp_offset)}
    if stands.payload_kg is not None:
        told[_PAYLOAD] = repr(stands.payload_kg)
    if stands.speed_fraction is not None:
        told[_SPEED] = repr(stands.speed_fraction)
    return {key: text for key, text in told.items() if text}


def from_texts(told: Mapping[str, str]) -> ArmConfiguration | None:
    """The arm's configuration in a record; None where it is not stated, or not in numbers."""
    joints, tcp = _numbers(told.get(JOINTS, "")), _numbers(told.get(TCP, ""))
    offset = tcp if len(tcp) == 6 else None
    return ArmConfiguration(joints or None, offset) if joints or offset else None


def _text(numbers: Sequence[float] | None) -> str:
    return " ".join(repr(float(each)) for each in numbers or ())


def _numbers(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()
