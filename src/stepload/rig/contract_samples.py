"""Checks of the data: sequence, counts, rate, times, a drain that never waits; and of what a sensor
reads: alive, true to a known load, zero after `bias`.

A frozen value is distinguished from a quiet one by its probability. Let a sensor at rest have noise
of standard deviation σ and readings in steps of q. At best, with the true value in the middle of a
step, a reading falls into that step with probability p = erf(q / (2 √2 σ)). N equal readings in a
row then have probability p^(N−1). N is chosen so that this is below 1e-9, and at least 25.
"""

from __future__ import annotations

import itertools
import math
import statistics

from stepload.rig.contract_trial import (
    MIN_SAMPLES,
    POLL_S,
    ContractViolation,
    Sample,
    SkippedCheck,
    Stopwatch,
    Trial,
    drain,
    idle,
    nominal_rate_hz,
    observe,
    opened,
    require,
)
from stepload.rig.device import Arm, Device, ForceSensor
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample

RATE_TOLERANCE = 0.25
LOOKS = 6
"""Number of short looks: a host that stalls once spoils one of them, not all."""
CLOCK_S = 1e-6
"""A stamp may not be later than now; this is for rounding."""
OLDEST_S = 0.5
PAUSE_S = 0.1
PAUSE_SAMPLES = 8.0
QUICK_S = 0.2e-3
"""An empty drain that takes longer, every time, waits for something."""
DRAINS = 11
WHOLE, SIX = ("sequence", "status"), ("wrench", "pose")


def check_samples(trial: Trial) -> str:
    """Nothing repeated, nothing lost unnoticed, no time runs backwards, all values finite."""
    with opened(trial) as device:
        rate_hz = nominal_rate_hz(device)
        samples = observe(device, trial)
        looks = 1
        while looks < LOOKS and not (
            _near(device.health().rate_hz, rate_hz) and _near(_stamped_rate_hz(samples), rate_hz)
        ):
            samples += observe(device, trial)
            looks += 1
        health = device.health()
        samples += drain(device)
        after = device.health()
        if fault := device.fault():
            raise ContractViolation(f"a fault while watching: {fault.code}: {fault.message}")
        require(len(samples) >= MIN_SAMPLES, f"only {len(samples)} samples at {rate_hz:g} Hz")
        for sample in samples:
            _require_types(sample)
            _require_finite(sample, device)
    gaps = 0
    for old, new in itertools.pairwise(samples):
        require(
            new.sequence > old.sequence,
            f"sequence {new.sequence} after {old.sequence}: repeated or out of order",
        )
        gaps += new.sequence - old.sequence - 1
        require(
            new.receive_time_s >= old.receive_time_s,
            f"receive time went back by {old.receive_time_s - new.receive_time_s:.6f} s",
        )
        if math.isfinite(new.device_time_s) and math.isfinite(old.device_time_s):
            require(new.device_time_s >= old.device_time_s, "device time went back")
    require(gaps <= after.lost, f"sequence shows {gaps} lost samples, health only {after.lost}")
    if not isinstance(device, Arm):
        require(
            health.received <= len(samples) <= after.received,
            f"{len(samples)} samples delivered, health counts {health.received} to "
            f"{after.received}",
        )
        delivered_hz = _stamped_rate_hz(samples)
        require(
            _near(delivered_hz, rate_hz),
            f"delivered {delivered_hz:.1f} samples a second, nominal rate {rate_hz:g} Hz",
        )
    require(
        _near(after.rate_hz, rate_hz),
        f"measured rate {after.rate_hz:.1f} Hz, nominal {rate_hz:g} Hz",
    )
    return f"{len(samples)} samples"


def _near(measured_hz: float, nominal_hz: float) -> bool:
    return abs(measured_hz / nominal_hz - 1.0) < RATE_TOLERANCE


def _stamped_rate_hz(samples: list[Sample]) -> float:
    """Samples a second by their own receive times; 0 where that cannot be said."""
    span_s = samples[-1].receive_time_s - samples[0].receive_time_s if samples else 0.0
    return (len(samples) - 1) / span_s if span_s > 0.0 else 0.0


def _require_types(sample: Sample) -> None:
    """The promised types."""
    for name, value in zip(sample._fields, sample, strict=True):
        if name in WHOLE:
            right = isinstance(value, int)
        elif name in SIX:
            right = isinstance(value, tuple) and all(
                isinstance(each, float | int) for each in value
            )
        else:
            right = isinstance(value, float | int)
        found = "of others than floats" if isinstance(value, tuple) else type(value).__name__
        wanted = "an int" if name in WHOLE else "a tuple of floats" if name in SIX else "a float"
        require(right, f"{name} is {found}, not {wanted}")


