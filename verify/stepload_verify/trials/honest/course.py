"""Phase, cycle and demanded force of every sample of a step-load run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.record.rows import Phase

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Procedure:
    """How a run is pressed; forces in N, times in s."""

    top_n: float
    levels: int
    cycles: int
    hold_s: float
    rate_hz: float
    touch_n: float
    ramp_s: float = 1.0
    tare_s: float = 3.0


@dataclass(frozen=True, slots=True)
class Segment:
    """One stretch: force from → to and gap from → to (shares of the retract), linear in time."""

    phase: Phase
    cycle: int
    start: int
    stop: int
    from_n: float
    to_n: float
    from_gap: float = 0.0
    to_gap: float = 0.0


@dataclass(frozen=True, slots=True)
class Touched:
    """Where a touch was found: index of its sample, cycle and purpose."""

    index: int
    cycle: int
    purpose: str


@dataclass(frozen=True, slots=True)
class Course:
    """A run's plan over samples.

    `time_s`, `phase`, `cycle`, `gap` are (N,); `tares` are slices of free air that the zero of
    force is taken from.
    """

    time_s: FloatArray
    phase: IntArray
    cycle: IntArray
    gap: FloatArray
    segments: tuple[Segment, ...]
    touches: tuple[Touched, ...]
    tares: tuple[slice, ...]

    def forces(self, ends_n: FloatArray | None = None) -> FloatArray:
        """Demanded forces (N,): straight in every segment.

        Args:
            ends_n: (S,) the force at which each segment really ended; the next begins there.
        """
        force = np.empty(self.time_s.size)
        follows = False
        for number, each in enumerate(self.segments):
            first_n = each.from_n
            if follows and ends_n is not None:
                first_n = float(ends_n[number - 1])
            if each.phase in HOLDS:
                force[each.start : each.stop] = first_n
            else:
                count = each.stop - each.start
                share = np.arange(1, count + 1) / count
                force[each.start : each.stop] = first_n + (each.to_n - first_n) * share
            follows = each.phase in (*HOLDS, *MOVES)
        return force


HOLDS = (Phase.HOLD, Phase.UNLOAD_HOLD)
MOVES = (Phase.LOAD, Phase.UNLOAD)
CLOSING_SAMPLES = 2
APPROACH_S, RETRACT_S, DWELL_S = 0.6, 0.25, 0.06


class _Writer:
    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        self.at = 0
        self.segments: list[Segment] = []
        self.touches: list[Touched] = []
        self.tares: list[slice] = []

    def add(self, phase: Phase, cycle: int, seconds: float, forces: tuple[float, float],
            gaps: tuple[float, float] = (0.0, 0.0)) -> None:  # fmt: skip
        stop = self.at + max(round(seconds * self.rate_hz), CLOSING_SAMPLES)
        self.segments.append(Segment(phase, cycle, self.at, stop, *forces, *gaps))
        self.at = stop

    def tare(self, phase: Phase, cycle: int, seconds: float) -> None:
        start = self.at
        self.add(phase, cycle, seconds, (0.0, 0.0), (1.0, 1.0))
        self.tares.append(slice(start, self.at))

    def touch(self, cycle: int, purpose: str, reached_n: float, first_n: float) -> None:
        """Close the gap, press until the touch is seen, dwell there."""
        self.add(Phase.GUARDED_APPROACH, cycle, APPROACH_S, (0.0, 0.0), (1.0, 0.0))
        closing_s = CLOSING_SAMPLES / self.rate_hz
        self.add(Phase.GUARDED_APPROACH, cycle, closing_s, (first_n, reached_n))
        self.touches.append(Touched(self.at - 1, cycle, purpose))
        self.add(Phase.DWELL, cycle, DWELL_S, (reached_n, reached_n))

    def release(self, phase: Phase, cycle: int, from_n: float, last_n: float) -> None:
        """Unload fast to the force at which the contact opens, then go back."""
        self.add(phase, cycle, 0.4 * RETRACT_S, (from_n, last_n))
        self.add(phase, cycle, 0.6 * RETRACT_S, (0.0, 0.0), (0.0, 1.0))


def course(
    procedure: Procedure, rng: np.random.Generator, first_n: float = 0.0, last_n: float = 0.0
) -> Course:
    """A run: tare, three touches, cycles of steps up and down, a tare after each, a last touch.

    Args:
        procedure: how it is pressed.
        rng: how far beyond the threshold each touch is seen.
        first_n: force with which the contact closes; below 0 where it pulls.
        last_n: force at which it opens.
    """
    write = _Writer(procedure.rate_hz)
    levels = procedure.top_n * np.arange(1, procedure.levels + 1) / procedure.levels

    def seen() -> float:
        return procedure.touch_n * rng.uniform(1.0, 1.3)

    write.tare(Phase.TARE, 1, procedure.tare_s)
    for cycle in range(1, procedure.cycles + 1):
        reached = seen()
        for purpose in ("first", "again") if cycle == 1 else ():
            write.touch(1, purpose, reached, first_n)
            write.release(Phase.TOUCH_RETRACT, 1, reached, last_n)
            reached = seen()
        write.touch(cycle, "again" if cycle == 1 else "cycle", reached, first_n)
        before = reached
        for level in levels:
            write.add(Phase.LOAD, cycle, procedure.ramp_s, (before, level))
            write.add(Phase.HOLD, cycle, procedure.hold_s, (level, level))
            before = level
        for level in levels[-2::-1]:
            write.add(Phase.UNLOAD, cycle, procedure.ramp_s, (before, level))
            write.add(Phase.UNLOAD_HOLD, cycle, procedure.hold_s, (level, level))
            before = level
        write.release(Phase.RETRACT, cycle, before, last_n)
        last = cycle == procedure.cycles
        write.tare(Phase.POST_TARE, cycle, procedure.tare_s if last else 1.0)
    reached = seen()
    write.touch(procedure.cycles, "last", reached, first_n)
    write.release(Phase.RETRACT, procedure.cycles, reached, last_n)
    counts = [each.stop - each.start for each in write.segments]
    gap = np.concatenate(
        [np.linspace(each.from_gap, each.to_gap, count)
         for each, count in zip(write.segments, counts, strict=True)]
    )  # fmt: skip
    return Course(
        time_s=np.arange(write.at) / procedure.rate_hz,
        phase=np.repeat([int(each.phase) for each in write.segments], counts),
        cycle=np.repeat([each.cycle for each in write.segments], counts),
        gap=gap,
        segments=tuple(write.segments),
        touches=tuple(write.touches),
        tares=tuple(write.tares),
    )
