"""Design of a plan: the expected interval of every plan of the grid, and the narrowest."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stepload.design.answers import half_text, narrowing_text
from stepload.design.ceiling import Ceiling, ceiling
from stepload.design.grid import HOLDS_S, STEPS, Candidate, Grid, grid
from stepload.envelope.order import Order
from stepload.errors import RefusedError
from stepload.evidence.expected import Narrowing, narrowing

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
        narrowing: what narrows its interval most.
    """

    ceiling: Ceiling
    within_s: float
    grid: Grid
    tried: Sequence[Candidate]
    chosen: Candidate
    narrowing: Sequence[Narrowing]

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
    return Design(limit, within_s, found, tried, chosen, narrowing(chosen.run, chosen.chord))


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
    told = narrowing_text(narrowing(best.run, best.chord))
    if later.can:
        told = f"give it more --time: {later.text}, interval {half_text(later.half_width)}"
    return RefusedError(
        f"no plan for {limit.payload} on {limit.rig} that takes {within_s:.0f} s or less gives "
        f"±{1.0 / best.run.conditions.t:.0%} (1/t); the best is {best.text}, interval "
        f"{half_text(best.half_width)}",
        hint=told or limit.why,
    )
