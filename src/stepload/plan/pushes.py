"""How long a push by hand is valid as proof of axis and sign of a force channel."""

from __future__ import annotations

from contextlib import suppress
from datetime import date

from stepload.plan.draft import UnknownError, put
from stepload.plan.model import ForceSpec, Plan, SecondForce

PUSH_DAYS = 30
"""Days after which a push no longer counts: the channel may have been mounted or wired anew."""


def settle_pushes(plan: Plan, today: date) -> None:
    """Put `push_problem` of both force channels into the draft of a plan."""
    for name in ("force", "second_force"):
        with suppress(UnknownError):
            channel: ForceSpec | SecondForce = getattr(plan.rig, name)
            if channel.pushed_on is not None:
                put(channel, "push_problem", push_problem(channel.pushed_on, today))


def push_problem(pushed_on: date, today: date) -> str:
    """Why a push on that day proves nothing today; "" where it does."""
    days = (today - pushed_on).days
    if days < 0:
        return f"its push by hand of {pushed_on} lies in the future"
    if days > PUSH_DAYS:
        return f"its push by hand of {pushed_on} is {days} days old, at most {PUSH_DAYS} count"
    return ""
