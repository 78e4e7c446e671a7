"""The drivers called `sim`: devices of a simulated rig in real time, configured by a plan.

Devices with the same `world` option share one world of this process; it begins when the first of
them is opened and ends when the last is closed.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Axis, Flag, Setting, Verbatim, number
from stepload.declaration.sections import SECTION, key
from stepload.rig.world import PayloadTruth
from stepload_drivers.sim import live
from stepload_drivers.sim.arm import WorldArm
from stepload_drivers.sim.sensors import WorldDisplacementSensor, WorldForceSensor

_World = Annotated[Verbatim, key("name of the simulated world to live in")]
_Length = Annotated[float, Setting("m", 0.0, 10.0)]
_Force = Annotated[float, Setting("N", 0.0, 1e6)]
_Delay = Annotated[float, Setting("s", 0.0, 10.0)]
_Rate = Annotated[float, Setting("Hz", 1.0, 8000.0), key("sample rate")]


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SimArmOptions:
    """Options of the simulated arm and its payload."""

    world: _World = "sim"
    seed: Annotated[int, number(0, 2**31 - 1), key("seed of the noise")] = 0
    rate_hz: _Rate = 1000.0
    surface_m: Annotated[_Length, key("travel at which the payload is touched")] = 2e-3
    payload_k: Annotated[
        float, number(1.0, 1e30), key("K of the payload in N/m^n", alias="payload_k")
    ] = 6.57e8
    payload_n: Annotated[float, number(1.0, 10.0), key("n of the payload", alias="payload_n")] = 1.5
    system_stiffness_n_per_m: Annotated[float, Setting("N/m", 1.0, 1e12), key("K_s")] = 3.49e6
    mass_kg: Annotated[float, Setting("kg", 1e-3, 1e4), key("effective mass")] = 20.0
    command_delay_s: Annotated[_Delay, key("from command to start of motion")] = 0.002
    lag_s: Annotated[_Delay, key("first-order lag of the servo")] = 0.004
    max_push_n: Annotated[_Force, key("largest force along the axis")] = 1000.0
    position_quantum_m: Annotated[_Length, key("resolution of the measured position")] = 2e-6
    has_force: Annotated[Flag, key("whether the arm estimates the force")] = True
    force_noise_n: Annotated[_Force, key("noise of the arm's own force")] = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SimForceOptions:
    """Options of the simulated force sensor."""

    world: _World = "sim"
    second: Annotated[Flag, key("whether this is the second force sensor")] = False
    rate_hz: _Rate = 1000.0
    axis: Annotated[Axis, key("wrench component that is positive when pressing")] = "+fz"
    noise_n: Annotated[_Force, key("standard deviation of the noise")] = 0.1
    quantum_n: Annotated[_Force, key("resolution")] = 0.05
    delay_s: Annotated[_Delay, key("from force to sample on the host")] = 0.002
    range_n: Annotated[_Force, key("rated force")] = 1000.0
    bias_n: Annotated[float, Setting("N", -1e6, 1e6), key("reading in free air")] = 5.0


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SimGaugeOptions:
    """Options of the simulated gauge."""

    world: _World = "sim"
    rate_hz: _Rate = 100.0
    noise_m: Annotated[_Length, key("standard deviation of the noise")] = 0.1e-6
    quantum_m: Annotated[_Length, key("resolution")] = 0.1e-6


class SimArm(WorldArm):
    """A simulated arm with its payload, in real time."""

    OPTIONS: ClassVar[type] = SimArmOptions

    def __init__(self, **options: Any) -> None:
        told = SimArmOptions(**options)
        stiffness, mass = told.system_stiffness_n_per_m, told.mass_kg
        truth = {
            "seed": told.seed,
            "arm_rate_hz": told.rate_hz,
            "surface_m": told.surface_m,
            "payload": PayloadTruth("smooth", told.payload_k, told.payload_n),
            "system_stiffness_n_per_m": stiffness,
            "system_damping_n_s_per_m": live.damping(stiffness, mass),
            "effective_mass_kg": mass,
            "command_delay_s": told.command_delay_s,
            "lag_s": told.lag_s,
            "max_push_n": told.max_push_n,
            "position_quantum_m": told.position_quantum_m,
            "arm_has_force": told.has_force,
            "arm_force_noise_n": told.force_noise_n,
        }
        super().__init__(live.Lease(told.world, truth))


class SimForceSensor(WorldForceSensor):
    """A simulated force sensor, in real time."""

    OPTIONS: ClassVar[type] = SimForceOptions

    def __init__(self, **options: Any) -> None:
        told = SimForceOptions(**options)
        second = told.second
        prefix = "second_force" if second else "force"
        truth = {
            f"{prefix}_rate_hz": told.rate_hz,
            f"{prefix}_axis": told.axis,
            f"{prefix}_noise_n": told.noise_n,
            f"{prefix}_quantum_n": told.quantum_n,
            f"{prefix}_delay_s": told.delay_s,
            f"{prefix}_range_n": told.range_n,
        }
        if not second:
            truth["start_force_bias_n"] = told.bias_n
        super().__init__(live.Lease(told.world, truth), second=second)


class SimDisplacementSensor(WorldDisplacementSensor):
    """A simulated gauge across the contact, in real time."""

    OPTIONS: ClassVar[type] = SimGaugeOptions

    def __init__(self, **options: Any) -> None:
        told = SimGaugeOptions(**options)
        truth = {
            "gauge_rate_hz": told.rate_hz,
            "gauge_noise_m": told.noise_m,
            "gauge_quantum_m": told.quantum_m,
        }
        super().__init__(live.Lease(told.world, truth))
