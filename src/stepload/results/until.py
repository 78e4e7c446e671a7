"""How far a run was loaded, and whether that sufficed for the interval that its plan requires."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from stepload.envelope.until import MARGIN, Need, Until
from stepload.evidence.identification import Identification
from stepload.evidence.quantity import ResultVerdict
from stepload.record.reader import Event
from stepload.results.model import Field, Table, named, quantity, table
from stepload.results.press_data import event_number
from stepload.units import beside_limit, format_quantity


@dataclass(frozen=True, slots=True)
class Look:
    """One level of the first loading: the payload's deformation from 10 % of the level to it, the
    required deformation (inf where none suffices), and the verdict: more, enough, unreachable."""

    level_n: float
    deformation_m: float
    needed_m: float
    verdict: str


@dataclass(frozen=True, slots=True)
class Loaded:
    """How far a run was loaded.

    Attributes:
        asked: half width required by the plan.
        verdict: "enough", "unreachable"; "more" where the loading ended before either.
        level_n: the highest level of the first loading.
        top_force_n: that of the plan.
        half_width: of the resulting interval; None where there is none.
        met: whether the result is identified with an interval as narrow as required.
        looks: every level.
    """

    asked: float
    verdict: str
    level_n: float
    top_force_n: float
    half_width: float | None
    met: bool
    looks: tuple[Look, ...]

    @property
    def text(self) -> str:
        """The same in a sentence."""
        asked, last = f"±{100.0 * self.asked:g} %", self.looks[-1]
        top = format_quantity(self.top_force_n, "N")
        said = f"loaded to {format_quantity(self.level_n, 'N')} of {top}: "
        if self.verdict == "unreachable":
            return said + f"{asked} was out of reach, even at {top}"
        if self.verdict == "enough":
            deformation, needed = last.deformation_m, last.needed_m
            said += f"it deformed by {format_quantity(deformation, 'm')}, {asked} needs "
            said += format_quantity(needed, "m")
        else:
            said += f"no level showed enough deformation for {asked}"
        if self.met:
            return said
        if self.half_width is None or not math.isfinite(self.half_width):
            return f"{said}; the run has no interval"
        found = f"the interval came out as ±{beside_limit(self.half_width, self.asked)[0]}"
        return f"{said}; {found}" + (
            ", but the result is not identified" if self.half_width <= self.asked else ""
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
            event_number(event, "level_n"),
            event_number(event, "deformation_m"),
            event_number(event, "needed_m"),
            str(event.data.get("verdict", "")),
        )
        for event in told
    )
    headline = found.headline if found is not None else None
    half = headline.half_width if headline is not None else None
    identified = headline is not None and headline.verdict is ResultVerdict.IDENTIFIED
    asked = event_number(told[-1], "asked")
    return Loaded(
        asked=asked,
        verdict=looks[-1].verdict,
        level_n=looks[-1].level_n,
        top_force_n=event_number(told[-1], "top_force_n"),
        half_width=half,
        met=identified and half is not None and half <= asked,
        looks=looks,
    )


def _needed(deformation_m: float) -> str:
    return quantity("m")(deformation_m) if math.isfinite(deformation_m) else "none is enough"


LOOK: tuple[Field[Look], ...] = (
    named("level_n", "level", quantity("N")),
    named("deformation_m", "deformation from 10 % of it to the level", quantity("m")),
    Field(lambda look: look.needed_m, "", "deformation needed", _needed),
    named("verdict", "decision"),
)  # fmt: skip


def until_table(found: Loaded) -> Table:
    """Results of every level of the first loading."""
    title = f"How far to load for ±{100.0 * found.asked:g} %"
    return table(title, LOOK, found.looks, (found.text,), page_only=True)


NEED: tuple[Field[Need], ...] = (
    named("level_n", "level", quantity("N")),
    Field(lambda need: need.needed_m, "", "deformation needed", _needed),
    named("expected_m", "deformation by theory", quantity("m")),
    named("half_width", "half width by theory", lambda half: f"±{half:.1%}"),
    Field(lambda n: "yes" if n.expected_m >= n.needed_m else "no", "", "enough by theory"),
)


def need_table(until: Until) -> Table:
    """Requirements of every level before the run."""
    top, expected = quantity("N")(until.needs[-1].level_n), "By theory "
    if until.expected is None:
        expected += f"no level up to {top} is enough"
    else:
        expected += f"the loading ends at {quantity('N')(until.needs[until.expected].level_n)}"
        expected += f" of {top}"
    expected += "; the run goes by the deformation that it measures."
    notes = [
        expected,
        "Deformation is that of the payload from 10 % of a level to the level. Half width is that "
        f"of the 95 % interval of the chord, {MARGIN:g} times what the known errors give.",
    ]
    return table(f"How far to load for ±{100.0 * until.asked:g} %", NEED, until.needs, notes)
