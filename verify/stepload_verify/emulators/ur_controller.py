"""The emulated controller without its sockets: program, registers, safety, values, faults.

Assumptions, not knowledge: the program and the last inputs live on when RTDE clients go; a
protective stop pauses the program; registers are free as soon as their client is gone; a program
starts 80 ms after its upload; a safeguard release resumes it.
"""

from __future__ import annotations

import math

from stepload_verify.emulators.ur_faults import Faults
from stepload_verify.emulators.ur_program import ControlProgram, Program, Registers, UserScript
from stepload_verify.emulators.ur_robot import (
    NORMAL,
    PAUSED,
    PLAYING,
    POWER_OFF,
    PROTECTIVE,
    ROBOT_EMERGENCY,
    SAFEGUARD,
    STOPPED,
    Robot,
)
from stepload_verify.emulators.ur_session import Session, Value
from stepload_verify.emulators.ur_variables import INPUT_TYPES, OUTPUT_TYPES, Version

UPTIME_S = 1000.0


def value_of(name: str, robot: Robot, registers: Registers) -> Value:
    """Value of the RTDE output `name` now."""
    match name:
        case "timestamp":
            return UPTIME_S + robot.time_s
        case "actual_TCP_pose":
            return robot.pose
        case "target_TCP_pose":
            return robot.told(robot.target)
        case "actual_TCP_force" | "ft_raw_wrench":
            return robot.wrench
        case "actual_TCP_speed":
            return (*(robot.speed_m_s * d for d in robot.direction), 0.0, 0.0, 0.0)
        case "actual_q" | "target_q":
            return (robot.position_m, -math.pi / 2, math.pi / 2, 0.0, -math.pi / 2, 0.0)
        case "robot_mode":
            return robot.robot_mode
        case "safety_mode":
            return robot.safety_mode
        case "runtime_state":
            return robot.runtime_state
        case "robot_status_bits":
            return robot.status_bits
        case "safety_status_bits":
            return robot.safety_bits
        case "payload":
            return robot.payload_kg
        case "payload_cog":
            return robot.payload_cog
        case "tcp_offset":
            return robot.tcp_offset
        case "speed_scaling":
            return 1.0
        case "target_speed_fraction":
            return robot.slider
        case "actual_main_voltage" | "actual_robot_voltage":
            return 48.0
        case "joint_mode":
            return (253,) * 6
        case "joint_temperatures":
            return (30.0,) * 6
        case "actual_digital_input_bits" | "actual_digital_output_bits":
            return 0
        case "actual_tool_accelerometer":
            return (0.0, 0.0, -9.81)
    if name.startswith("output_int_register_"):
        return registers.ints_out[int(name.rpartition("_")[2])]
    if name.startswith("output_double_register_"):
        return registers.doubles_out[int(name.rpartition("_")[2])]
    return (0.0,) * 6 if OUTPUT_TYPES[name] == "VECTOR6D" else 0.0


START_DELAY_S = 0.08


