"""Where an interrupted run can be taken up again: after its last finished load step.

The new run makes a record of its own that names the old one. Their data are not put together: the
payload was let go of and touched anew, so each record has its own zero, and only the old one may
hold the virgin contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from stepload.errors import BadInputError
from stepload.plan.compose import SIMULATED
from stepload.plan.model import Plan
from stepload.record.reader import Recording, read_recording
from stepload.session.files import PART, RECORD, plan_files
from stepload.session.repair import repair


@dataclass(frozen=True, slots=True)
class Resumed:
    """The old run, and where the new one begins: `start_level` indexes the plan's levels.

    `touched` says whether the old run, or one before it, had touched the payload.
    """

    directory: Path
    run_id: str
    start_cycle: int
    start_level: int
    level_n: float
    touched: bool

    @property
    def text(self) -> str:
        """What a reader of the new record must know."""
        begun = (self.start_cycle, self.start_level) != (1, 0)
        steps = (
            f"the steps before cycle {self.start_cycle}, {self.level_n:g} N are in that record, "
            "those from there on in this one; each is identified by itself"
            if begun
            else "no step of it was finished, this one begins with the first"
        )
        contact = (
            "this one's contact is not virgin"
            if self.touched
            else "the payload had not been touched"
        )
        return f"taken up after run {self.run_id} ({self.directory.name}): {steps}, and {contact}"

    @property
    def metadata(self) -> dict[str, str]:
        """Metadata for the new record."""
        return {
            "resumed": self.text,
            "resumed_run_id": self.run_id,
            "resumed_directory": str(self.directory),
            "touched_before": str(self.touched).lower(),
            "start_cycle": str(self.start_cycle),
            "start_level": str(self.start_level),
        }


def resumable(directory: Path, plan: Plan, *, dry_run: bool) -> Resumed:
    """Where the run in `directory` is to be taken up; an unfinished record is repaired first.

    Raises:
        BadInputError: no record, another plan, or nothing left to do.
    """
    path = directory / RECORD
    if not path.exists() and (directory / PART).exists():
        repair(directory / PART)
    recording = read_recording(path)
    _same(recording, plan, dry_run)
    if plan.procedure.until is not None:
        raise BadInputError(
            f"{path}: its plan has `until`, and how far to load is seen in one whole first loading",
            hint="start a new run; `stepload identify` evaluates this one",
        )
    cycle, level = _next(recording, path)
    levels, cycles = plan.procedure.levels_n, plan.procedure.cycles
    if level >= len(levels):
        cycle, level = cycle + 1, 0
    if recording.outcome.get("verdict") == "completed" or not 1 <= cycle <= cycles or level < 0:
        raise BadInputError(
            f"{path}: every load step of the plan is done, there is nothing to resume",
            hint="`stepload identify` evaluates it",
        )
    touched = recording.metadata.get("touched_before") == "true" or any(
        event.kind == "touch" for event in recording.events
    )
    run_id = recording.metadata.get("run_id", "?")
    return Resumed(directory, run_id, cycle, level, levels[level], touched)


def _same(recording: Recording, plan: Plan, dry_run: bool) -> None:
    for name, text in plan_files(plan).items():
        if recording.attachments.get(name) != text:
            raise BadInputError(
                f"{recording.path}: that run was made with another plan ({name} differs)",
                hint="`stepload run --resume` goes on with the very plan; start a new run",
            )
    was_dry = recording.metadata.get("dry_run") == "true"
    world = recording.metadata.get("world", SIMULATED)
    if was_dry != dry_run or (was_dry and world != plan.rig.simulation.world):
        made = f"a dry run in the world {world}" if was_dry else "a run on devices"
        raise BadInputError(
            f"{recording.path} is the record of {made}", hint="resume it in the same way"
        )


def _next(recording: Recording, path: Path) -> tuple[int, int]:
    """(cycle, index of the level) after the last one that was held while loading."""
    try:
        cycle = int(recording.metadata.get("start_cycle", "1"))
        level = int(recording.metadata.get("start_level", "0"))
        for event in recording.events:
            if event.kind == "held" and event.data["loading"]:
                cycle, level = int(str(event.data["cycle"])), int(str(event.data["step"]))
    except (KeyError, ValueError):
        raise BadInputError(f"{path}: its steps are not written as stepload writes them") from None
    return cycle, level
