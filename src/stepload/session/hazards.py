"""What a person must have read before a rig moves for the first time."""

from __future__ import annotations

from stepload.errors import RefusedError
from stepload.plan.hazards import hazards_read
from stepload.plan.model import Plan

PAGE = "docs/risk-assessment.md among the sources of stepload"

HAZARDS = (
    "stepload is no safety function: it runs on a computer without guarantees, and what it"
    " stops is stopped by software.",
    "An arm that presses can crush a hand. Nobody reaches between tool and plate while it is"
    " in remote control.",
    "The robot's own safety limits (force, speed, planes) are what protects people. They are"
    " set on its pendant by whoever is responsible for the cell, and tested.",
    "An emergency stop within reach of whoever starts a run is what helps when the software"
    " does not. It leaves the force on: know how the arm is freed by hand.",
    "A payload beyond its strength can break and throw splinters: goggles, a screen.",
    "The start pose must have free way behind it and in front of it as far as the plan says:"
    " the arm moves back before it moves forth.",
    "A wrong number in the plan (strength, sign, range, stiffness) makes every limit wrong.",
)
"""Said before the first motion of a rig; docs/risk-assessment.md has them with what to do."""


def refuse_unread(plan: Plan, read_now: bool) -> None:
    """Refuse to move a rig whose hazards nobody has read.

    Raises:
        RefusedError: neither the rig file nor whoever starts it says so.
    """
    if read_now or hazards_read(plan):
        return
    raise RefusedError(
        f"nobody has confirmed to have read the hazards of the rig {plan.rig.name!r}",
        hint=f"read {PAGE}, then write below `rig:` in the plan or rig file: hazards_read_by:"
        " NAME and hazards_read_on: YYYY-MM-DD; in a terminal the command asks; --yes in scripts",
    )
