"""The dashboard server (TCP 29999): one line in, one line out."""

from __future__ import annotations

from typing import Protocol

from stepload_verify.emulators.ur_robot import (
    NORMAL,
    PAUSED,
    PLAYING,
    PROTECTIVE,
    ROBOT_EMERGENCY,
    SAFEGUARD,
    STOPPED,
)

GREETING = "Connected: Universal Robots Dashboard Server\n"

_SAFETY = {
    NORMAL: "NORMAL",
    PROTECTIVE: "PROTECTIVE_STOP",
    SAFEGUARD: "SAFEGUARD_STOP",
    ROBOT_EMERGENCY: "ROBOT_EMERGENCY_STOP",
}
_PROGRAM = {STOPPED: "STOPPED", PLAYING: "PLAYING", PAUSED: "PAUSED"}
_MODES = {3: "POWER_OFF", 5: "IDLE", 7: "RUNNING"}


class Panel(Protocol):
    """Operations of the controller that the dashboard uses."""

    version: tuple[int, int, int, int]
    serial_number: str
    model: str
    loaded: str

    @property
    def remote(self) -> bool: ...
    @property
    def runtime_state(self) -> int: ...
    @property
    def safety_mode(self) -> int: ...
    @property
    def robot_mode(self) -> int: ...
    def stop_program(self) -> None: ...
    def play(self) -> bool: ...
    def unlock(self) -> None: ...
    def power(self, mode: int) -> None: ...


def answer(panel: Panel, line: str) -> str:
    """Reply to one command, without the line end."""
    e_series_56 = panel.version[:2] >= (5, 6)
    cb3_312 = panel.version[0] == 3 and panel.version[1] >= 12
    match line.strip().lower():
        case "polyscopeversion":
            return "URSoftware {}.{}.{}.{} (Jan 01 2024)".format(*panel.version)
        case "get serial number" if e_series_56 or cb3_312:
            return panel.serial_number
        case "get robot model" if e_series_56 or cb3_312:
            return panel.model
        case "is in remote control" if e_series_56:
            return str(panel.remote).lower()
        case "stop":
            panel.stop_program()
            return "Stopped"
        case "play":
            return "Starting program" if panel.play() else "Failed to execute: play"
        case "running":
            return f"Program running: {str(panel.runtime_state == PLAYING).lower()}"
        case "programstate":
            return f"{_PROGRAM[panel.runtime_state]} {panel.loaded or '<unnamed>'}"
        case "get loaded program":
            return f"Loaded program: {panel.loaded}" if panel.loaded else "No program loaded"
        case "robotmode":
            return f"Robotmode: {_MODES[panel.robot_mode]}"
        case "safetymode":
            return f"Safetymode: {_SAFETY[panel.safety_mode]}"
        case "safetystatus":
            return f"Safetystatus: {_SAFETY[panel.safety_mode]}"
        case "unlock protective stop":
            panel.unlock()
            return "Protective stop releasing"
        case "power on":
            panel.power(5)
            return "Powering on"
        case "brake release":
            panel.power(7)
            return "Brake releasing"
        case "close safety popup":
            return "closing safety popup"
    return f'could not understand: "{line.strip()}"'
