"""The emulated robot: modes, safety, motion of the TCP. Kinematics are deliberately crude.

Motion along the approach direction goes through an `Axis` (lag, contact), and motion across it too
where that axis is of a rig with six. Otherwise that follows its command at once, as all rotation
does. Like encoders on motors, the pose shows the drives and not what gives way behind them. Joints
show the travel on joint 1 and nothing else.

What is set shows where it would: a TCP moves the pose that is told and the flange that a pose asks
for, a payload other than the true one stands in the wrench as its missing or surplus weight, and
the speed slider slows every motion. `target` is where the TCP of offset zero is to go.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from stepload_verify.emulators.physics import Tool
from stepload_verify.emulators.ur_world import Axis

Vector = tuple[float, ...]


class PressFrame:
    """Axis 3 along the approach direction; axis 2 the base's y, as far as it lies across.

    With the tool down that is the frame of the tool: axis 1 the base's -x, axis 2 its y.
    """

    def __init__(self, direction: Vector) -> None:
        length = math.hypot(*direction)
        along = tuple(part / length for part in direction)
        guide = (0.0, 1.0, 0.0) if abs(along[1]) < 0.9 else (0.0, 0.0, 1.0)
        slope = _dot(guide, along)
        second = [g - slope * a for g, a in zip(guide, along, strict=True)]
        length = math.hypot(*second)
        second = [part / length for part in second]
        (a, b, c), (x, y, z) = second, along
        self.axes: tuple[Vector, Vector, Vector] = (
            (b * z - c * y, c * x - a * z, a * y - b * x),
            tuple(second),
            along,
        )

    def to_base(self, vector: Vector) -> Vector:
        return tuple(
            sum(part * axis[i] for part, axis in zip(vector, self.axes, strict=True))
            for i in range(3)
        )

    def across(self, vector: Vector) -> tuple[float, float]:
        """Components of a vector of the base along axes 1 and 2."""
        return _dot(self.axes[0], vector), _dot(self.axes[1], vector)


def _dot(one: Vector, other: Vector) -> float:
    return sum(a * b for a, b in zip(one, other, strict=True))


STOPPED, PLAYING, PAUSED = 1, 2, 4
POWER_OFF, IDLE, RUNNING = 3, 5, 7
NORMAL, PROTECTIVE, SAFEGUARD, ROBOT_EMERGENCY = 1, 3, 5, 7

HOME: Vector = (0.4, -0.13, 0.3, 0.0, math.pi, 0.0)
TOOL_DOWN = (-1.0, 1.0, -1.0)
"""Effect of the rotation of `HOME` on the axes of the tool, assumed constant."""
GRAVITY_M_S2 = 9.81

_SAFETY_BITS = {
    NORMAL: 1 << 0,
    PROTECTIVE: 1 << 2 | 1 << 10,
    SAFEGUARD: 1 << 4 | 1 << 10,
    ROBOT_EMERGENCY: 1 << 6 | 1 << 7 | 1 << 10,
}


def unit(direction: Vector) -> Vector:
    """`direction` at length 1."""
    length = math.hypot(*direction)
    return tuple(component / length for component in direction)


class Robot:
    """State of the arm; `tick` lets one control period pass.

    Args:
        axis: physics along `direction`.
        direction: approach direction in the base frame; any length.
        period_s: control period.
        tool: what acts on the tool beside the contact; its weight is the payload that is set.
    """

    def __init__(
        self, axis: Axis, direction: Vector, period_s: float, tool: Tool | None = None
    ) -> None:
        self.axis = axis
        self.tool = tool or Tool()
        self.direction = unit(direction)
        self._frame = PressFrame(direction)
        self.period_s = period_s
        self.time_s = 0.0
        self.runtime_state = STOPPED
        self.robot_mode = RUNNING
        self.safety_mode = NORMAL
        self.target: Vector = HOME
        self.speed_m_s = 0.0
        self.tcp_offset: Vector = (0.0,) * 6
        self.payload_kg = 0.0
        self.payload_cog: Vector = (0.0,) * 3
        self.tool_kg = 0.0
        self.slider = 1.0
        self._motion: Callable[[], bool] | None = None
        self._position_m = 0.0

    @property
    def can_move(self) -> bool:
        return self.safety_mode == NORMAL and self.robot_mode == RUNNING

    @property
    def moving(self) -> bool:
        """Whether a motion is not finished yet."""
        return self._motion is not None

    @property
    def safety_bits(self) -> int:
        return _SAFETY_BITS[self.safety_mode]

    @property
    def status_bits(self) -> int:
        on = self.robot_mode in (IDLE, RUNNING)
        return int(on) | int(self.runtime_state == PLAYING) << 1

    @property
    def position_m(self) -> float:
        return self._position_m

    @property
    def pose(self) -> Vector:
        """Measured TCP pose: the target with its travel replaced by the axis's."""
        return self.told(self._measured)

    @property
    def _measured(self) -> Vector:
        missing_m = self._position_m - self.travel_of(self.target)
        there = [t + missing_m * d for t, d in zip(self.target, self.direction, strict=False)]
        if (shift_m := self.axis.state().shift_m) is not None:
            requested = self._across(self.target)
            aside = (shift_m[0] - requested[0], shift_m[1] - requested[1], 0.0)
            there = [t + m for t, m in zip(there, self._frame.to_base(aside), strict=True)]
        return (*there, *self.target[3:])

    def _across(self, pose: Vector) -> tuple[float, float]:
        """Travel of a pose across the approach direction."""
        return self._frame.across(tuple(p - h for p, h in zip(pose[:3], HOME, strict=False)))

    def told(self, pose: Vector) -> Vector:
        """A pose of the TCP as it is set, from one of the TCP of offset zero."""
        return (*(p + s for p, s in zip(pose[:3], self._shift, strict=True)), *pose[3:])

    def requested(self, pose: Vector) -> Vector:
        """Inverse of `told`."""
        return (*(p - s for p, s in zip(pose[:3], self._shift, strict=True)), *pose[3:])

    @property
    def _shift(self) -> Vector:
        return tuple(o * t for o, t in zip(self.tcp_offset, TOOL_DOWN, strict=False))

    @property
    def wrench(self) -> Vector:
        """Force the environment exerts on the tool, base frame (the sign is an assumption)."""
        state = self.axis.state()
        load = state.wrench or (0.0, 0.0, state.force_n, 0.0, 0.0, 0.0)
        x, y, z = (-part for part in self._frame.to_base(load[:3]))
        tx, ty, tz = (-part for part in self._frame.to_base(load[3:]))
        surplus_n = (self.payload_kg - self.tool_kg) * GRAVITY_M_S2
        hand = self.tool.hand_n
        return (x + hand[0], y + hand[1], z + hand[2] + surplus_n, tx, ty, tz)

    def travel_of(self, pose: Vector) -> float:
        return sum((p - h) * d for p, h, d in zip(pose, HOME, self.direction, strict=False))

    def lead(self, turned: Vector) -> None:
        """The tool is turned by hand, as in freedrive; it keeps its place."""
        self.halt()
        self.target = (*self.target[:3], *turned)
        self.tool.turned = turned

    def servo(self, pose: Vector) -> None:
        """Follow one target for ever."""

        def follow() -> bool:
            goal = self.requested(pose)
            self.target = tuple(
                t + self.slider * (g - t) for t, g in zip(self.target, goal, strict=True)
            )
            return False

        self._motion = follow

    def speed(self, twist: Vector) -> None:
        """Move at a constant twist for ever."""

        def go_on() -> bool:
            self.target = tuple(
                t + v * self.slider * self.period_s for t, v in zip(self.target, twist, strict=True)
            )
            return False

        self._motion = go_on

    def move(self, pose: Vector, speed_m_s: float) -> None:
        """Straight line to `pose` at `speed_m_s`; ends by itself."""
        pose = self.requested(pose)

        def approach() -> bool:
            left = [goal - t for goal, t in zip(pose[:3], self.target, strict=False)]
            distance_m = math.hypot(*left)
            step_m = speed_m_s * self.slider * self.period_s
            if distance_m <= step_m:
                self.target = pose
                return abs(self.travel_of(pose) - self._position_m) < 2e-5
            share = step_m / distance_m
            moved = (t + share * gap for t, gap in zip(self.target, left, strict=False))
            self.target = (*moved, *self.target[3:])
            return False

        self._motion = approach

    def halt(self) -> None:
        """Stop where the arm is and hold."""
        self.target = self._measured
        self._motion = None
        self._command(self._position_m)

    def _command(self, position_m: float) -> None:
        self.axis.command(position_m)
        if self.axis.state().shift_m is not None:
            self.axis.command_shift(*self._across(self.target))

    def tick(self) -> None:
        """One control period."""
        if self._motion is not None and self.can_move and self._motion():
            self._motion = None
        self._command(self.travel_of(self.target))
        self.time_s += self.period_s
        self.axis.advance_to(self.time_s)
        before_m, self._position_m = self._position_m, self.axis.state().position_m
        self.speed_m_s = (self._position_m - before_m) / self.period_s
