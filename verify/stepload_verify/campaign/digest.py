"""What a run comes to is decided by code; this says by which."""

from __future__ import annotations

import inspect
from functools import cache
from pathlib import Path

import stepload
from stepload.rig.world import load_world
from stepload.runner.digest import code_digest

NOT_DECIDING = ("campaign.py", "digest.py", "replay.py", "summary.py", "without.py")
"""Files of this room that only order, keep and count runs."""
DECIDING = ("contact", "engine", "envelope", "estimators", "evidence", "plan", "rig")
"""Rooms of stepload whose code decides what a simulated run comes to."""


def fingerprint(*more: Path) -> str:
    """SHA-256 over the code that decides what a run comes to: ours and the simulator's.

    Args:
        more: directories of code that decides too.
    """
    product, here = Path(stepload.__file__).parent, Path(__file__).parent
    simulator = Path(inspect.getfile(type(load_world()))).parent
    rooms = (*(product / name for name in DECIDING), here, simulator, *more)
    return code_digest(rooms, without={here / name for name in NOT_DECIDING})


@cache
def loaded(*more: Path) -> str:
    """The same once for all in this process, whose code stays what it was when it was loaded."""
    return fingerprint(*more)
