"""All channels of a recording on one time base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError, DomainError
from stepload.record.reader import Recording
from stepload.record.rows import FloatArray, IntArray, SampleColumns
from stepload.rig.clockmap import MAX_SKEW, fit_clock
from stepload.rig.samples import Status

BoolArray = NDArray[np.bool_]

_USELESS = Status.SATURATED | Status.INVALID | Status.DEVICE_FAULT
_MAX_GAP_PERIODS = 10.0


@dataclass(frozen=True, slots=True)
class ChannelClock:
    """Where a channel's sample times come from.

    `how` is "device clock" or "receive time", then with the reason why in `why`. The residuals are
    receive time minus mapped device time: transport latency beyond the smallest.
    """

    channel: str
    how: str
    why: str
    skew_ppm: float
    residual_median_us: float
    residual_p99_us: float


@dataclass(frozen=True, slots=True)
class Aligned:
    """One row per usable force sample, on the run's clock, oldest first.

    `force_n` is along the force axis, positive when pressing, *not* tared; `across_n` (N, 2) is
    the force across it, not tared either, `torque_n_m` (N, 3) the torque along the pressing axis
    last, the two across it before, in the order x, y, z. `displacement_m` is None without a gauge.
    `phase`, `cycle`, `step` and `level_n` are those of the tick before the sample.
    `second_n` is the second force channel, NaN where it has no sample; None without one.
    """

    time_s: FloatArray
    force_n: FloatArray
    position_m: FloatArray
    displacement_m: FloatArray | None
    phase: IntArray
    cycle: IntArray
    step: IntArray
    level_n: FloatArray
    clocks: tuple[ChannelClock, ...]
    across_n: FloatArray
    torque_n_m: FloatArray
    second_n: FloatArray | None = None


def sample_times(channel: str, columns: SampleColumns) -> tuple[FloatArray, ChannelClock]:
    """When each sample was taken, on the run's clock: never falling, shape (N,)."""
    receive_s = columns.receive_time_s
    try:
        fit = fit_clock(columns.device_time_s, receive_s)
        if abs(fit.skew) >= MAX_SKEW:
            raise DomainError(f"the device clock is off by more than {MAX_SKEW * 1e6:.0f} ppm")
    except DomainError as error:
        clock = ChannelClock(channel, "receive time", error.message, 0.0, np.nan, np.nan)
        return np.maximum.accumulate(receive_s), clock
    clock = ChannelClock(
        channel,
        "device clock",
        "",
        fit.skew * 1e6,
        fit.residual_median_us,
        fit.residual_p99_us,
    )
    return fit.to_host(columns.device_time_s), clock


def project(wrench: FloatArray, axis: str) -> FloatArray:
    """Force along `axis` ("+fx" … "-fz"), positive when pressing; wrench (N, 6) → (N,).

    Raises:
        BadInputError: no such axis.
    """
    if len(axis) != 3 or axis[0] not in "+-" or axis[1:] not in ("fx", "fy", "fz"):
        raise BadInputError(f"force axis {axis!r}", hint="one of +fx -fx +fy -fy +fz -fz")
    component = wrench[:, _component(axis)]
    return -component if axis[0] == "-" else component


def across(wrench: FloatArray, axis: str) -> FloatArray:
    """The two force components that are not along `axis`; wrench (N, 6) → (N, 2)."""
    return np.delete(wrench[:, :3], _component(axis), axis=1)


def torques(wrench: FloatArray, axis: str) -> FloatArray:
    """Torque about the two axes that are not `axis`, then about that; wrench (N, 6) → (N, 3)."""
    index = _component(axis)
    return wrench[:, [3 + i for i in (*(i for i in range(3) if i != index), index)]]


def _component(axis: str) -> int:
    return "xyz".index(axis[2])


def _interpolate(
    at_s: FloatArray, time_s: FloatArray, value: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Values at other times, and which of them lie between close enough neighbours."""
    right = np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1)
    gap_s = time_s[right] - time_s[right - 1]
    limit_s = _MAX_GAP_PERIODS * float(np.median(np.diff(time_s)))
    inside = (at_s >= time_s[0]) & (at_s <= time_s[-1]) & (gap_s <= limit_s)
    return np.interp(at_s, time_s, value), inside


def align(recording: Recording, axis: str | None = None, lag_s: float = 0.0) -> Aligned:
    """Put force, position and what the engine did on the force samples' times.

    Args:
        axis: force axis; the recording's own ("force_axis" of its metadata) when None.
        lag_s: how much later than the position the force is recorded (see `record.lag`).

    Raises:
        BadInputError: a channel without data, or no usable sample left.
    """
    axis = axis or recording.metadata.get("force_axis", "")
    for name, time_s in (
        ("force", recording.force.receive_time_s),
        ("arm", recording.arm.receive_time_s),
        ("tick", recording.ticks.time_s),
    ):
        if len(time_s) < 2:
            raise BadInputError(
                f"{recording.path}: {len(time_s)} samples in channel {name!r}",
                hint="the run ended before there was anything to identify",
            )
    force_s, force_clock = sample_times("force", recording.force)
    arm_s, arm_clock = sample_times("arm", recording.arm)
    clocks = [force_clock, arm_clock]
    force_n = project(recording.force.wrench, axis)
    at_s = force_s - lag_s
    position_m, usable = _interpolate(at_s, arm_s, recording.arm.position_m)
    usable &= (recording.force.status & int(_USELESS)) == 0
    usable &= np.isfinite(force_n) & np.isfinite(position_m)
    displacement_m = None
    if recording.displacement is not None and len(recording.displacement.receive_time_s) >= 2:
        gauge_s, gauge_clock = sample_times("displacement", recording.displacement)
        clocks.append(gauge_clock)
        displacement_m, known = _interpolate(at_s, gauge_s, recording.displacement.displacement_m)
        usable &= known & np.isfinite(displacement_m)
    tick = np.searchsorted(recording.ticks.time_s, at_s, side="right") - 1
    usable &= tick >= 0
    if not usable.any():
        raise BadInputError(f"{recording.path}: no force sample with a position to it")
    tick = tick[usable]
    return Aligned(
        time_s=at_s[usable],
        force_n=force_n[usable],
        position_m=position_m[usable],
        displacement_m=None if displacement_m is None else displacement_m[usable],
        phase=recording.ticks.phase[tick],
        cycle=recording.ticks.cycle[tick],
        step=recording.ticks.step[tick],
        level_n=recording.ticks.level_n[tick],
        clocks=tuple(clocks),
        across_n=across(recording.force.wrench[usable], axis),
        torque_n_m=torques(recording.force.wrench[usable], axis),
        second_n=_second(recording, at_s[usable], arm_s),
    )


def _second(recording: Recording, at_s: FloatArray, arm_s: FloatArray) -> FloatArray | None:
    """The second force channel (N,): a second sensor, or the force of an arm that has one."""
    columns, axis = recording.second_force, recording.metadata.get("second_force_axis", "")
    if columns is not None and axis and len(columns.receive_time_s) >= 2:
        time_s, _ = sample_times("second_force", columns)
        value_n = project(columns.wrench, axis)
    else:
        time_s, value_n = arm_s, recording.arm.force_n
    known = np.isfinite(value_n)
    if known.sum() < 2:
        return None
    second_n, inside = _interpolate(at_s, time_s[known], value_n[known])
    return np.where(inside, second_n, np.nan)
