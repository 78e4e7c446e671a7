"""How a run ended, as data: what stopped it, what it touched and tared, what safing did."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

SURE_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Tare:
    """Measurement of the channels at rest in free air, not tared; second channel NaN where none.

    `time_s` is that of its last reading, `noise_n` the standard deviation about the slope, `wrench`
    the mean of the force sensor's six components in N and N·m, () where it was not taken, `live`
    how many of its three forces ever changed.
    """

    time_s: float
    duration_s: float
    samples: int
    mean_n: float
    noise_n: float
    slope_n_per_s: float
    second_mean_n: float
    second_noise_n: float
    wrench: tuple[float, ...] = ()
    live: int = 3

    @property
    def mean_error_n(self) -> float:
        """Standard error of `mean_n`."""
        return self.noise_n / math.sqrt(self.samples)

    @property
    def second_mean_error_n(self) -> float:
        """Standard error of `second_mean_n`."""
        return self.second_noise_n / math.sqrt(self.samples)

    @property
    def sure_noise_n(self) -> float:
        """Lower bound (3 sigma) of the noise."""
        return self.noise_n * (1.0 - SURE_SIGMAS / math.sqrt(2.0 * self.samples))

    @property
    def sure_slope_n_per_s(self) -> float:
        """Lower bound (3 sigma) of the drift's size; 0 where none is sure."""
        return max(0.0, abs(self.slope_n_per_s) - self._slope_bound_n_per_s)

    @property
    def largest_slope_n_per_s(self) -> float:
        """Upper bound (3 sigma) of the drift's size."""
        return abs(self.slope_n_per_s) + self._slope_bound_n_per_s

    @property
    def _slope_bound_n_per_s(self) -> float:
        return SURE_SIGMAS * self.noise_n * math.sqrt(12.0 / self.samples) / self.duration_s


class Touch(NamedTuple):
    """One raw touch point: position and tared force at the tick of detection."""

    time_s: float
    position_m: float
    force_n: float
    speed_m_s: float
    cycle: int
    purpose: str


class Cause(NamedTuple):
    """Why a run was stopped; the first one wins.

    `rule` is a code of `stepload.engine.rules`, or a word for another cause ("device", "drift" …).
    `sample_age_s` is the age of the sample that it was judged by.
    """

    rule: str
    value: float
    limit: float
    unit: str
    sample_age_s: float
    time_s: float
    message: str

    @property
    def planned(self) -> bool:
        """Whether the plan asked for this end: nothing is wrong with the rig."""
        return self.rule == "until"

    @property
    def numbers(self) -> str:
        """Value, limit and age as text; "" where a device or a part broke: it has no numbers, and
        where the message has them."""
        if self.planned or not (self.unit or self.rule.startswith(("R", "CAP"))):
            return ""
        value, limit = (
            f"{number:.6g} {self.unit}" if self.unit else f"{number:.0f}"
            for number in (self.value, self.limit)
        )
        age_ms = self.sample_age_s * 1e3
        return f" (value {value}, limit {limit}, judged by a sample {age_ms:.1f} ms old)"


@dataclass(frozen=True, slots=True)
class ActionResult:
    """The result of one action; `error` "" when it was confirmed. Times on the host's clock."""

    name: str
    sent: bool
    error: str
    start_s: float
    duration_s: float


class RunStatus(StrEnum):
    """How a run ended; values are stable, they are written to records."""

    COMPLETED = "completed"
    STOPPED = "stopped"
    """By the supervisor, a device or the procedure."""
    INTERRUPTED = "interrupted"
    """By the operator."""
    UNFINISHED = "unfinished"
    """Its record breaks off: the process or the host that wrote it ended."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late ticks began; `overruns` counts those later than one period."""

    ticks: int
    overruns: int
    worst_s: float
    mean_s: float


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """The outcome of a run. `retracted`: the loop itself brought the arm back."""

    status: RunStatus
    cause: Cause | None
    why: str
    retracted: bool
    safing: tuple[ActionResult, ...]
    start_s: float
    end_s: float
    peak_force_n: float
    zero_shift_n: float
    levels_done: int
    cycle: int
    touches: tuple[Touch, ...]
    tares: tuple[Tare, ...]
    lateness: Lateness
    signal_number: int = 0
    errors: tuple[str, ...] = field(default=())

    @property
    def duration_s(self) -> float:
        """From the first tick to the last."""
        return self.end_s - self.start_s

    @property
    def safing_failed(self) -> bool:
        """Whether an action that makes the rig safe was not confirmed."""
        return any(action.error for action in self.safing)
