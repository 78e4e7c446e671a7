"""Preflight reasons on friction that sticks while a serial arm retracts."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import replace

from stepload.contact.lateral import SHARES
from stepload.envelope.dragged import back_left, dragged_left, left_at
from stepload.envelope.pressing import largest_top_force
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan, Structure
from stepload.units import format_quantity

FRICTION_STEP = 0.01


def way_back_reasons(plan: Plan, counted_n: float) -> Iterator[Reason]:
    """What the stated friction costs of F_c; what it may cost where none is stated.

    Where the contact has slid and sticks again, or joints stick, the lateral force falls later than
    the axial one, and its share grows up to µ. A stop retracts too, so that only a lower force
    limits the load on the payload then.

    Args:
        counted_n: lower end of F_c.
    """
    if plan.rig.arm.structure is not Structure.ARM:
        return
    if plan.payload.friction is None:
        yield from _clings(plan, counted_n)
    elif (left := min(back_left(plan), dragged_left(plan))) < 1.0:
        yield from _bounded(plan, counted_n, plan.payload.friction, left)


def allowed_friction(plan: Plan, counted_n: float) -> float:
    """The highest friction at which the plan's top force may be pressed, to `FRICTION_STEP`; 0
    where none is low enough."""

    def refused(step: int) -> bool:
        payload = replace(plan.payload, friction=step * FRICTION_STEP)
        stated = replace(plan, payload=payload)
        return largest_top_force(stated, counted_n) < plan.procedure.top_force_n

    steps = range(round(SHARES[-1] / FRICTION_STEP) + 1)
    return max(0, bisect_left(steps, True, key=refused) - 1) * FRICTION_STEP


def _bounded(plan: Plan, counted_n: float, friction: float, left: float) -> Iterator[Reason]:
    """A note on the part of F_c that the stated friction leaves, and on the allowed friction."""
    allowed = allowed_friction(plan, counted_n)
    yield Reason(
        "friction_on_the_way_back", Severity.NOTE,
        f"at a friction of up to {friction:g} the contact may slide at a share across of"
        f" {friction:.0%}, on a plate that is tilted or on the way back from any level: {left:.0%}"
        " of F_c may be pressed, so that every force stays below what is left there. The plan's"
        f" top force may be pressed at a friction of up to {allowed:.2g}",
        "less friction", friction, allowed, "",
    )  # fmt: skip


def _clings(plan: Plan, counted_n: float) -> Iterator[Reason]:
    """With the force across held at the share s that R12 allows at the top force F, the contact
    slides at µ, where the whole force s F sqrt(1 + µ²)/µ meets a limit of g(µ) F_c."""
    share, top_n = plan.procedure.max_lateral_share, plan.procedure.top_force_n
    borne_n = top_n * max(
        share * math.hypot(1.0, mu) / (mu * left_at(plan.payload, mu))
        for mu in SHARES if mu > share
    )  # fmt: skip
    if borne_n <= counted_n:
        return
    allowed = allowed_friction(plan, counted_n)
    yield Reason(
        "clings_on_the_way_back", Severity.WARN,
        f"friction may hold the payload sideways while the arm draws back: at the {share:.0%}"
        f" across that R12 allows and a friction of up to {SHARES[-1]:g} it may be loaded as hard"
        f" as {format_quantity(borne_n, 'N')} without friction would load it; F_c is counted as"
        f" {format_quantity(counted_n, 'N')}. No stop prevents it",
        "state payload.friction, the highest that is possible: the force is then kept below what it"
        f" leaves (this top force: up to {allowed:.2g}). Else lower procedure.max_lateral_share or"
        " the top force, grease the contact, or hold the arm in a pose that pushes little sideways"
        " (stepload pose)",
        borne_n, counted_n, "N",
    )  # fmt: skip
