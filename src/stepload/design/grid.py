"""The plans to be tried: top force, number of steps, ramps, holds."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path

from stepload.design.ceiling import Ceiling, rounded_down
from stepload.envelope.envelope import Envelope, derive
from stepload.envelope.order import CYCLES, Order
from stepload.envelope.reason import PlanVerdict, Severity
from stepload.envelope.until import planned_run
from stepload.envelope.unwritten import plan_of
from stepload.errors import BadInputError, DomainError, RefusedError
from stepload.evidence.expected import expected_chord
from stepload.evidence.pressed import Pressed
from stepload.evidence.quantity import Quantity
from stepload.plan.problems import PlanError
from stepload.units import format_quantity

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Top forces, as shares of the largest."""
STEPS = (4, 6, 8, 12)
"""Numbers of steps. Fewer would be faster, but only ramps show what happens between two steps."""
HOLDS_S = (1.0, 2.0, 3.0, 5.0, 8.0)
RAMPS_S = (1.0, 2.0)
"""Ramp times from one level to the next; in a fast ramp a damped load path lags behind."""
MISSED = ("slow_steps",)
"""Preflight warnings that a level may not be reached, so that the run would differ."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A plan that preflight accepts up to its top force.

    Attributes:
        top_n, step_n: its forces.
        share: its top force is about this share of the largest.
        order: its steps, ramps and holds.
        duration_s: its duration according to preflight.
        run: its run without error.
        chord: the chord of that, with the interval that is to be expected.
    """

    top_n: float
    step_n: float
    share: float
    order: Order
    duration_s: float
    run: Pressed
    chord: Quantity

    @property
    def half_width(self) -> float:
        """Expected half width of the interval, as a share of the chord."""
        return self.chord.half_width

    @property
    def can(self) -> bool:
        """Whether that is within ±1/t."""
        return self.half_width <= 1.0 / self.run.conditions.t

    @property
    def text(self) -> str:
        """The plan in a few words."""
        return (
            f"{format_quantity(self.top_n, 'N')} in {self.order.steps} steps of "
            f"{format_quantity(self.step_n, 'N')}, ramps of {self.order.ramp_s:g} s, "
            f"holds of {self.order.hold_s:g} s, "
            f"{CYCLES} cycles: {self.duration_s:.0f} s"
        )


@dataclass(frozen=True, slots=True)
class Grid:
    """The plans of a grid.

    Attributes:
        candidates: those that may run.
        refused: number of refused plans; `because` is preflight's reason for the last, which has
            the largest top force, `hint` what to do about it.
    """

    candidates: tuple[Candidate, ...]
    refused: int
    because: str
    hint: str = ""


def grid(rig: str, payload: Path, limit: Ceiling, surface: str) -> Grid:
    """Every plan of the grid that preflight accepts, and whose levels are reached."""
    found: list[Candidate] = []
    reasons: list[tuple[str, str]] = []
    for share, steps, hold_s, ramp_s in product(SHARES, STEPS, HOLDS_S, RAMPS_S):
        order = Order(steps, hold_s, ramp_s)
        step_n = rounded_down(share * limit.top_n / order.steps)
        top_n = round(step_n * order.steps, 9)
        try:
            plan = plan_of(rig, payload, top_n, order, surface)
            envelope = derive(plan)
        except PlanError:
            raise
        except (BadInputError, RefusedError, DomainError) as error:
            reasons.append((error.message, error.hint))
            continue
        if len(plan.procedure.levels_n) < steps:
            reasons.append((f"a step of {step_n:.3g} N does not exceed the touch force", ""))
            continue
        missed = [each for each in envelope.reasons if each.code in MISSED]
        if envelope.verdict is PlanVerdict.REFUSED or missed or envelope.climbs is None:
            reasons.append(_why(envelope))
            continue
        run = planned_run(envelope.plan, envelope.theory, envelope.climbs)
        found.append(
            Candidate(top_n, step_n, share, order, envelope.duration_s, run, expected_chord(run))
        )
    return Grid(tuple(found), len(reasons), *(reasons[-1] if reasons else ("", "")))


def _why(envelope: Envelope) -> tuple[str, str]:
    """The first reason against a plan, and what to do about it."""
    against = [r for r in envelope.reasons if r.severity is Severity.REFUSE]
    first = (against or [r for r in envelope.reasons if r.code in MISSED])[0]
    return first.message, first.remedy
