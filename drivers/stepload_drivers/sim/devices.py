"""The drivers called `sim`: devices of a simulated rig in real time, configured by a plan.

Devices with the same `world` option share one world of this process; it begins when the first of
them is opened and ends when the last is closed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from stepload.rig.options import Option
from stepload.rig.world import PayloadTruth
from stepload_drivers.options import values
from stepload_drivers.sim import live
from stepload_drivers.sim.arm import WorldArm
from stepload_drivers.sim.sensors import WorldDisplacementSensor, WorldForceSensor

_WORLD = Option("text", "name of the simulated world to live in", default="sim")


def _length(help_text: str, default: float, low: float = 0.0) -> Option:
    return Option("quantity", help_text, unit="m", default=default, low=low)


def _force(help_text: str, default: float) -> Option:
    return Option("quantity", help_text, unit="N", default=default, low=0.0)


def _time(help_text: str, default: float) -> Option:
    return Option("quantity", help_text, unit="s", default=default, low=0.0)


def _rate(default: float) -> Option:
    return Option("quantity", "sample rate", unit="Hz", default=default, low=1.0, high=8000.0)


class SimArm(WorldArm):
    """A simulated arm with its payload, in real time."""

    OPTIONS: ClassVar[Mapping[str, Option]] = {
        "world": _WORLD,
        "seed": Option("integer", "seed of the noise", default=0, low=0),
        "rate": _rate(1000.0),
        "surface": _length("travel at which the payload is touched", 2e-3),
        "payload_k": Option("number", "K of the payload in N/m^n", default=6.57e8, low=1.0),
        "payload_n": Option("number", "n of the payload", default=1.5, low=1.0, high=10.0),
        "system_stiffness": Option(
            "quantity", "K_s", unit="N/m", default=3.49e6, low=1.0, high=1e12
        ),
        "mass": Option("quantity", "effective mass", unit="kg", default=20.0, low=1e-3),
        "command_delay": _time("from command to start of motion", 0.002),
        "lag": _time("first-order lag of the servo", 0.004),
        "max_push": _force("largest force along the axis", 1000.0),
        "position_quantum": _length("resolution of the measured position", 2e-6),
        "has_force": Option("boolean", "whether the arm estimates the force", default=True),
        "force_noise": _force("noise of the arm's own force", 3.0),
    }

    def __init__(self, **options: Any) -> None:
        told = values(self.OPTIONS, options)
        stiffness, mass = told["system_stiffness"], told["mass"]
        truth = {
            "seed": told["seed"],
            "arm_rate_hz": told["rate"],
            "surface_m": told["surface"],
            "payload": PayloadTruth("smooth", told["payload_k"], told["payload_n"]),
            "system_stiffness_n_per_m": stiffness,
            "system_damping_n_s_per_m": live.damping(stiffness, mass),
            "effective_mass_kg": mass,
            "command_delay_s": told["command_delay"],
            "lag_s": told["lag"],
            "max_push_n": told["max_push"],
            "position_quantum_m": told["position_quantum"],
            "arm_has_force": told["has_force"],
            "arm_force_noise_n": told["force_noise"],
        }
        super().__init__(live.Lease(told["world"], truth))


class SimForceSensor(WorldForceSensor):
    """A simulated force sensor, in real time."""

    OPTIONS: ClassVar[Mapping[str, Option]] = {
        "world": _WORLD,
        "second": Option("boolean", "whether this is the second force sensor", default=False),
        "rate": _rate(1000.0),
        "axis": Option(
            "text",
            "wrench component that is positive when pressing",
            default="+fz",
            choices=("+fx", "-fx", "+fy", "-fy", "+fz", "-fz"),
        ),
        "noise": _force("standard deviation of the noise", 0.1),
        "quantum": _force("resolution", 0.05),
        "delay": _time("from force to sample on the host", 0.002),
        "range": _force("rated force", 1000.0),
        "bias": Option("quantity", "reading in free air", unit="N", default=5.0),
    }

    def __init__(self, **options: Any) -> None:
        told = values(self.OPTIONS, options)
        second = told["second"]
        prefix = "second_force" if second else "force"
        truth = {
            f"{prefix}_rate_hz": told["rate"],
            f"{prefix}_axis": told["axis"],
            f"{prefix}_noise_n": told["noise"],
            f"{prefix}_quantum_n": told["quantum"],
            f"{prefix}_delay_s": told["delay"],
            f"{prefix}_range_n": told["range"],
        }
        if not second:
            truth["start_force_bias_n"] = told["bias"]
        super().__init__(live.Lease(told["world"], truth), second=second)


class SimDisplacementSensor(WorldDisplacementSensor):
    """A simulated gauge across the contact, in real time."""

    OPTIONS: ClassVar[Mapping[str, Option]] = {
        "world": _WORLD,
        "rate": _rate(100.0),
        "noise": _length("standard deviation of the noise", 0.1e-6),
        "quantum": _length("resolution", 0.1e-6),
    }

    def __init__(self, **options: Any) -> None:
        told = values(self.OPTIONS, options)
        truth = {
            "gauge_rate_hz": told["rate"],
            "gauge_noise_m": told["noise"],
            "gauge_quantum_m": told["quantum"],
        }
        super().__init__(live.Lease(told["world"], truth))
