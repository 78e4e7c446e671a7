"""State reported by the controller, and its meaning: on one data package, and over several.

State words: Universal Robots, RTDE guide (`runtime_state`, `safety_mode`, `safety_status_bits`).
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from stepload.errors import DeviceError
from stepload.rig.device import Health
from stepload.rig.faults import FaultCode
from stepload_drivers.motion import NO_SHIFT, Shift

Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]

STOPPED, PLAYING, PAUSED = 1, 2, 4
ROBOT_RUNNING = 7
PAUSING = (3, 4)
"""Values of `runtime_state` while a program is being paused, or is."""

REACH_M = 5.0
FORCE_LIMIT_N = 5000.0
TORQUE_LIMIT_NM = 5000.0
STILL_S, STILL_M = 0.04, 5e-5

VARIABLES = [
    "timestamp",
    "actual_TCP_pose",
    "actual_TCP_force",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "safety_status_bits",
]


class UrState(NamedTuple):
    """One data package, the variables of `VARIABLES` in their order."""

    timestamp_s: float
    pose: Vector6
    wrench: Vector6
    robot_mode: int
    safety_mode: int
    runtime_state: int
    safety_bits: int


class Problem(NamedTuple):
    """A finding: code for programs, what is wrong, what to do."""

    code: FaultCode
    message: str
    hint: str

    def error(self, where: str = "") -> DeviceError:
        return DeviceError(f"{where}{self.message}", code=self.code, hint=self.hint)


_STOPS = (
    (
        1 << 5 | 1 << 6 | 1 << 7, (6, 7), FaultCode.EMERGENCY_STOP, "emergency stop",
        "find the cause, release the button, power on and release the brakes, then start anew",
    ),
    (
        1 << 2, (3,), FaultCode.PROTECTIVE_STOP, "protective stop",
        "look at the arm, unlock on the pendant, move it clear by hand, then start anew",
    ),
    (
        1 << 4, (5, 12, 13), FaultCode.SAFEGUARD_STOP, "safeguard stop",
        "close the guard and reset it; the run does not go on by itself",
    ),
    (
        1 << 3 | 1 << 8 | 1 << 9 | 1 << 10, (4, 8, 9), FaultCode.DEVICE_REPORTS,
        "stop of the safety system", "read the log on the pendant",
    ),
)  # fmt: skip
"""Stops, the gravest first: `safety_status_bits`, values of `safety_mode`, what it is."""


def data_problem(state: UrState) -> Problem | None:
    """Why the values of the package are impossible, so that none of them may be used."""
    numbers = (state.timestamp_s, *state.pose, *state.wrench)
    if not all(map(math.isfinite, numbers)):
        return Problem(
            FaultCode.NOT_FINITE,
            "the controller sends values that are not finite",
            "check the network and the controller's software version",
        )
    checks = (
        ("TCP position", max(map(abs, state.pose[:3])), REACH_M, "m"),
        ("TCP rotation", math.hypot(*state.pose[3:]), 3 * math.pi, "rad"),
        ("TCP force", max(map(abs, state.wrench[:3])), FORCE_LIMIT_N, "N"),
        ("TCP torque", max(map(abs, state.wrench[3:])), TORQUE_LIMIT_NM, "N·m"),
        ("runtime_state", abs(state.runtime_state - 2.5), 2.5, ""),
        ("robot_mode", abs(state.robot_mode - 5), 6, ""),
        ("safety_mode", abs(state.safety_mode - 10), 10, ""),
    )
    for name, value, limit, unit in checks:
        if value > limit:
            return Problem(
                FaultCode.OUT_OF_RANGE,
                f"{name} out of range: {value:g} {unit}, limit {limit:g} {unit}",
                "check the network and the controller's software version",
            )
    return None


def safety_problem(state: UrState) -> Problem | None:
    """The stop of the controller's safety system or drives that is in force, None for none."""
    for bits, modes, code, what, hint in _STOPS:
        if state.safety_bits & bits or state.safety_mode in modes:
            words = f"safety_mode {state.safety_mode}, status bits {state.safety_bits:#x}"
            return Problem(code, f"{what} ({words})", hint)
    if state.robot_mode != ROBOT_RUNNING:
        return Problem(
            FaultCode.DEVICE_REPORTS,
            f"the arm is not running (robot_mode {state.robot_mode})",
            "power on and release the brakes on the pendant",
        )
    return None


def can_move(state: UrState) -> bool:
    """Whether the program runs and no stop is in force."""
    return state.runtime_state == PLAYING and safety_problem(state) is None


def travel_m(pose: Vector6, start: Vector6, approach: tuple[float, float, float]) -> float:
    """Travel from `start` along the unit vector `approach`."""
    return sum((pose[i] - start[i]) * approach[i] for i in range(3))


