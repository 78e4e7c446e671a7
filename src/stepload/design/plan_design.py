"""The plan with the narrowest interval, below F_c and within a time."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from stepload.design.map_report import half_text, narrowing_text
from stepload.design.top_force import Ceiling, ceiling
from stepload.errors import BadInputError, DomainError, RefusedError
from stepload.feasibility.conditions import expected_result
from stepload.feasibility.draft_plan import CYCLES, Order, plan_of
from stepload.feasibility.preflight import Preflight, derive
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.identification.expected import Expected
from stepload.identification.quantity import ResultVerdict
from stepload.plan.problems import PlanError
from stepload.units import format_quantity, percent, rounded_down

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
        expected: its result to be expected.
    """

    top_n: float
    step_n: float
    share: float
    order: Order
    duration_s: float
    expected: Expected

    @property
    def half_width(self) -> float:
        """Expected half width of the interval, as a share of the chord."""
        return self.expected.chord.half_width

    @property
    def can(self) -> bool:
        """Whether that is within ±1/t."""
        return self.expected.chord.verdict is ResultVerdict.IDENTIFIED

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
            preflight = derive(plan)
        except PlanError:
            raise
        except (BadInputError, RefusedError, DomainError) as error:
            reasons.append((error.message, error.hint))
            continue
        if len(plan.procedure.levels_n) < steps:
            reasons.append((f"a step of {step_n:.3g} N does not exceed the touch force", ""))
            continue
        missed = [each for each in preflight.reasons if each.code in MISSED]
        if preflight.verdict is PlanVerdict.REFUSED or missed or preflight.loading_times is None:
            reasons.append(_why(preflight))
            continue
        expected = expected_result(preflight.plan, preflight.theory, preflight.loading_times)
        found.append(Candidate(top_n, step_n, share, order, preflight.duration_s, expected))
    return Grid(tuple(found), len(reasons), *(reasons[-1] if reasons else ("", "")))


def _why(preflight: Preflight) -> tuple[str, str]:
    """The first reason against a plan, and what to do about it."""
    against = [r for r in preflight.reasons if r.severity is Severity.REFUSE]
    first = (against or [r for r in preflight.reasons if r.code in MISSED])[0]
    return first.message, first.remedy


ALIKE = 1.02
"""Intervals that differ by less than this factor count as equal: the faster plan is preferred."""
LONGER = 2.0
"""Plans up to this multiple of the given time are tried, to show what more time would gain."""


@dataclass(frozen=True, slots=True)
class Design:
    """A designed plan, and the plans that it was chosen from.

    Attributes:
        ceiling: the largest top force and its reason.
        within_s: time that was given.
        grid: the plans that were looked at.
        tried: those of at most twice that time.
        chosen: the plan.
    """

    ceiling: Ceiling
    within_s: float
    grid: Grid
    tried: Sequence[Candidate]
    chosen: Candidate

    @property
    def curve(self) -> list[Candidate]:
        """Time against half width."""
        return front([each for each in self.tried if each.can])


def design(rig: str, payload: Path, *, within_s: float, surface: str) -> Design:
    """The plan with the narrowest interval, below F_c and within a time.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        payload: a payload file.
        within_s: largest duration of the plan, as computed by preflight.
        surface: travel to the surface, with its unit.

    Raises:
        BadInputError: no such rig or payload.
        PlanError: one of their files is invalid.
        RefusedError: no plan is fast enough, or none has an interval within ±1/t.
    """
    limit = ceiling(rig, payload, Order(min(STEPS), max(HOLDS_S)))
    found = grid(rig, payload, limit, surface)
    map_verb = shlex.join(["stepload", "map", rig, "--payload", str(payload)])
    _check_time(limit, found, within_s, map_verb)
    tried = [each for each in found.candidates if each.duration_s <= LONGER * within_s]
    chosen = choose(tried, within_s)
    if not chosen.can:
        raise _refusal(limit, tried, chosen, within_s)
    return Design(limit, within_s, found, tried, chosen)


def front(tried: Sequence[Candidate]) -> list[Candidate]:
    """Plans whose interval is narrower than that of every faster one, the fastest first."""
    found: list[Candidate] = []
    for each in sorted(tried, key=lambda one: (round(one.duration_s), one.half_width)):
        if not found or each.half_width < found[-1].half_width:
            found.append(each)
    return found


def choose(tried: Sequence[Candidate], within_s: float) -> Candidate:
    """The plan with the narrowest interval; of nearly equal ones the fastest."""
    soon = [each for each in tried if each.duration_s <= within_s]
    narrowest = min(each.half_width for each in soon)
    alike = [each for each in soon if each.half_width <= ALIKE * narrowest]
    return min(alike, key=lambda each: each.duration_s)


def _check_time(limit: Ceiling, found: Grid, within_s: float, map_verb: str) -> None:
    """Refuse where no plan may run, or none is fast enough."""
    if not found.candidates:
        raise RefusedError(
            f"none of {found.refused} plans for {limit.payload} on {limit.rig} will do: preflight "
            "refuses it, or says that a level may not be reached. About the one with the largest "
            f"top force it says: {found.because}",
            hint=found.hint or f"{map_verb} says what to buy",
        )
    fastest = min(found.candidates, key=lambda each: each.duration_s)
    if fastest.duration_s > within_s:
        raise RefusedError(
            f"no plan for {limit.payload} on {limit.rig} takes only {within_s:.0f} s: the fastest "
            f"one that was looked at is {fastest.text}",
            hint="give a longer --time, or begin nearer to the surface (--surface-distance)",
        )


def _refusal(
    limit: Ceiling, tried: Sequence[Candidate], best: Candidate, within_s: float
) -> RefusedError:
    """Why there is no plan, and what would narrow its interval."""
    later = choose(tried, LONGER * within_s)
    told = narrowing_text(best.expected.narrowing)
    if later.can:
        told = f"give it more --time: {later.text}, interval {half_text(later.half_width)}"
    return RefusedError(
        f"no plan for {limit.payload} on {limit.rig} that takes {within_s:.0f} s or less gives "
        f"±{percent(1.0 / best.expected.run.conditions.t, 2)} (1/t); the best is {best.text}, "
        f"interval {half_text(best.half_width)}",
        hint=told or limit.why,
    )
