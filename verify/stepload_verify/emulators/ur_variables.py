"""Variables a UR controller offers over RTDE: types, and the versions they came with."""

from __future__ import annotations

Version = tuple[int, int, int, int]

_OUTPUTS = {
    "DOUBLE": """timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum
        actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0
        standard_analog_input1 standard_analog_output0 standard_analog_output1 payload""",
    "VECTOR6D": """target_q target_qd target_qdd target_current target_moment actual_q actual_qd
        actual_current joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force
        target_TCP_pose target_TCP_speed joint_temperatures actual_joint_voltage
        actual_current_as_torque ft_raw_wrench payload_inertia tcp_offset""",
    "VECTOR3D": "actual_tool_accelerometer payload_cog",
    "UINT64": "actual_digital_input_bits actual_digital_output_bits",
    "UINT32": "runtime_state robot_status_bits safety_status_bits",
    "INT32": "robot_mode safety_mode",
    "VECTOR6INT32": "joint_mode",
}

Since = tuple[int, int]

# name: first CB3 and first e-Series version as (minor, bugfix); None: never there
_SINCE: dict[str, tuple[Since | None, Since]] = {
    "actual_current_as_torque": (None, (23, 0)),
    "ft_raw_wrench": (None, (9, 0)),
    "payload": ((11, 0), (5, 1)),
    "payload_cog": ((11, 0), (5, 1)),
    "payload_inertia": ((15, 0), (11, 0)),
    "tcp_offset": ((12, 0), (5, 1)),
}

OUTPUT_TYPES = {name: kind for kind, names in _OUTPUTS.items() for name in names.split()}
OUTPUT_TYPES |= {f"output_int_register_{i}": "INT32" for i in range(48)}
OUTPUT_TYPES |= {f"output_double_register_{i}": "DOUBLE" for i in range(48)}

INPUT_TYPES = {f"input_int_register_{i}": "INT32" for i in range(48)}
INPUT_TYPES |= {f"input_double_register_{i}": "DOUBLE" for i in range(48)}
INPUT_TYPES |= {"external_force_torque": "VECTOR6D"}


def output_type(name: str, version: Version) -> str:
    """RTDE type of output `name` on a controller of `version`, or NOT_FOUND."""
    cb3, e_series = _SINCE.get(name, ((0, 0), (0, 0)))
    since = cb3 if version[0] == 3 else e_series
    if version[0] == 10 and name.startswith("payload"):
        since = None
    if since is None or (version[0] < 10 and version[1:3] < since):
        return "NOT_FOUND"
    return OUTPUT_TYPES.get(name, "NOT_FOUND")
