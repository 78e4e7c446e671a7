"""The register handshake of the program that ur_rtde uploads, carried out once per control period.

Registers, command numbers and the ready/done rhythm are those of ur_rtde 1.6.5, see its
`RTDEControlInterface`. A command that is not emulated ends the program, as a script error would.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from stepload_verify.emulators.ur_robot import Robot

READY, DONE = 1, 2

SPEED_L, SERVO_L, STOP_SCRIPT = 10, 24, 255
REPEATED = {6, 9, SPEED_L, 11, SERVO_L, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71}
MOVE_L, MOVE_J_IK = 3, 2


class Registers:
    """Input and output registers of the controller; they outlive every connection."""

    def __init__(self) -> None:
        self.ints_in = [0] * 48
        self.doubles_in = [0.0] * 48
        self.ints_out = [0] * 48
        self.doubles_out = [0.0] * 48
        self.written = [False] * 48
        """Integer inputs written since the last control period (what a watchdog looks at)."""

    def write(self, name: str, value: float) -> None:
        """Store one input variable; names without a register are accepted and ignored."""
        stem, _, number = name.rpartition("_")
        if stem == "input_int_register":
            self.ints_in[int(number)] = int(value)
            self.written[int(number)] = True
        elif stem == "input_double_register":
            self.doubles_in[int(number)] = value


def register_offset(script: str) -> int:
    """0 or 24: where the uploaded program looks for its registers."""
    found = re.search(r"reg_offset_int = # int register offset\s+(\d+)", script)
    return int(found.group(1)) if found else 0


class ControlProgram:
    """ur_rtde's program between its start and its end."""

    def __init__(self, script: str, registers: Registers, robot: Robot) -> None:
        self._registers = registers
        self._robot = robot
        self._offset = register_offset(script)
        self._busy = False
        self._waiting: Callable[[], bool] | None = None
        self._operation = 0
        self._writes = 0
        self._async_running = False
        self.watchdog_hz = 0.0
        self.since_input = 0

    def begin(self) -> None:
        """What the uploaded program does first: clear the progress word, say that it is ready."""
        self._progress(None)
        self._reply(READY)

    def tick(self) -> bool:
        """One control period; False when the program has ended (by itself or its watchdog)."""
        self.since_input = 0 if self._registers.written[self._offset] else self.since_input + 1
        if self.watchdog_hz and self.since_input * self._robot.period_s > 1.0 / self.watchdog_hz:
            return False
        if self._async_running and not self._robot.moving:
            self._async_running = False
            self._progress(None)
        if self._waiting is not None:
            if self._waiting():
                self._waiting = None
                self._finish()
            return True
        command = self._registers.ints_in[self._offset]
        if command in REPEATED:
            self._act(command)
            self._reply(READY)
        elif command == 0:
            self._busy = False
            self._reply(READY)
        elif not self._busy:
            if command == STOP_SCRIPT:
                return False
            return self._carry_out(command)
        return True

    def _double(self, index: int) -> float:
        return self._registers.doubles_in[self._offset + index]

    def _doubles(self, first: int, count: int) -> tuple[float, ...]:
        start = self._offset + first
        return tuple(self._registers.doubles_in[start : start + count])

    def _reply(self, value: int) -> None:
        self._registers.ints_out[self._offset] = value

    def _finish(self) -> None:
        self._busy = True
        self._reply(DONE)

    def _progress(self, step: int | None) -> None:
        """Asynchronous progress word: bits 24–30 operation, 16–22 writes, 15 running, 0–14 step."""
        self._writes = (self._writes + 1) % 128
        word = self._operation << 24 | self._writes << 16
        if step is not None:
            word |= 1 << 15 | step
        self._registers.ints_out[self._offset + 2] = word

    def _act(self, command: int) -> None:
        if command == SERVO_L:
            self._robot.servo(self._doubles(0, 6))
        elif command == SPEED_L:
            self._robot.speed(self._doubles(0, 6))

    def _carry_out(self, command: int) -> bool:
        robot = self._robot
        if command in (MOVE_L, MOVE_J_IK):
            robot.move(self._doubles(0, 6), max(self._double(6), 1e-4))
            if self._registers.ints_in[self._offset + 1]:
                self._operation = (self._operation + 1) % 128
                self._async_running = True
                self._progress(0)
                self._finish()
            else:
                self._waiting = lambda: not robot.moving
            return True
        if command in (15, 16, 33, 34):  # speedStop, servoStop, stopL, stopJ
            robot.halt()
            self._waiting = lambda: abs(robot.speed_m_s) < 1e-3
            return True
        if command == 17:
            robot.payload_kg, robot.payload_cog = self._double(0), self._doubles(1, 3)
        elif command == 29:
            robot.tcp_offset = self._doubles(0, 6)
        elif command == 35:
            self.watchdog_hz = self._double(0)
            self.since_input = 0
        elif command == 36:
            self._registers.ints_out[self._offset + 1] = 1
        elif command == 40:
            start = self._offset
            self._registers.doubles_out[start : start + 6] = robot.tcp_offset
        elif command == 47:
            self._registers.ints_out[self._offset + 1] = int(abs(robot.speed_m_s) < 1e-4)
        elif command not in (4, 7, 8):  # stop forcing, zero the sensor: nothing to do here
            return False
        self._finish()
        return True


class UserScript:
    """A small program sent to a script port: `stopl`, and `movel` relative to where the target is.

    Only what a rescue needs is understood; any other motion statement ends it at once.
    """

    _MOVE = re.compile(
        r"movel\(pose_add\(get_target_tcp_pose\(\),\s*p\[([^\]]*)\]\),\s*a=([\d.e+-]+),"
        r"\s*v=([\d.e+-]+)\)"
    )

    def __init__(self, script: str, robot: Robot) -> None:
        self._robot = robot
        self._lines = [line.strip() for line in script.splitlines()[1:-1]]
        self._next = 0
        self._waiting: Callable[[], bool] | None = None

    def tick(self) -> bool:
        """One control period; False when the program has ended."""
        if self._waiting is not None:
            if self._waiting():
                self._waiting = None
            return True
        if self._next >= len(self._lines):
            return False
        line = self._lines[self._next]
        self._next += 1
        robot = self._robot
        if line.startswith("stopl("):
            robot.halt()
            self._waiting = lambda: abs(robot.speed_m_s) < 1e-3
        elif match := self._MOVE.match(line):
            step = [float(part) for part in match.group(1).split(",")]
            goal = tuple(p + s for p, s in zip(robot.told(robot.target), step, strict=True))
            robot.move(goal, float(match.group(3)))
            self._waiting = lambda: not robot.moving
        else:
            return False
        return True


Program = ControlProgram | UserScript
