"""What comes in from an open rig at rest, against the plan: rate, age, clock, noise, drift."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from stepload.engine.open_rig import OpenRig
from stepload.engine.watch import wrench_axis
from stepload.errors import DomainError
from stepload.feasibility.bounds import age_limit_s
from stepload.feasibility.limits import SECOND_IDENTICAL_COUNTS, identical_counts
from stepload.identification.fit import FloatArray
from stepload.plan.model import (
    ArmSpec,
    DisplacementSpec,
    ForceSpec,
    Plan,
    Rig,
    SecondForceSource,
)
from stepload.rig.clockmap import fit_clock
from stepload.rig.samples import Status
from stepload.setup.check_line import CheckLine, Mark, graded, without_number

RATE_WARN, RATE_FAIL = 0.02, 0.1
LOST_WARN, LOST_FAIL = 5e-3, 0.02
CLOCK_STEP_WARN_S, CLOCK_STEP_FAIL_S = 2e-3, 15e-3
NOISE_WARN, NOISE_FAIL = 1.2, 3.0
"""Factors on the plan's noise for a warning and a failure; a run refuses above the second."""
SETTLE_S = 0.2
"""Wait in s before watching: what readers lost while the loop was prepared is not counted."""
SILENT_S = 0.5
"""Time in s (or ten periods) without a sample after which a gauge has fallen silent."""


@dataclass(slots=True)
class Watched:
    """What came in, by stream, with the age of the newest sample at every tick (s)."""

    samples: dict[str, list[Any]] = field(default_factory=dict)
    ages_s: dict[str, list[float]] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)
    errors: dict[str, dict[str, int]] = field(default_factory=dict)
    late_s: list[float] = field(default_factory=list)
    period_s: float = math.inf

    @property
    def late_ticks(self) -> int:
        """Ticks that this computer began a period late or more."""
        return sum(late_s > self.period_s for late_s in self.late_s)


def devices(rig: OpenRig) -> dict[str, Any]:
    """The open devices by the name that the plan gives them."""
    found = {
        "force": rig.force,
        "arm": rig.arm,
        "second_force.sensor": rig.second_force,
        "displacement": rig.displacement,
    }
    return {name: device for name, device in found.items() if device is not None}


def watch(rig: OpenRig, seconds: float) -> Watched:
    """Drain every device each tick for so long, from within `undisturbed`; nothing moves."""
    open_devices = devices(rig)
    seen = Watched(period_s=rig.arm.period_s)
    if not rig.clock.virtual:
        rig.clock.sleep_until(rig.clock.now_s() + SETTLE_S)
    for name, device in open_devices.items():
        device.drain()
        seen.samples[name], seen.ages_s[name] = [], []
        seen.lost[name] = -device.health().lost
    clock, period_s = rig.clock, rig.arm.period_s
    deadline_s = clock.now_s()
    end_s = deadline_s + seconds
    newest_s = dict.fromkeys(open_devices, deadline_s)
    while deadline_s < end_s:
        deadline_s += period_s
        clock.sleep_until(deadline_s)
        now_s = clock.now_s()
        seen.late_s.append(now_s - deadline_s)
        for name, device in open_devices.items():
            if batch := device.drain():
                seen.samples[name] += batch
                newest_s[name] = batch[-1].receive_time_s
            seen.ages_s[name].append(now_s - newest_s[name])
        if now_s - deadline_s > period_s:
            deadline_s = now_s
    for name, device in open_devices.items():
        health = device.health()
        seen.lost[name] += health.lost
        seen.errors[name] = dict(health.errors)
    return seen


def _to_ns(time_s: float) -> float:
    """Round to ns, without the rounding errors of a difference of clocks."""
    return round(float(time_s), 9)


class AtRest(NamedTuple):
    """Mean, standard deviation about a straight line, slope and its standard error."""

    mean: float
    noise: float
    slope: float
    slope_sigma: float


def at_rest(time_s: FloatArray, values: FloatArray) -> AtRest:
    """Noise and drift of a reading that should stand still; times in s, shape (N,), N > 2."""
    t = time_s - time_s.mean()
    slope = float(t @ values / (t @ t))
    mean = float(values.mean())
    rest = values - mean - slope * t
    noise = math.sqrt(float(rest @ rest) / (len(t) - 2))
    return AtRest(mean, noise, slope, noise / math.sqrt(float(t @ t)))


def no_data(samples: Sequence[Any], seconds: float) -> str:
    """Why nothing can be said from these samples; "" where something can."""
    if len(samples) < 3:
        return f"only {len(samples)} samples in {seconds:g} s"
    if samples[-1].receive_time_s <= samples[0].receive_time_s:
        return f"all {len(samples)} samples came at one moment of {seconds:g} s: one burst"
    return ""