class UrController:
    """One controller; `tick` is one control period.

    Args:
        robot: the arm and its physics.
        version: PolyScope version, major first.
        protective_stop_ends_program: the other reading of what a protective stop does.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        version: Version = (5, 12, 6, 0),
        serial_number: str = "20235500001",
        model: str = "UR5",
        protective_stop_ends_program: bool = False,
    ) -> None:
        self.robot = robot
        self.version = version
        self.serial_number = serial_number
        self.model = model
        self.loaded = ""
        self.rate_hz = 1.0 / robot.period_s
        self.faults = Faults()
        self.registers = Registers()
        self.sessions: list[Session] = []
        self.uploads = 0
        self.watchdog_trips = 0
        self._protective_stop_ends_program = protective_stop_ends_program
        self._program: Program | None = None
        self._loading: tuple[int, Program] | None = None

    @property
    def remote(self) -> bool:
        return not self.faults.local

    @property
    def runtime_state(self) -> int:
        return self.robot.runtime_state

    @property
    def safety_mode(self) -> int:
        return self.robot.safety_mode

    @property
    def robot_mode(self) -> int:
        return self.robot.robot_mode

    def tick(self) -> None:
        if self._loading is not None:
            left, program = self._loading
            if left > 0:
                self._loading = (left - 1, program)
            else:
                self._start(program)
        program_now = self._program
        if program_now is not None and self.runtime_state == PLAYING and not program_now.tick():
            if isinstance(program_now, ControlProgram) and program_now.since_input > 0:
                self.watchdog_trips += 1
            self.stop_program()
        self.registers.written = [False] * 48
        self.robot.tick()

    def upload(self, script: str) -> None:
        """A complete program arrived on a script port; ignored in local control or unsafe."""
        if not self.remote or not self.robot.can_move:
            return
        self.uploads += 1
        self.stop_program()
        program: Program
        if script.startswith("def rtde_control"):
            program = ControlProgram(script, self.registers, self.robot)
        else:
            program = UserScript(script, self.robot)
        self._loading = (round(START_DELAY_S * self.rate_hz), program)

    def _start(self, program: Program) -> None:
        self._loading = None
        self._program = program
        if isinstance(program, ControlProgram):
            program.begin()
        self.robot.runtime_state = PLAYING

    def stop_program(self) -> None:
        self._program = None
        self._loading = None
        self.robot.halt()
        self.robot.runtime_state = STOPPED

    def play(self) -> bool:
        if self._program is None or not self.robot.can_move or not self.remote:
            return False
        self.robot.runtime_state = PLAYING
        return True

    def unlock(self) -> None:
        if self.safety_mode == PROTECTIVE:
            self.robot.safety_mode = NORMAL

    def power(self, mode: int) -> None:
        if self.safety_mode == NORMAL:
            self.robot.robot_mode = mode

    def owner_of(self, name: str) -> object | None:
        first, last = self.faults.claimed
        number = name.rpartition("_")[2]
        if number.isdigit() and first <= int(number) <= last:
            return "another client"
        return next((s for s in self.sessions if name in s.registers), None)

    def write_input(self, name: str, value: Value) -> None:
        if INPUT_TYPES[name] != "VECTOR6D" and not isinstance(value, tuple):
            self.registers.write(name, value)

    def command(self, line: str) -> None:
        """One line as in `ur_faults.HELP`, those that concern connections left out.

        Raises:
            ValueError: not a command.
        """
        words = line.split()
        match words:
            case ["protective-stop"]:
                self._safety_stop(PROTECTIVE)
                if self._protective_stop_ends_program:
                    self.stop_program()
            case ["unlock"]:
                self.unlock()
            case ["emergency-stop"]:
                self._safety_stop(ROBOT_EMERGENCY)
                self.stop_program()
                self.robot.robot_mode = POWER_OFF
            case ["release"]:
                self.robot.safety_mode = NORMAL
            case ["safeguard", "on"]:
                self._safety_stop(SAFEGUARD)
            case ["safeguard", "off"]:
                self.robot.safety_mode = NORMAL
                if self._program is not None:
                    self.robot.runtime_state = PLAYING
            case ["kill-program"]:
                self.stop_program()
            case ["load", name]:
                self.loaded = name
            case ["push", x, y, z]:
                self.robot.tool.hand_n = (float(x), float(y), float(z))
            case ["lead", rx, ry, rz]:
                if self.runtime_state == PLAYING:
                    raise ValueError("lead: a program runs, the arm cannot be led by hand")
                self.robot.lead((float(rx), float(ry), float(rz)))
            case ["slider" | "payload" | "tcp", *numbers]:
                self._set(words[0], [float(number) for number in numbers])
            case _:
                if not self.faults.switch(words):
                    raise ValueError(f"unknown command {line!r}; `help` lists them")

    def _set(self, what: str, numbers: list[float]) -> None:
        """Act like a person at the pendant."""
        robot = self.robot
        match what, numbers:
            case "slider", [fraction] if 0.0 <= fraction <= 1.0:
                robot.slider = fraction
            case "payload", [mass_kg, *cog] if len(cog) in (0, 3):
                robot.payload_kg = mass_kg
                robot.payload_cog = tuple(cog) or robot.payload_cog
            case "tcp", [x, y, z]:
                robot.tcp_offset = (x, y, z, 0.0, 0.0, 0.0)
            case _:
                raise ValueError(f"{what}: slider 0 to 1, payload kg [x y z], or tcp x y z in m")

    def _safety_stop(self, mode: int) -> None:
        self.robot.safety_mode = mode
        self.robot.halt()
        if self._program is not None:
            self.robot.runtime_state = PAUSED

    def truth(self) -> dict[str, object]:
        """The true state, for tests and for the `state` command."""
        program = self._program
        axis = self.robot.axis.state()
        watchdog_hz = program.watchdog_hz if isinstance(program, ControlProgram) else 0.0
        return {
            "time_s": self.robot.time_s,
            "position_m": self.robot.position_m,
            "target_m": self.robot.travel_of(self.robot.target),
            "speed_m_s": self.robot.speed_m_s,
            "force_n": axis.force_n,
            "contact_n": axis.contact_n,
            "peak_n": axis.peak_n,
            "moving": self.robot.moving,
            "runtime_state": self.runtime_state,
            "watchdog_hz": watchdog_hz,
            "watchdog_trips": self.watchdog_trips,
            "uploads": self.uploads,
            "clients": len(self.sessions),
        }

    def value(self, name: str) -> Value:
        """Value of one RTDE output now."""
        return value_of(name, self.robot, self.registers)
