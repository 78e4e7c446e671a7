"""What a phase of a run is: a generator that is resumed once a tick, reads top to bottom, and
returns why it was left early. The table of all phases is read from them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from enum import StrEnum
from functools import wraps
from typing import NamedTuple, ParamSpec

from stepload.record.rows import Phase


class Exit(StrEnum):
    """Why a phase was left before its end; a phase that came to its end returns None."""

    TOUCH = "touch"
    """The surface was met."""
    CONTACT = "contact"
    """What was taken for a moved zero is a contact."""
    ZERO = "zero moved"
    """The zero has to be taken again."""
    PAUSE = "pause"
    """The operator pauses: the contact has to be opened."""
    STOP = "stop"
    """The operator ends the run: the contact has to be opened."""
    END = "end"
    """The operator ends the run, and the contact is open."""
    FAIL = "fail"
    """The run cannot go on: `RunState.failure` says why, and safing follows."""


class May(StrEnum):
    """How a phase may move the target."""

    STAND = "nothing: the target stands"
    TOWARDS = "towards the surface"
    BACK = "back"
    BACK_OR_ACROSS = "back, then across the approach"
    OPEN = "back; where that presses, to where the force was least"


Steps = Generator[None, None, Exit | None]
"""A part of a run: yields once a tick, and returns why it was left early."""
Part = ParamSpec("Part")


class PhaseRow(NamedTuple):
    """A row of the table of phases: when it begins, what it may command, and how it may end."""

    phase: Phase
    entry: str
    may: May
    exits: tuple[Exit, ...]


PHASES = {
    row.phase: row
    for row in (
        PhaseRow(Phase.SAFING, "a rule, a fault or the operator stops the run", May.OPEN, ()),
        PhaseRow(Phase.DONE, "the sequence is over", May.STAND, ()),
    )
}
"""The table of phases. Safing belongs to the engine, not to the sequence: it follows any phase."""


def phase(
    number: Phase, entry: str, may: May, *exits: Exit
) -> Callable[[Callable[Part, Steps]], Callable[Part, Steps]]:
    """Enter a generator into the table of phases, and hold it to the exits stated there.

    Raises:
        RuntimeError: at run time, where it returns another exit.
    """
    PHASES[number] = PhaseRow(number, entry, may, exits)

    def stated(part: Callable[Part, Steps]) -> Callable[Part, Steps]:
        @wraps(part)
        def held(*args: Part.args, **options: Part.kwargs) -> Steps:
            left = yield from part(*args, **options)
            if left is not None and left not in exits:
                raise RuntimeError(f"{number.name} has no exit {left.name}")
            return left

        return held

    return stated
