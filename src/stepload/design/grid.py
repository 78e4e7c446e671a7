"""The plans to be tried: top force, number of steps, ramps, holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

from stepload.design.ceiling import Ceiling, rounded_down
from stepload.design.law import Payload
from stepload.design.points import Point
from stepload.design.world import Cell
from stepload.envelope.benches import Specimen
from stepload.envelope.envelope import Envelope, derive
from stepload.envelope.order import CYCLES, Order
from stepload.envelope.reason import PlanVerdict, Severity
from stepload.envelope.unwritten import plan_of
from stepload.errors import BadInputError, DomainError, RefusedError
from stepload.estimators.conditions import Conditions
from stepload.plan.problems import PlanError
from stepload.results.conditions import planned
from stepload.units import format_quantity

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Top forces, as shares of the largest."""
STEPS = (4, 6, 8, 12)
"""Numbers of steps. Fewer would be faster, but only ramps show what happens between two steps."""
HOLDS_S = (1.0, 2.0, 3.0, 5.0, 8.0)
RAMPS_S = (1.0, 2.0)
"""Ramp times from one level to the next; in a fast ramp a damped load path lags behind."""
SERIES = "design"
MISSED = ("slow_steps",)
"""Preflight warnings that a level may not be reached, so that the run would differ."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A plan that preflight accepts up to its top force.

    Attributes:
        top_n, step_n: its forces.
        share: its top force is about this share of the largest.
        order: its steps, ramps and holds, and how long the arm takes for each.
        duration_s: its duration according to preflight.
        specimen: the payload at this top force.
        zero_drift_n_per_s: largest drift of the force's zero.
        damping_n_s_per_m: C_s of the load path.
    """

    top_n: float
    step_n: float
    share: float
    order: Order
    duration_s: float
    specimen: Specimen
    zero_drift_n_per_s: float
    damping_n_s_per_m: float

    @property
    def text(self) -> str:
        """The plan in a few words."""
        return (
            f"{format_quantity(self.top_n, 'N')} in {self.order.steps} steps of "
            f"{format_quantity(self.step_n, 'N')}, ramps of {self.order.ramp_s:g} s, "
            f"holds of {self.order.hold_s:g} s, "
            f"{CYCLES} cycles: {self.duration_s:.0f} s"
        )

    def point(self, index: int, told: Conditions, change: str = "") -> Point:
        """The cell that simulates and identifies it under the conditions `told`."""
        body = self.specimen
        cell = Cell(
            Payload(body.secant_n_per_m, body.exponent, body.top_n),
            replace(told, elastic_limit_n=None),
            body.touch_n,
            self.zero_drift_n_per_s,
            self.damping_n_s_per_m,
            self.order,
        )
        return Point(SERIES, index, math.nan, change, body.name, cell)

    @property
    def conditions(self) -> Conditions:
        """The conditions of its identification."""
        assert self.specimen.conditions is not None
        return self.specimen.conditions


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
        climbs = envelope.climbs
        order = replace(order, up_s=climbs.up_s, down_s=climbs.down_s)
        law = envelope.theory.stiffest
        secant = law.secant(top_n)
        body = Specimen(
            plan.payload.name, payload, top_n, "", secant, secant, law.n,
            planned(envelope), plan.procedure.touch_force_n,
        )  # fmt: skip
        found.append(
            Candidate(
                top_n, step_n, share, order, envelope.duration_s, body,
                plan.rig.force.drift_n_per_s, plan.rig.system_stiffness.damping_n_s_per_m,
            )
        )  # fmt: skip
    return Grid(tuple(found), len(reasons), *(reasons[-1] if reasons else ("", "")))


def _why(envelope: Envelope) -> tuple[str, str]:
    """The first reason against a plan, and what to do about it."""
    against = [r for r in envelope.reasons if r.severity is Severity.REFUSE]
    first = (against or [r for r in envelope.reasons if r.code in MISSED])[0]
    return first.message, first.remedy
