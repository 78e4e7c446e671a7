"""The true properties of each force sensor of a rig, for one axis and for six."""

from __future__ import annotations

from typing import NamedTuple

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.faults import Schedule

_MAIN_CLOCK_S = 300.0
"""What the sensor's own clock shows when the world begins; devices have been up for a while."""
_SECOND_CLOCK_S = 350.0
_MAIN_STREAM = 20
_SECOND_STREAM = 30


class SensorTruth(NamedTuple):
    """One force sensor as it really is.

    `offset_n` is its reading in free air; `stream` and `stream` + 1 are its streams of noise from
    `seed`.
    """

    axis: str
    rate_hz: float
    noise_n: float
    quantum_n: float
    delay_s: float
    range_n: float
    offset_n: float
    drift_n_per_s: float
    clock_s: float
    seed: int
    stream: int
    faults: Schedule


def main_sensor(spec: WorldSpec) -> SensorTruth:
    """The main force sensor."""
    return SensorTruth(
        axis=spec.force_axis,
        rate_hz=spec.force_rate_hz,
        noise_n=spec.force_noise_n,
        quantum_n=spec.force_quantum_n,
        delay_s=spec.force_delay_s,
        range_n=spec.force_range_n,
        offset_n=spec.start_force_bias_n,
        drift_n_per_s=spec.force_drift_n_per_s,
        clock_s=_MAIN_CLOCK_S,
        seed=spec.seed,
        stream=_MAIN_STREAM,
        faults=Schedule(spec.faults, prefix="force_"),
    )


def second_sensor(spec: WorldSpec, offset_n: float) -> SensorTruth:
    """The second one, which does not drift."""
    return SensorTruth(
        axis=spec.second_force_axis,
        rate_hz=spec.second_force_rate_hz,
        noise_n=spec.second_force_noise_n,
        quantum_n=spec.second_force_quantum_n,
        delay_s=spec.second_force_delay_s,
        range_n=spec.second_force_range_n,
        offset_n=offset_n,
        drift_n_per_s=0.0,
        clock_s=_SECOND_CLOCK_S,
        seed=spec.seed,
        stream=_SECOND_STREAM,
        faults=Schedule(spec.faults, prefix="second_"),
    )
