"""Checks of what a sensor reads: alive, true to a known load, zero after `bias`.

A frozen value is distinguished from a quiet one by its probability. Let a sensor at rest have noise
of standard deviation σ and readings in steps of q. At best, with the true value in the middle of a
step, a reading falls into that step with probability p = erf(q / (2 √2 σ)). N equal readings in a
row then have probability p^(N−1). N is chosen so that this is below 1e-9, and at least 25.
"""

from __future__ import annotations

import math

from stepload.rig.contract_trial import (
    ContractViolation,
    Sample,
    SkippedCheck,
    Trial,
    drain,
    idle,
    nominal_rate_hz,
    observe,
    opened,
    require,
)
from stepload.rig.device import Arm, ForceSensor
from stepload.rig.samples import DisplacementSample, ForceSample

CHANCE = 1e-9
LEAST_EQUAL = 25
LONGEST_LOOK_S = 10.0
LOOKS = 4
GAIN_TOLERANCE = 0.2


def equal_readings_limit(noise: float, resolution: float) -> float:
    """Equal readings in a row that a living sensor shows with less than `CHANCE`; inf: any number.

    Args:
        noise: standard deviation, in the unit of `resolution`.
        resolution: smallest step between two readings.
    """
    if noise <= 0.0:
        return math.inf
    share = math.erf(resolution / (2.0 * math.sqrt(2.0) * noise))
    if share >= 1.0:
        return math.inf
    needed = 1.0 + math.log(CHANCE) / math.log(share) if share > 0.0 else 2.0
    return max(LEAST_EQUAL, math.ceil(needed))


def check_frozen(trial: Trial) -> str:
    """A sensor at rest does not repeat itself more often than its noise allows."""
    kind = trial.make()
    if isinstance(kind, Arm):
        raise SkippedCheck(
            "an arm at rest may repeat its position; `motion` looks for a frozen one"
        )
    noise, resolution, said = trial.noise, trial.resolution, "said"
    if noise is None:
        if not isinstance(kind, ForceSensor):
            raise SkippedCheck(
                "a gauge at rest may repeat its reading; say its --noise and --resolution, or "
                "use --load"
            )
        noise, resolution, said = 1.0, 1.0, "assumed: noise as large as the resolution"
    limit = equal_readings_limit(noise, resolution)
    with opened(trial) as device:
        if limit > LONGEST_LOOK_S * nominal_rate_hz(device):
            raise SkippedCheck(
                f"with noise {noise:g} and resolution {resolution:g} a living sensor may repeat "
                "its reading for long; use --load"
            )
        samples = observe(device, trial)
        for _ in range(LOOKS):
            if len(samples) < 2 * limit:
                trial.wait(limit / nominal_rate_hz(device))
                samples += drain(device)
    require(len(samples) >= limit, f"only {len(samples)} samples, {limit:.0f} are needed")
    longest = _longest_run([_reading(sample) for sample in samples])
    require(
        longest < limit,
        f"{longest} readings in a row are equal to the last bit; a living sensor shows {limit:.0f} "
        f"with a chance below {CHANCE:g} (noise {said}): the value is frozen, or --noise and "
        "--resolution must be said",
    )
    return f"at most {longest} equal readings in a row, limit {limit:.0f} (noise {said})"


def _reading(sample: Sample) -> object:
    if isinstance(sample, ForceSample):
        return sample.wrench
    return sample.displacement_m if isinstance(sample, DisplacementSample) else None


def _longest_run(values: list[object]) -> int:
    longest = run = 0
    before: object = None
    for value in values:
        run = run + 1 if value == before else 1
        before = value
        longest = max(longest, run)
    return longest


def check_load(trial: Trial) -> str:
    """A known load changes the reading by its true size: unit, factor and life of the value."""
    if isinstance(trial.make(), Arm):
        raise SkippedCheck("only sensors are loaded")
    if trial.load is None:
        raise SkippedCheck("no known load: unit and factor of readings are NOT checked (--load)")
    with opened(trial) as device:
        unit = "N" if isinstance(device, ForceSensor) else "m"
        before = _mean(observe(device, trial))
        true = abs(trial.load())
        idle(device, trial, trial.observe_s)
        drain(device)
        read = math.dist(_mean(observe(device, trial)), before)
    require(
        abs(read / true - 1.0) < GAIN_TOLERANCE,
        f"a load of {true:.6g} {unit} is read as {read:.6g} {unit}, {read / true:.3g} times as "
        "much: wrong unit or factor, or a value that does not follow",
    )
    return f"{true:.6g} {unit} read as {read:.6g} {unit}"


def check_bias(trial: Trial) -> str:
    """Where `bias` returns True the sensor reads zero afterwards. Needs free air."""
    if not isinstance(trial.make(), ForceSensor):
        raise SkippedCheck("only force sensors have a bias")
    with opened(trial) as device:
        assert isinstance(device, ForceSensor)
        before = _force_n(observe(device, trial))
        if not device.bias(trial.open_timeout_s):
            raise SkippedCheck("the device has no bias")
        trial.wait(trial.observe_s)
        drain(device)
        after = _force_n(observe(device, trial))
    if before[0] <= 6.0 * before[1]:
        raise SkippedCheck(
            f"it read {before[0]:.3f} N before: too near to zero to see what bias() does"
        )
    require(
        after[0] <= 0.2 * before[0] + 6.0 * after[1],
        f"after bias() it still reads {after[0]:.3f} N (before {before[0]:.3f} N)",
    )
    return f"{before[0]:.3f} N before, {after[0]:.3f} N after"


def _vector(sample: Sample) -> tuple[float, ...]:
    if isinstance(sample, ForceSample):
        return sample.wrench[:3]
    assert isinstance(sample, DisplacementSample)
    return (sample.displacement_m,)


def _mean(samples: list[Sample]) -> tuple[float, ...]:
    """Mean force (3 components, N) or mean displacement (1, m).

    Raises:
        ContractViolation: no samples.
    """
    if not samples:
        raise ContractViolation("an open sensor delivers no samples")
    rows = [_vector(sample) for sample in samples]
    return tuple(math.fsum(axis) / len(rows) for axis in zip(*rows, strict=True))


def _force_n(samples: list[Sample]) -> tuple[float, float]:
    """Size of the mean force and the spread about it, in N."""
    mean = _mean(samples)
    squares = math.fsum(math.dist(_vector(sample), mean) ** 2 for sample in samples)
    return math.hypot(*mean), math.sqrt(squares / len(samples))
