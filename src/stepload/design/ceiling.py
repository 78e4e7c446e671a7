"""How hard a payload may be pressed on a rig, and what that hangs on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from stepload.atlas.plans import plan_of
from stepload.atlas.rigs import most_push
from stepload.envelope.envelope import derive
from stepload.errors import RefusedError
from stepload.results.conditions import planned
from stepload.units import format_quantity

TRIES = 3
"""A safe force depends a little on the plan that it is asked of: so often it is asked again."""


@dataclass(frozen=True, slots=True)
class Ceiling:
    """The largest top force that is looked at.

    Attributes:
        rig, payload: what they call themselves.
        top_n: the force.
        why: what keeps it from being larger, a whole sentence.
    """

    rig: str
    payload: str
    top_n: float
    why: str


def ceiling(rig: str, payload: Path) -> Ceiling:
    """What arm and sensor can push, what is safe, and what the table of the deflection covers.

    Raises:
        BadInputError: no such rig or payload.
        PlanError: what is wrong in their files.
        RefusedError: nothing is known of the payload's elastic limit, or no force is safe.
        DomainError: a number outside the domain of contact theory.
    """
    name, top_n = most_push(rig)
    why = f"{name} can press with {format_quantity(top_n, 'N')} at most"
    for _ in range(TRIES):
        plan = plan_of(rig, payload, top_n)
        envelope = derive(plan)
        theory = envelope.theory
        limit, counted = (
            format_quantity(force, "N")
            for force in (theory.elastic_limit_n, theory.counted.lower_n)
        )
        if envelope.largest_safe_force_n < top_n:
            top_n = envelope.largest_safe_force_n
            why = (
                f"more than {format_quantity(top_n, 'N')} is not safe: the elastic limit F_c is "
                f"{limit}, of which {counted} are counted on"
            )
        if not top_n > 0.0:
            raise RefusedError(
                f"{plan.payload.name} must not be pressed on {name}: its elastic limit F_c is "
                f"{limit}, of which {counted} are counted on, and no top force that this rig "
                "resolves is safe",
                hint="stepload preflight PLAN says how the force budget is spent",
            )
        table = planned(envelope).sources.deflection()
        if table is not None and table.force_n[-1] < top_n:
            last, safe = (format_quantity(force, "N") for force in (table.force_n[-1], top_n))
            why = (
                f"the table of the rig's deflection ends at {last}, and nothing beyond it is "
                f"IDENTIFIED; {safe} would be safe, so calibrate up to there to use them"
            )
            top_n = table.force_n[-1]
            break
    return Ceiling(name, plan.payload.name, top_n, why)


def rounded_down(force_n: float) -> float:
    """A force in N with three significant digits, never larger than it was."""
    if not force_n > 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(force_n)) - 2)
    return float(f"{math.floor(force_n / unit * (1.0 + 1e-12)) * unit:.3g}")
