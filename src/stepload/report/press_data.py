"""Contact data of a recording: tared force and travel since touch on one time base.

Travel has one zero for the whole run: the touch that began the first loading. A later touch does
not zero it again, so set, creep and drift between the cycles stay in it. Every touch is found to a
quantum of position and the force at which it counts; its own travel is in `TouchPoint.travel_m`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError, printable
from stepload.identification.fit import FloatArray
from stepload.identification.lateral_coupling import Across
from stepload.record.align import Aligned, ChannelClock, align
from stepload.record.lag import Lag, measure_lag
from stepload.record.reader import Event, Recording
from stepload.record.rows import Phase
from stepload.report.model import number_or_nan
from stepload.report.rows import Row, figure

WRONG_READINGS = {
    "R4": "a reading could not be used",
    "R5": "the force channels disagree",
    "R9": "the force jumped",
}
"""The rules whose stop says that readings were wrong, and what each says of them."""
MOST_MISSING = 20.0
"""Largest ratio of expected to recorded samples of a usable record."""
IntArray = NDArray[np.integer]

LOADING = (Phase.LOAD, Phase.HOLD)
UNLOADING = (Phase.UNLOAD, Phase.UNLOAD_HOLD)
HOLDS = (Phase.HOLD, Phase.UNLOAD_HOLD)


class TouchPoint(Row):
    """One touch as the engine detected it."""

    time_s: float = figure("On the run's clock.")
    position_m: float = figure("Position of the arm, raw.")
    force_n: float = figure("Force at the touch.")
    cycle: int = figure("From 1.")
    purpose: str = figure("first, again, cycle, resume or last.")
    travel_m: float = figure("Travel from the zero of the data.")


@dataclass(frozen=True, slots=True)
class PressData:
    """One run on one time base, arrays of equal length (N,).

    Attributes:
        time_s: on the run's clock.
        force_n: contact force, linear zero drift between the tares subtracted.
        travel_m: displacement since the touch that began the first loading, in all cycles: of arm,
            system and payload, or of the payload alone where `gauge`.
        phase, cycle: of the engine's tick.
        touches: raw touch points in the order of time.
        noise_n: force noise measured while at rest.
        zero_shift_n: last tare minus first; NaN without a second tare.
        zero_step_n: the largest change from one tare to the next, NaN likewise.
        second_zero_shift_n: of the second channel, like `zero_shift_n`; NaN without one.
        lag: measured lag of force behind travel; `lag_corrected_s` of it was corrected.
        clocks: origin of each channel's times.
        gauge: whether travel was measured across the contact.
        across_n: (N, 2) force across the pressing axis, for the sensor's other axes in the order
            x, y, z, tared like the axial one; None where the sensor has no other axis.
        lateral_noise_n: rms of its size in free air; NaN without it.
        torque_n_m: (N, 3) torque about these two axes and about the pressing axis, tared likewise;
            None where the sensor measures no torque.
        torque_noise_n_m: rms of the first two together in free air; NaN without them.
        axis: the pressing axis, "+fx" … "-fz".
        looked: whether the loading could end early at a level (`until`).
        doubts: sentences that block every figure: a rule that stopped the run says that its
            readings were wrong.
        arm_m: position of the arm beside a `gauge`; None without one.
        second_n: the second force channel, tared; NaN where it has no sample, None without one.
    """

    time_s: FloatArray
    force_n: FloatArray
    travel_m: FloatArray
    phase: IntArray
    cycle: IntArray
    touches: tuple[TouchPoint, ...]
    noise_n: float
    zero_shift_n: float
    lag: Lag
    lag_corrected_s: float
    clocks: tuple[ChannelClock, ...]
    gauge: bool
    across_n: FloatArray | None = None
    lateral_noise_n: float = math.nan
    torque_n_m: FloatArray | None = None
    torque_noise_n_m: float = math.nan
    axis: str = "+fz"
    zero_step_n: float = math.nan
    second_zero_shift_n: float = math.nan
    looked: bool = False
    doubts: tuple[str, ...] = ()
    arm_m: FloatArray | None = None
    second_n: FloatArray | None = None

    @property
    def contact(self) -> IntArray:
        """(N,) number of touches before each sample, which changes where the contact was opened.

        A pause opens the contact within a cycle; cycles without lift-off share one contact.
        """
        times = np.array([touch.time_s for touch in self.touches])
        return np.searchsorted(times, self.time_s, side="right")

    def branch(self, phases: Sequence[Phase], cycle: int | None = None) -> NDArray[np.bool_]:
        """Mask (N,) of the samples in `phases`, of one cycle or of all."""
        mask = np.isin(self.phase, phases)
        return mask if cycle is None else mask & (self.cycle == cycle)

    def first_loading(self) -> NDArray[np.bool_]:
        """Mask (N,) of the loading of the first cycle; of no sample where nothing was loaded."""
        loading = self.branch(LOADING)
        return loading & (self.cycle == self.cycle[loading].min()) if loading.any() else loading


def holds_of(phase: IntArray) -> NDArray[np.intp]:
    """(N,) number of the hold that each sample is in, from 1; 0 where the force is changing."""
    resting = np.isin(phase, HOLDS)
    begins = resting & ~np.concatenate([[False], resting[:-1] & (phase[1:] == phase[:-1])])
    return np.where(resting, np.cumsum(begins), 0)


def event_number(event: Event, key: str) -> float:
    """A numeric value of an event.

    Raises:
        BadInputError: the event has no such number.
    """
    value = event.data.get(key)
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise BadInputError(
            f"event {event.kind!r} at {event.time_s:.3f} s has no number {key!r}"
        ) from None


def _touches(recording: Recording) -> tuple[TouchPoint, ...]:
    return tuple(
        TouchPoint(
            time_s=event.time_s,
            position_m=event_number(event, "position_m"),
            force_n=event_number(event, "force_n"),
            cycle=int(event_number(event, "cycle")),
            purpose=str(event.data.get("purpose", "")),
            travel_m=0.0,
        )
        for event in recording.events
        if event.kind == "touch"
    )


def _tares(recording: Recording) -> list[tuple[float, float, float, float]]:
    """(time_s, mean_n, noise_n, second_mean_n) of every tare; NaN without a second channel."""
    return [
        (
            event_number(event, "time_s"),
            event_number(event, "mean_n"),
            event_number(event, "noise_n"),
            number_or_nan(event.data.get("second_mean_n")),
        )
        for event in recording.events
        if event.kind in ("tare", "zero_shift")
    ]


def _zeroed(
    aligned: Aligned, touches: Sequence[TouchPoint], travel_m: FloatArray, *, circled: bool
) -> tuple[FloatArray, tuple[TouchPoint, ...]]:
    """Travel (N,) from the last touch before the first loading, and the touches with their travel.

    A run that was not loaded has its first touch for a zero. `circled`: touches on a circle, which
    measure the plate's tilt and are of no cycle, are in the record.
    """
    if not touches:
        raise BadInputError(
            "nothing was pressed: the run ended after touches that measure the plate's tilt"
            if circled
            else "nothing was pressed: the run ended before it touched the payload",
            hint="see why it stopped: `stepload replay` and the report",
        )
    times = np.array([touch.time_s for touch in touches])
    index = np.minimum(np.searchsorted(aligned.time_s, times), len(travel_m) - 1)
    loaded_s = aligned.time_s[np.isin(aligned.phase, LOADING)]
    began = 0
    if loaded_s.size:
        began = max(int(np.searchsorted(times, loaded_s[0], side="right")) - 1, 0)
    since_m = travel_m - travel_m[index[began]]
    told = (
        touch.model_copy(update={"travel_m": float(m)})
        for touch, m in zip(touches, since_m[index], strict=True)
    )
    return since_m, tuple(told)


def _tared(
    columns: FloatArray, aligned: Aligned, recording: Recording
) -> tuple[FloatArray | None, float]:
    """Tared components (N, M), with the rms of the first two in free air.

    A sensor with one axis writes a constant for the others, and has none: None and NaN.
    """
    if not np.isfinite(columns).all() or not np.ptp(columns[:, :2], axis=0).any():
        return None, math.nan
    times, means, rest = [], [], []
    for event in recording.events:
        if event.kind not in ("tare", "zero_shift") or "duration_s" not in event.data:
            continue
        end_s = event_number(event, "time_s")
        begin_s = end_s - event_number(event, "duration_s")
        inside = columns[(aligned.time_s >= begin_s) & (aligned.time_s <= end_s)]
        if len(inside):
            times.append(end_s)
            means.append(inside.mean(axis=0))
            rest.append(np.mean((inside - means[-1]) ** 2, axis=0)[:2].sum())
    if not times:
        return None, math.nan
    zero = np.stack(
        [np.interp(aligned.time_s, times, component) for component in np.transpose(means)], axis=1
    )
    return np.asarray(columns - zero), math.sqrt(float(np.median(rest)))


def largest_step(means_n: FloatArray) -> float:
    """The largest change of zeros (T,) from one to the next, with its sign; NaN of one zero."""
    steps = np.diff(means_n)
    return float(steps[np.argmax(np.abs(steps))]) if steps.size else math.nan


def stop_doubts(events: Sequence[Event]) -> tuple[str, ...]:
    """Doubts about every figure of a run that was stopped because its readings were wrong: when
    a rule sees it the channel may have been wrong for long, within what the rule allows."""
    return tuple(
        f"the run was stopped by {rule} ({means}: {printable(str(event.data.get('message')), 400)})"
        "; what was wrong then may have been wrong before, within what the rule allows"
        for event in events
        if event.kind == "trip"
        and (means := WRONG_READINGS.get(rule := str(event.data.get("rule"))))
    )


def _check_times(recording: Recording, time_s: FloatArray) -> None:
    """Sample times must be those of a run: what comes after builds even grids from them."""
    step_s = np.diff(time_s)
    usual_s = float(np.median(step_s)) if len(step_s) else 0.0
    longest_s = MOST_MISSING * len(time_s) * usual_s
    if not (np.isfinite(time_s).all() and (step_s >= 0.0).all() and usual_s > 0.0):
        problem = "are not finite and rising"
    elif time_s[-1] - time_s[0] > longest_s:
        problem = f"span {time_s[-1] - time_s[0]:.3g} s in steps of {usual_s:.3g} s"
    else:
        return
    raise BadInputError(
        f"{recording.path}: the times of {len(time_s)} force samples {problem}",
        hint="such data cannot be evaluated; export what you trust of them as CSV",
    )


def press_data(
    recording: Recording, axis: str | None = None, across: Across | None = None
) -> PressData:
    """Bring a recording into the form that identification takes.

    Args:
        recording: of one run.
        axis: force axis; None: that of the recording.
        across: effect of lateral force on the travel of the arm, which is corrected here for all
            later steps. It does not act on a gauge across the contact.

    Raises:
        BadInputError: no touch, no tare, or no data to align.
    """
    tares = _tares(recording)
    if not tares:
        raise BadInputError(
            "the run has no tare: it ended before the zero of force was known",
            hint="see why it stopped: `stepload replay` and the report",
        )
    raw = align(recording, axis)
    _check_times(recording, raw.time_s)
    busy = np.isin(raw.phase, [*LOADING, *UNLOADING])
    gauge = raw.displacement_m is not None
    # Of the travel that is identified: damping of the load path delays the arm, not the gauge.
    raw_m = raw.position_m if raw.displacement_m is None else raw.displacement_m
    lag = measure_lag(raw.time_s, raw.force_n, raw_m, busy)
    lag_s = lag.correction_s
    aligned = align(recording, axis, lag_s) if lag_s else raw
    times, means, noises, seconds = (np.array(column) for column in zip(*tares, strict=True))
    travel_m = aligned.displacement_m if gauge else aligned.position_m
    assert travel_m is not None
    force_n = aligned.force_n - np.interp(aligned.time_s, times, means)
    across_n, lateral_noise_n = _tared(aligned.across_n, aligned, recording)
    torque_n_m, torque_noise_n_m = _tared(aligned.torque_n_m, aligned, recording)
    if across is not None and across_n is not None and not gauge:
        travel_m = travel_m - across.taken_m(force_n, across_n)
    second_n = aligned.second_n
    circled = any(event.kind == "circle_touch" for event in recording.events)
    since_m, touches = _zeroed(aligned, _touches(recording), travel_m, circled=circled)
    return PressData(
        time_s=aligned.time_s,
        force_n=force_n,
        travel_m=since_m,
        phase=aligned.phase,
        cycle=aligned.cycle,
        touches=touches,
        noise_n=float(np.median(noises)),
        zero_shift_n=float(means[-1] - means[0]) if len(means) > 1 else math.nan,
        lag=lag,
        lag_corrected_s=lag_s,
        clocks=aligned.clocks,
        gauge=gauge,
        across_n=across_n,
        lateral_noise_n=lateral_noise_n,
        torque_n_m=torque_n_m,
        torque_noise_n_m=torque_noise_n_m,
        axis=axis or recording.metadata["force_axis"],
        zero_step_n=largest_step(means),
        second_zero_shift_n=float(seconds[-1] - seconds[0]) if len(seconds) > 1 else math.nan,
        looked=any(event.kind == "until" for event in recording.events),
        doubts=stop_doubts(recording.events),
        arm_m=aligned.position_m if gauge else None,
        second_n=None if second_n is None else second_n - np.interp(aligned.time_s, times, seconds),
    )
