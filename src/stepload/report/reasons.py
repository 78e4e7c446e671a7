"""What the reader of a run's result must know, the same sentences for page and program."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stepload.feasibility.domains import beyond_range, payload_doubts
from stepload.identification.identify import Identification
from stepload.identification.quantity import ResultVerdict
from stepload.record.reader import Event
from stepload.report.analyse import Evaluation
from stepload.report.model import number_or_nan
from stepload.report.press_data import LOADING, UNLOADING, PressData, event_number
from stepload.report.rows import Row, figure
from stepload.units import beside_limit, format_quantity

MOST_SHORT = 0.9
"""A later loading counts where it reached this share of the highest force of the first."""


def remarks(data: PressData) -> tuple[str, ...]:
    """Remarks that accompany every result of this run."""
    return tuple(text for text in (undetected(data), reopened(data)) if text)


def undetected(data: PressData) -> str:
    """Reason why the data of this run cannot show set, creep and drift; "" where they can."""
    loading = data.branch(LOADING)
    numbers = np.unique(data.cycle[loading])
    if not numbers.size:
        return ""
    tops = [float(data.force_n[loading & (data.cycle == number)].max()) for number in numbers]
    unloaded = bool(data.branch(UNLOADING).any())
    if sum(top >= MOST_SHORT * tops[0] for top in tops) < 2:
        what = "only the gap between loading and unloading" if unloaded else "nothing in this run"
        return (
            "one loading only: set, creep and drift cannot be told from the law; "
            f"{what} hints at them"
        )
    return "" if unloaded else "no holds on the way down: creep cannot be told from set and drift"


def reopened(data: PressData) -> str:
    """Shift of the touch after each pause from the zero; "" without a pause."""
    shifts = [touch.travel_m for touch in data.touches if touch.purpose == "resume"]
    told = ", ".join(f"{format_quantity(shift, 'm', digits=3)}" for shift in shifts)
    return told and (
        f"the contact was opened by a pause and touched again at {told} from the zero of the run: "
        "drift over the pause, and a quantum for each touch, are in the steps after it"
    )


def sideways(events: Sequence[Event]) -> tuple[str, ...]:
    """The plate's tilt where it was touched on a circle."""
    tilts = [event.data for event in events if event.kind == "tilt"]
    if not tilts:
        return ()
    angle, sigma, limit = (
        math.degrees(number_or_nan(tilts[-1].get(key)))
        for key in ("angle_rad", "sigma_rad", "limit_rad")
    )
    return (
        f"three touches on a circle: the plate is tilted by {angle:.2f} ± {2.0 * sigma:.2f}"
        f" deg (95 %) against the approach, {limit:.2g} deg were allowed",
    )


def levels(events: Sequence[Event]) -> tuple[str, ...]:
    """Levels that were not reached, according to the events of the run."""
    held, missed = (sum(e.kind == kind for e in events) for kind in ("held", "level_missed"))
    told = f"{missed} of {held} levels were not reached in their time: held at the force there was"
    return (told,) if missed else ()


def reasons_of(run: Evaluation) -> list[str]:
    """All remarks on the result but the problem that left it out, doubts first."""
    found, events = run.identification, run.recording.events
    reasons = [*found.reasons] if found is not None else []
    if (until := loaded(events, found)) is not None:
        reasons.append(until.text)
    if run.data is not None:
        reasons += [
            *remarks(run.data), *levels(events), *sideways(events),
            *beyond_theory(run),
        ]  # fmt: skip
    if resumed := run.recording.metadata.get("resumed"):
        reasons.append(resumed)
    return reasons


def beyond_theory(run: Evaluation) -> tuple[str, ...]:
    """Doubts about theory at the forces that were reached, as sentences."""
    headline = run.identification.headline if run.identification is not None else None
    if headline is None:
        return ()
    preflight = run.preflight
    doubts = payload_doubts(
        preflight.plan.payload, preflight.theory, headline.from_n, headline.to_n
    )
    ends = headline.interval_n_per_m
    return (
        *beyond_range(preflight.theory, ends, headline.from_n, headline.to_n),
        *(doubt.message for doubt in doubts if not doubt.harmless),
    )


class Look(Row):
    """One level of the first loading."""

    level_n: float = figure("The level.")
    deformation_m: float = figure("Deformation of the payload from 10 % of the level to it.")
    needed_m: float | None = figure("Deformation that is needed; null where none is enough.")
    verdict: str = figure("more, enough or unreachable.")


class Loaded(Row):
    """How far the first loading went for the interval that the plan asks for."""

    requested: float = figure("Half width that the plan asks for, as a share.")
    verdict: str = figure(
        "What the last level said: unreachable (the run stopped there), enough (the loading ended"
        " there), more (neither)."
    )
    level_n: float = figure("Highest level of the first loading.")
    top_force_n: float = figure("Top force of the plan.")
    half_width: float | None = figure("Half width of the interval of the headline, as a share.")
    met: bool = figure(
        "Whether the headline is identified with an interval as narrow as asked for."
    )
    looks: tuple[Look, ...] = figure("Every level of the first loading.")

    @property
    def text(self) -> str:
        """The same in a sentence."""
        requested, last = f"±{100.0 * self.requested:g} %", self.looks[-1]
        top = format_quantity(self.top_force_n, "N")
        said = f"loaded to {format_quantity(self.level_n, 'N')} of {top}: "
        if self.verdict == "unreachable":
            return said + f"{requested} was out of reach, even at {top}"
        if self.verdict == "enough":
            deformation, needed = last.deformation_m, last.needed_m
            said += f"it deformed by {format_quantity(deformation, 'm')}, {requested} needs "
            said += format_quantity(needed or math.inf, "m")
        else:
            said += f"no level showed enough deformation for {requested}"
        if self.met:
            return said
        if self.half_width is None or not math.isfinite(self.half_width):
            return f"{said}; the run has no interval"
        found = f"the interval came out as ±{beside_limit(self.half_width, self.requested)[0]}"
        return f"{said}; {found}" + (
            ", but the result is not identified" if self.half_width <= self.requested else ""
        )


def loaded(events: Sequence[Event], found: Identification | None) -> Loaded | None:
    """How far a run was loaded; None where its plan has no such rule, or no level was held.

    Raises:
        BadInputError: an event of the record lacks a value.
    """
    told = [event for event in events if event.kind == "until"]
    if not told:
        return None
    looks = tuple(
        Look(
            level_n=event_number(event, "level_n"),
            deformation_m=event_number(event, "deformation_m"),
            needed_m=event_number(event, "needed_m"),
            verdict=str(event.data.get("verdict", "")),
        )
        for event in told
    )
    headline = found.headline if found is not None else None
    half = headline.half_width if headline is not None else None
    identified = headline is not None and headline.verdict is ResultVerdict.IDENTIFIED
    requested = event_number(told[-1], "requested")
    return Loaded(
        requested=requested,
        verdict=looks[-1].verdict,
        level_n=looks[-1].level_n,
        top_force_n=event_number(told[-1], "top_force_n"),
        half_width=half,
        met=identified and half is not None and half <= requested,
        looks=looks,
    )
