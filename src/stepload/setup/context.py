"""The context that all steps of a set-up share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from stepload.envelope.envelope import Envelope
from stepload.plan.hazards import HAZARDS, PAGE
from stepload.record.outcome import RunOutcome
from stepload.setup.answers import Answers
from stepload.setup.open_devices import Opener
from stepload.setup.state import State
from stepload.setup.yaml_keys import Value, quoted

Press = Callable[[Envelope, Path], RunOutcome]
"""Presses a plan with its devices and keeps everything in a directory."""


@dataclass(frozen=True, slots=True)
class Setup:
    """The set-up of one rig file.

    Args:
        rig: path of the rig file.
        state: what earlier steps have found.
        opened: opens the devices that the rig's values name.
        press: presses the plan of the first touch.
        today: the day that measurements are dated with.
    """

    rig: Path
    state: State
    answers: Answers
    opened: Opener
    press: Press
    today: date

    def tell(self, line: str) -> None:
        """Show a line to the person who sets up."""
        self.answers.person.tell(line)

    @property
    def you(self) -> str:
        """The origin text of values that were answered."""
        return f"stated at the set-up, {self.today}"

    @property
    def measured(self) -> str:
        """The origin text of values that were measured now."""
        return f"measured {self.today}"

    def stated(self, name: str) -> Value:
        """A text that was answered, as a value of the rig file."""
        return Value(quoted(self.answers.text(name)), self.you)

    @property
    def plan(self) -> Path:
        """Where the plan of the first payload is written: beside the rig file."""
        return self.rig.parent / self.answers.text("plan")


def say_hazards(setup: Setup, before: str) -> None:
    """Say what a person must know before a hand comes near the arm, or before it moves."""
    setup.tell(before)
    for hazard in HAZARDS:
        setup.tell(f"  - {hazard}")
    setup.tell(f"more, with what to do about each: {PAGE}")