def check_stream(
    name: str, spec: ForceSpec | ArmSpec | DisplacementSpec, seen: Watched, seconds: float
) -> Iterator[CheckLine]:
    """Rate, losses, age and clock of one stream."""
    samples = seen.samples[name]
    if why := no_data(samples, seconds):
        yield CheckLine(f"{name}: data", Mark.FAIL, len(samples), 3.0, "", why,
                   "check power and cable")  # fmt: skip
        return
    receive_s = np.array([sample.receive_time_s for sample in samples])
    rate_hz = (len(samples) - 1 + seen.lost[name]) / float(receive_s[-1] - receive_s[0])
    off = abs(rate_hz / spec.rate_hz - 1.0)
    yield graded(
        f"{name}: rate", off, "%", warn=RATE_WARN, fail=RATE_FAIL,
        message=f"{rate_hz:.1f} Hz; the plan says {spec.rate_hz:g} Hz",
        remedy=f"set the device's rate, or rig.{name}.rate",
    )  # fmt: skip
    lost = seen.lost[name]
    share = lost / (len(samples) + lost)
    host_late, remedy = _host(seen, share > LOST_WARN, "cable, bit rate and network")
    yield graded(
        f"{name}: lost", share, "%", warn=LOST_WARN, fail=LOST_FAIL,
        message=f"{lost} of {len(samples) + lost} samples never arrived{host_late}",
        remedy=remedy,
    )  # fmt: skip
    ages_s = np.array(seen.ages_s[name])
    limit_s = math.inf if isinstance(spec, DisplacementSpec) else age_limit_s(spec)
    p99_s = float(np.percentile(ages_s, 99))
    aged = float(ages_s.max()) > 0.5 * limit_s
    host_late, remedy = _host(seen, aged, "network and USB latency timer")
    yield graded(
        f"{name}: longest age", _to_ns(ages_s.max()), "s", warn=0.5 * limit_s, fail=limit_s,
        message=f"of the newest sample at a tick, 99 % below {p99_s * 1e3:.2f} ms; a run stops "
        f"above {limit_s * 1e3:g} ms (R3){host_late}",
        remedy=remedy,
    )  # fmt: skip
    yield from _check_clock(name, samples, receive_s)
    counted = {key: count for key, count in seen.errors[name].items() if count}
    counted.pop("gaps", None)  # the line on losses reports them
    if counted:
        listed = ", ".join(f"{key} {count}" for key, count in counted.items())
        yield CheckLine(
            f"{name}: driver's counters", Mark.WARN, float(sum(counted.values())), 0.0, "",
            listed, "see the device's page in docs/devices",
        )  # fmt: skip


def _host(seen: Watched, wrong: bool, device: str) -> tuple[str, str]:
    """Words and remedy for a stream that is `wrong`, by how late this computer itself was.

    A reader that gets its turn late finds several samples at once, and may find the newest only.
    """
    if not (wrong and seen.late_ticks):
        return "", f"check {device}: this computer began every tick in time meanwhile"
    return (
        f"; this computer itself was late by a period in {seen.late_ticks} of"
        f" {len(seen.late_s)} ticks meanwhile",
        "this computer first: let nothing else work on it, give the loop real-time priority, and"
        f" look again; then check {device}",
    )


def _check_clock(name: str, samples: list[Any], receive_s: FloatArray) -> Iterator[CheckLine]:
    device_s = np.array([sample.device_time_s for sample in samples])
    try:
        fit = fit_clock(device_s, receive_s)
    except DomainError:
        back_s = -float(np.diff(device_s[np.isfinite(device_s)]).min(initial=0.0))
        if back_s > 0.0:
            yield _clock_steps(name, back_s)
            return
        yield without_number(f"{name}: device clock", Mark.OK,
                             "none: samples are timed by their arrival")  # fmt: skip
        return
    yield CheckLine(
        f"{name}: transport", Mark.OK, _to_ns(fit.residual_p99_us * 1e-6), math.nan, "s",
        f"latency beyond the smallest: half below {fit.residual_median_us:.0f} µs, 99 % below "
        f"{fit.residual_p99_us:.0f} µs; skew {fit.skew * 1e6:+.1f} ppm",
    )  # fmt: skip
    late_s = receive_s - fit.to_host(device_s)
    edges = np.searchsorted(receive_s, np.arange(receive_s[0], receive_s[-1], 1.0))
    least_s = [float(part.min()) for part in np.split(late_s, edges[1:]) if len(part) > 3]
    step_s = max((abs(b - a) for a, b in pairwise(least_s)), default=0.0)
    yield _clock_steps(name, step_s)


def _clock_steps(name: str, step_s: float) -> CheckLine:
    return graded(
        f"{name}: clock steps", _to_ns(step_s), "s", warn=CLOCK_STEP_WARN_S, fail=CLOCK_STEP_FAIL_S,
        message="largest jump of the device's clock against the host's from second to second",
        remedy="is the host a virtual machine, or the device restarted by its supply?",
    )  # fmt: skip


