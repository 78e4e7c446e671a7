"""Digest of the code that determines the result of a run."""

from __future__ import annotations

import hashlib
import inspect
from functools import cache
from pathlib import Path

import stepload
from stepload.rig.world import load_world

NOT_DECIDING = ("campaign.py", "digest.py", "replay.py", "summary.py", "without.py")
"""Files of this package that only order, store and count runs."""
DECIDING = ("contact", "engine", "envelope", "identification", "plan", "rig")
"""Packages of stepload whose code determines the result of a simulated run."""


def fingerprint(*more: Path) -> str:
    """SHA-256 over the code, of campaign and simulator, that determines the result of a run.

    Args:
        more: further directories of such code.
    """
    product, here = Path(stepload.__file__).parent, Path(__file__).parent
    simulator = Path(inspect.getfile(type(load_world()))).parent
    rooms = (*(product / name for name in DECIDING), here, simulator, *more)
    without = {here / name for name in NOT_DECIDING}
    digest = hashlib.sha256()
    for room in rooms:
        for file in sorted(set(room.rglob("*.py")) - without):
            digest.update(file.relative_to(room.parent).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


@cache
def loaded(*more: Path) -> str:
    """The same, computed once in this process, whose loaded code does not change."""
    return fingerprint(*more)
