"""Preflight reasons on friction that sticks while a serial arm retracts."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import replace

from stepload.contact.lateral import SHARES
from stepload.envelope.lateral_derating import back_left, dragged_left
from stepload.envelope.pressing import largest_top_force
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan, Structure

FRICTION_STEP = 0.01


def way_back_reasons(plan: Plan, counted_n: float) -> Iterator[Reason]:
    """A note on what the stated friction costs of F_c, and on the allowed friction.

    Where the contact has slid and sticks again, or joints stick, the lateral force falls later than
    the axial one, and its share grows up to µ. A stop retracts too, so that only a lower force
    limits the load on the payload then.

    Args:
        counted_n: lower end of F_c.
    """
    friction = plan.payload.friction
    if friction is None or plan.rig.arm.structure is not Structure.ARM:
        return
    left = min(back_left(plan), dragged_left(plan))
    if left >= 1.0:
        return
    allowed = allowed_friction(plan, counted_n)
    yield Reason(
        "friction_on_the_way_back", Severity.NOTE,
        f"A friction of {friction:g} leaves {left:.0%} of F_c; the top force may be pressed at up"
        f" to {allowed:.2g}.",
        "less friction", friction, allowed, "", 1.0 - left, "payload.friction",
    )  # fmt: skip


def allowed_friction(plan: Plan, counted_n: float) -> float:
    """The highest friction at which the plan's top force may be pressed, to `FRICTION_STEP`; 0
    where none is low enough."""

    def refused(step: int) -> bool:
        payload = replace(plan.payload, friction=step * FRICTION_STEP)
        stated = replace(plan, payload=payload)
        return largest_top_force(stated, counted_n) < plan.procedure.top_force_n

    steps = range(round(SHARES[-1] / FRICTION_STEP) + 1)
    return max(0, bisect_left(steps, True, key=refused) - 1) * FRICTION_STEP
