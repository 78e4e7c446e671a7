"""What a recording says about the contact: tared force and travel since touch on one time base."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.record.align import Aligned, ChannelClock, align
from stepload.record.lag import Lag, measure_lag
from stepload.record.reader import Event, Recording
from stepload.record.rows import Phase

FloatArray = NDArray[np.float64]
MOST_MISSING = 20.0
"""A record from which nineteen of twenty samples are missing is none to evaluate."""
IntArray = NDArray[np.integer]

LOADING = (Phase.LOAD, Phase.HOLD)
UNLOADING = (Phase.UNLOAD, Phase.UNLOAD_HOLD)
LAG_THAT_MATTERS_S = 0.5e-3
"""Below this a lag moves no result; above it, it is corrected where it is significant."""


@dataclass(frozen=True, slots=True)
class TouchPoint:
    """One touch as the engine saw it; `purpose` is first, again, cycle, resume or last."""

    time_s: float
    position_m: float
    force_n: float
    cycle: int
    purpose: str


@dataclass(frozen=True, slots=True)
class PressData:
    """One run on one time base, arrays of equal length (N,).

    Attributes:
        time_s: on the run's clock.
        force_n: contact force, zero drift taken out linearly between the tares.
        travel_m: displacement since the touch that began the cycle: of arm, system and payload,
            or of the payload alone where `gauge`.
        phase, cycle: of the engine's tick.
        touches: raw touch points in the order of time.
        noise_n: force noise measured while at rest.
        zero_shift_n: last tare minus first; NaN without a second tare.
        lag: measured lag of force behind position; `lag_corrected_s` of it was taken out.
        clocks: where each channel's times come from.
        gauge: whether travel was measured across the contact.
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

    def branch(self, phases: Sequence[Phase], cycle: int | None = None) -> NDArray[np.bool_]:
        """Mask (N,) of the samples in `phases`, of one cycle or of all."""
        mask = np.isin(self.phase, phases)
        return mask if cycle is None else mask & (self.cycle == cycle)


def number(event: Event, key: str) -> float:
    """A number that an event tells.

    Raises:
        BadInputError: it does not.
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
            event.time_s,
            number(event, "position_m"),
            number(event, "force_n"),
            int(number(event, "cycle")),
            str(event.data.get("purpose", "")),
        )
        for event in recording.events
        if event.kind == "touch"
    )


def _tares(recording: Recording) -> list[tuple[float, float, float]]:
    """(time_s, mean_n, noise_n) of every look at free air."""
    return [
        (
            number(event, "time_s"),
            number(event, "mean_n"),
            number(event, "noise_n"),
        )
        for event in recording.events
        if event.kind in ("tare", "zero_shift")
    ]


def _origins(aligned: Aligned, touches: Sequence[TouchPoint], travel_m: FloatArray) -> FloatArray:
    """Travel (N,) at the touch that last preceded each sample; the first touch before any."""
    if not touches:
        raise BadInputError(
            "the run has no touch: the surface was not found before it ended",
            hint="see why it stopped: `stepload replay` and the report",
        )
    times = np.array([touch.time_s for touch in touches])
    index = np.minimum(np.searchsorted(aligned.time_s, times), len(travel_m) - 1)
    latest = np.maximum(np.searchsorted(times, aligned.time_s, side="right") - 1, 0)
    return travel_m[index][latest]


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


def press_data(recording: Recording, axis: str | None = None) -> PressData:
    """Bring a recording into the form that identification takes.

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
    lag = measure_lag(raw.time_s, raw.force_n, raw.position_m, busy)
    matters = abs(lag.lag_s) > max(3.0 * lag.sigma_s, LAG_THAT_MATTERS_S)
    lag_s = lag.lag_s if matters else 0.0
    aligned = align(recording, axis, lag_s) if lag_s else raw
    times, means, noises = (np.array(column) for column in zip(*tares, strict=True))
    travel_m = aligned.displacement_m if gauge else aligned.position_m
    assert travel_m is not None
    touches = _touches(recording)
    return PressData(
        time_s=aligned.time_s,
        force_n=aligned.force_n - np.interp(aligned.time_s, times, means),
        travel_m=travel_m - _origins(aligned, touches, travel_m),
        phase=aligned.phase,
        cycle=aligned.cycle,
        touches=touches,
        noise_n=float(np.median(noises)),
        zero_shift_n=float(means[-1] - means[0]) if len(means) > 1 else math.nan,
        lag=lag,
        lag_corrected_s=lag_s,
        clocks=aligned.clocks,
        gauge=gauge,
    )