def _require_finite(sample: Sample, device: Device) -> None:
    if isinstance(sample, ForceSample):
        values: tuple[float, ...] = sample.wrench
        require(len(values) == 6, f"a wrench of {len(values)} values")
    elif isinstance(sample, ArmSample):
        require(len(sample.pose) == 6, f"a pose of {len(sample.pose)} values")
        has_force = isinstance(device, Arm) and device.has_force
        values = (sample.position_m, *sample.pose, *((sample.force_n,) if has_force else ()))
        if isinstance(device, Arm) and device.has_wrench:
            values = (*values, *sample.wrench[:3])
            require(
                sample.status != 0 or not abs(sample.wrench[2] - sample.force_n) > 0.0,
                f"component 3 of the arm's wrench is {sample.wrench[2]:.4g} N and force_n"
                f" {sample.force_n:.4g} N: the wrench is not in the pressing frame",
            )
    else:
        values = (sample.displacement_m,)
    require(
        all(map(math.isfinite, (*values, sample.receive_time_s))) or sample.status != 0,
        f"a sample that is not finite has status 0: {sample}",
    )


def check_stamps(trial: Trial) -> str:
    """`receive_time_s` is the host's monotonic clock at arrival: not later, not at the drain."""
    with opened(trial) as device:
        youngest_s = _youngest_age_s(device, trial)
        limit_s = OLDEST_S + 3.0 / nominal_rate_hz(device)
        require(
            youngest_s < limit_s,
            f"the newest sample is never younger than {youngest_s:.3f} s (limit {limit_s:.3f} s): "
            "receive_time_s is not the host's monotonic clock",
        )
        pause_s = max(PAUSE_S, PAUSE_SAMPLES / nominal_rate_hz(device))
        widest_s = 0.0
        for _ in range(LOOKS):
            drain(device)
            idle(device, trial, pause_s)
            if samples := drain(device):
                span_s = samples[-1].receive_time_s - samples[0].receive_time_s
                widest_s = max(widest_s, span_s)
            if widest_s > 0.5 * pause_s:
                return f"newest sample {youngest_s * 1e3:.1f} ms old"
    raise ContractViolation(
        f"the samples of {pause_s:.3f} s without a drain are stamped within {widest_s:.6f} s: "
        "receive_time_s is given when they are drained, not when they arrive"
    )


def _youngest_age_s(device: Device, trial: Trial) -> float:
    """Smallest age of a newest sample right after a drain.

    Raises:
        ContractViolation: a sample is stamped later than now.
    """
    youngest_s = math.inf
    left_s = max(trial.observe_s, MIN_SAMPLES / nominal_rate_hz(device))
    while left_s > 0.0:
        samples = drain(device)
        now_s = trial.now_s()
        for sample in samples:
            ahead_s = sample.receive_time_s - now_s
            require(
                ahead_s <= CLOCK_S,
                f"a sample is stamped {ahead_s:.6f} s in the future: its age, and every rule "
                "about stale data, would be wrong by as much",
            )
            youngest_s = min(youngest_s, -ahead_s)
        trial.wait(POLL_S)
        left_s -= POLL_S
    return youngest_s


def check_drain(trial: Trial) -> str:
    """`drain` never waits for the next sample."""
    with opened(trial) as device:
        limit_s = max(QUICK_S, min(1e-3, 0.5 / nominal_rate_hz(device)))
        drain(device)
        took = []
        for _ in range(DRAINS):
            watch = Stopwatch(trial)
            drain(device)
            took.append(watch.seconds)
    typical_s = statistics.median(took)
    require(
        typical_s < limit_s,
        f"a drain right after a drain takes {typical_s * 1e3:.2f} ms (limit {limit_s * 1e3:.2f} "
        "ms): it waits, and holds up every rule of the tick",
    )
    return f"{typical_s * 1e6:.0f} µs"


CHANCE = 1e-9
LEAST_EQUAL = 25
LONGEST_LOOK_S = 10.0
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
        for _ in range(4):
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
        before = mean(observe(device, trial))
        true = abs(trial.load())
        idle(device, trial, trial.observe_s)
        drain(device)
        after = mean(observe(device, trial))
        read = math.dist(after, before)
    require(
        abs(read / true - 1.0) < GAIN_TOLERANCE,
        f"a load of {true:.6g} {unit} is read as {read:.6g} {unit}, {read / true:.3g} times as "
        "much: wrong unit or factor, or a value that does not follow",
    )
    if axis := trial.load_axis if unit == "N" else "":
        grown = (after["xyz".index(axis[-1])] - before["xyz".index(axis[-1])]) * float(
            axis[0] + "1"
        )
        require(
            grown > (1.0 - GAIN_TOLERANCE) * true,
            f"a load of {true:.6g} N along {axis} is read as {grown:.6g} N: wrong sign or axis",
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


def mean(samples: list[Sample]) -> tuple[float, ...]:
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
    middle = mean(samples)
    squares = math.fsum(math.dist(_vector(sample), middle) ** 2 for sample in samples)
    return math.hypot(*middle), math.sqrt(squares / len(samples))
