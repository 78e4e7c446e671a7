"""What the emulated controller sends as the value of each RTDE output."""

from __future__ import annotations

import math

from stepload_verify.emulators.ur_program import Registers
from stepload_verify.emulators.ur_robot import Robot
from stepload_verify.emulators.ur_session import Value
from stepload_verify.emulators.ur_variables import OUTPUT_TYPES

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