def check_force(
    plan: Plan, spec: ForceSpec, name: str, seen: Watched
) -> tuple[list[CheckLine], AtRest]:
    """Noise and drift of a force sensor at rest, with what was measured."""
    index, sign = wrench_axis(spec.axis)
    samples = seen.samples[name]
    time_s = np.array([sample.receive_time_s for sample in samples])
    rest = at_rest(time_s, sign * np.array([sample.wrench[index] for sample in samples]))
    tare_s = plan.procedure.tare_s
    drift_n = max(0.0, abs(rest.slope) - 2.0 * rest.slope_sigma) * tare_s
    lines = [
        _noise(name, "noise", rest.noise, math.hypot(spec.noise_n, spec.resolution_n / 3.46)),
        graded(
            f"{name}: drift at rest", drift_n, "N", warn=0.5 * plan.procedure.max_drift_n,
            fail=plan.procedure.max_drift_n,
            message=f"{rest.slope * 1e3:+.2f} ± {rest.slope_sigma * 1e3:.2f} mN/s at "
            f"{rest.mean:+.2f} N, over a tare of {tare_s:g} s",
            remedy="let the sensor warm up, keep draughts and hands away",
        ),
    ]  # fmt: skip
    return lines, rest


def _noise(name: str, what: str, value: float, planned: float, unit: str = "N") -> CheckLine:
    return graded(
        f"{name}: {what}", value, unit, warn=NOISE_WARN * planned, fail=NOISE_FAIL * planned,
        message="standard deviation at rest against the plan's figure with its resolution",
        remedy=f"look for vibration and loose cables, or state the noise in rig.{name}",
    )  # fmt: skip


def check_arm(
    plan: Plan, seen: Watched
) -> tuple[list[CheckLine], dict[tuple[str, str], tuple[float, str]]]:
    """Position noise at rest, and the arm's own force channel; what was measured, with its unit, by
    key of the rig."""
    samples, rig = seen.samples["arm"], plan.rig
    time_s = np.array([sample.receive_time_s for sample in samples])
    position = at_rest(time_s, np.array([sample.position_m for sample in samples]))
    planned_m = math.hypot(rig.arm.position_noise_m, rig.arm.position_resolution_m / 3.46)
    lines = [_noise("arm", "position noise", position.noise, planned_m, "m")]
    measured = {("arm", "position_noise"): (position.noise, "m")}
    if rig.second_force.source is SecondForceSource.ARM:
        force = at_rest(time_s, np.array([sample.force_n for sample in samples]))
        lines.append(_noise("second_force", "noise", force.noise, rig.second_force.noise_n))
        measured["second_force", "noise"] = force.noise, "N"
    return lines, measured


def check_live(
    name: str, spec: ForceSpec | ArmSpec | DisplacementSpec, seen: Watched, rig: Rig
) -> Iterator[CheckLine]:
    """Findings on the readings themselves; none where they are as they should be."""
    samples = seen.samples[name]
    if flagged := [sample.status for sample in samples if sample.status]:
        bits = Status(0)
        for status in flagged:
            bits |= Status(status)
        yield CheckLine(
            f"{name}: status", Mark.FAIL, float(len(flagged)), 0.0, "",
            f"{len(flagged)} of {len(samples)} samples are flagged by the device"
            f" ({str(bits.name).replace('|', ', ').replace('_', ' ').lower()}): a run stops at the"
            " first (R4)",
            "see the device's own display and its page in docs/devices",
        )  # fmt: skip
    if isinstance(spec, ForceSpec):
        index = wrench_axis(spec.axis)[0]
        values = [sample.wrench[index] for sample in samples]
        if spec is rig.second_force.sensor:
            limit = identical_counts(spec, rig.second_force.noise_n, SECOND_IDENTICAL_COUNTS)
        else:
            limit = identical_counts(spec, spec.noise_n)
        yield from _standing(name, values, limit, coarse=spec.resolution_n > 0.0)
    if isinstance(spec, ArmSpec) and rig.second_force.source is SecondForceSource.ARM:
        values = [sample.force_n for sample in samples]
        yield from _standing("second_force", values, SECOND_IDENTICAL_COUNTS, coarse=False)
    if isinstance(spec, DisplacementSpec):
        longest_s, limit_s = max(seen.ages_s[name]), max(SILENT_S, 10.0 / spec.rate_hz)
        if longest_s > limit_s:
            yield CheckLine(
                f"{name}: silence", Mark.FAIL, longest_s, limit_s, "s",
                "no sample came for so long", "check cable and supply of the gauge",
            )  # fmt: skip


def _standing(
    name: str, values: Sequence[float], limit: int, *, coarse: bool
) -> Iterator[CheckLine]:
    """A live sensor has noise: equal readings in a row are a frozen one (R4).

    `limit` is how many are too many, 0 where no number decides, as with a `coarse` resolution.
    """
    same = max((sum(1 for _ in group) for _, group in itertools.groupby(values)), default=0)
    frozen = bool(limit) and same > limit
    if frozen or (same == len(values) and limit == 0):
        yield CheckLine(
            f"{name}: readings", Mark.WARN if coarse and not frozen else Mark.FAIL,
            float(same), float(limit or len(values)), "",
            f"{same} of {len(values)} readings in a row were the same to the last bit; a live"
            " sensor has noise",
            "has it stopped measuring? Touch it and look whether its reading moves",
        )  # fmt: skip