def pressing_wrench(wrench: Vector6, axes: tuple[Vector3, ...], wrench_sign: str) -> Vector6:
    """The controller's wrench (base frame) along the axes of the pressing frame, as the tip's on
    the plate: component 3 is the force along the approach, positive when pressing."""
    sign = -1.0 if wrench_sign == "reaction" else 1.0
    fx, fy, fz, tx, ty, tz = wrench
    force_n, torque_n_m = (
        [sign * (a * x + b * y + c * z) for a, b, c in axes]
        for x, y, z in ((fx, fy, fz), (tx, ty, tz))
    )
    return (force_n[0], force_n[1], force_n[2], torque_n_m[0], torque_n_m[1], torque_n_m[2])


def pressing_axes(approach: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Axes 1, 2 and 3 of the pressing frame in the base."""
    return (*tangents(approach), approach)


def tangents(approach: Vector3) -> tuple[Vector3, Vector3]:
    """Axes 1 and 2 of the pressing frame in the base, of the unit vector `approach`."""
    a, b, c = approach
    guide = (0.0, 1.0, 0.0) if abs(b) < 0.9 else (0.0, 0.0, 1.0)
    slope = sum(g * part for g, part in zip(guide, approach, strict=True))
    x, y, z = (g - slope * part for g, part in zip(guide, approach, strict=True))
    length = math.hypot(x, y, z)
    x, y, z = x / length, y / length, z / length
    return (y * c - z * b, z * a - x * c, x * b - y * a), (x, y, z)


def target_pose(
    start: Vector6, approach: Vector3, position_m: float, shift_m: Shift = NO_SHIFT
) -> list[float]:
    """The pose with this travel along and across from `start`, orientation kept."""
    place = [start[i] + approach[i] * position_m for i in range(3)]
    if shift_m != NO_SHIFT:
        one, other = tangents(approach)
        place = [place[i] + one[i] * shift_m[0] + other[i] * shift_m[1] for i in range(3)]
    return place + list(start[3:])


def shift_of(pose: Vector6, start: Vector6, approach: Vector3) -> Shift:
    """Travel across the approach from `start`."""
    one, other = tangents(approach)
    return travel_m(pose, start, one), travel_m(pose, start, other)


def arrived_m(distance_m: float) -> float:
    """Travel back from which a retract by `distance_m` counts as done: servo error allowed for."""
    return max(0.5 * distance_m, 0.95 * distance_m - 1e-4)


class PacketCounter:
    """Sequence numbers and gaps from the controller's own time stamps.

    `period_s` is the controller's; a package is lost for every period without a stamp.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._first_s = math.nan
        self._last_s = math.nan
        self._received_s = -math.inf
        self._sequence = -1
        self._received = 0
        self._lost = 0
        self._gaps = 0
        self._longest_gap_s = 0.0

    def add(self, stamp_s: float, receive_time_s: float) -> int:
        """Sequence number of a package: periods since the first, never twice the same."""
        self._received += 1
        self._received_s = receive_time_s
        if self._sequence < 0:
            self._first_s = self._last_s = stamp_s
            self._sequence = 0
            return 0
        periods = round((stamp_s - self._first_s) / self._period_s)
        sequence = max(periods, self._sequence + 1)
        missing = sequence - self._sequence - 1
        self._lost += missing
        self._gaps += missing > 0
        self._longest_gap_s = max(self._longest_gap_s, stamp_s - self._last_s)
        self._sequence, self._last_s = sequence, stamp_s
        return sequence

    def health(self, now_s: float) -> Health:
        span_s = self._last_s - self._first_s
        return Health(
            received=self._received,
            lost=self._lost,
            rate_hz=(self._received - 1) / span_s if span_s > 0.0 else 0.0,
            age_s=now_s - self._received_s,
            longest_gap_s=self._longest_gap_s,
            errors={"gaps": self._gaps},
        )


class Standstill:
    """Whether the measured TCP stood still during the last `STILL_S` of controller time."""

    def __init__(self) -> None:
        self._window: deque[UrState] = deque()

    def add(self, state: UrState) -> None:
        self._window.append(state)
        while state.timestamp_s - self._window[0].timestamp_s > STILL_S + 0.02:
            self._window.popleft()

    @property
    def still(self) -> bool:
        """Whether no coordinate moved by more than `STILL_M` in a full window."""
        window = self._window
        if not window or window[-1].timestamp_s - window[0].timestamp_s < STILL_S:
            return False
        spans = zip(*(state.pose[:3] for state in window), strict=True)
        return all(max(span) - min(span) <= STILL_M for span in spans)
