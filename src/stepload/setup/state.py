"""The progress of a set-up, kept beside the rig file so that it can be resumed."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import date
from pathlib import Path

from pydantic import TypeAdapter

from stepload.errors import BadInputError, RefusedError
from stepload.plan.calibration import CalibrationRecord
from stepload.plan.whole_file import alone_in, replace_file
from stepload.setup.questions import REQUESTED_IN
from stepload.setup.yaml_keys import Value, quoted, written

VERSION = 1
CALIBRATION = "calibration"
"""The step that no set-up does: `calibrate --into` adds it."""


@dataclass(frozen=True, slots=True)
class Found:
    """What a step has found: values for the rig file by dotted key, and notes for people.

    `facts` are for later steps; `on` is the day (ISO) that the step was finished on.
    """

    values: Mapping[str, Value] = field(default_factory=dict)
    notes: Sequence[str] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    on: str = ""


_DONE = TypeAdapter(dict[str, Found])


@dataclass(slots=True)
class State:
    """Answers and finished steps.

    `rig_sha256` are checksums of the rig file as it was written last and before: a process killed
    between the two files of a step leaves the older one. `read` is the file of the state as it was
    read or written last.
    """

    answers: dict[str, str] = field(default_factory=dict)
    done: dict[str, Found] = field(default_factory=dict)
    rig_sha256: list[str] = field(default_factory=list)
    read: bytes | None = None

    @property
    def values(self) -> dict[str, Value]:
        """The rig so far: a later step replaces what an earlier one found."""
        merged: dict[str, Value] = {}
        for step in self.done.values():
            merged |= step.values
        return merged

    @property
    def left(self) -> list[str]:
        """The steps to come."""
        return [name for name in REQUESTED_IN if name not in self.done]


def state_path(rig: Path) -> Path:
    """Where the state of a rig file's set-up is kept."""
    rig = rig.resolve()  # a link to the rig file leads to it too
    return rig.with_name(f"{rig.stem}.setup.json")


def read_state(rig: Path) -> State:
    """The state kept beside `rig`; a new one where there is none.

    Raises:
        BadInputError: the state cannot be read, or the rig file is not the one that the set-up
            wrote: it would be overwritten.
    """
    path = state_path(rig)
    try:
        kept = path.read_bytes()
        data = json.loads(kept.decode())
        if data["stepload_setup"] != VERSION:
            raise ValueError(f"version {data['stepload_setup']}, this stepload knows {VERSION}")
        done = _DONE.validate_python(data["done"])
        state = State(dict(data["answers"]), done, list(data["rig_sha256"]), kept)
    except FileNotFoundError:
        state = State()
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise BadInputError(
            f"{path} does not tell where the set-up was left: {error}",
            hint="move it and the rig file away to begin anew",
        ) from error
    _refuse_foreign(rig, state)
    return state


def _refuse_foreign(rig: Path, state: State) -> None:
    with suppress(FileNotFoundError):
        if _sha256(rig.read_bytes()) not in state.rig_sha256:
            raise BadInputError(
                f"{rig} is not as the set-up left it: somebody else wrote or changed it",
                hint="move it away; give what was changed with --redo sensor --keys KEY=VALUE, and"
                " `stepload setup` writes it",
            )


def write_state(rig: Path, state: State) -> None:
    """Write the rig file as far as it is known, and the state.

    Raises:
        BadInputError: one of the two cannot be written, or somebody else has written meanwhile.
    """
    with alone_in(rig.resolve().parent):
        path = state_path(rig)
        if (path.read_bytes() if path.exists() else None) != state.read:
            raise BadInputError(
                f"{path} was written by somebody else meanwhile",
                hint="start again: what was kept there goes on, this step is to be done anew",
            )
        _refuse_foreign(rig, state)
        text = written(state.values, head=_head(state)).encode()
        state.rig_sha256 = [*state.rig_sha256[-1:], _sha256(text)]
        data = {
            "stepload_setup": VERSION, "answers": state.answers, "rig_sha256": state.rig_sha256,
            "done": {name: asdict(step) for name, step in state.done.items()},
        }  # fmt: skip
        kept = json.dumps(data, indent=1, ensure_ascii=False).encode()
        try:
            replace_file(path, kept)
            if state.done:
                replace_file(rig, text)
            state.read = kept
        except OSError as error:
            raise BadInputError(f"cannot write {rig}: {error.strerror}") from error


def _head(state: State) -> tuple[str, ...]:
    rest = f"UNFINISHED, to come: {', '.join(state.left)}" if state.left else "finished"
    notes = [f"{name}, {step.on}: {n}" for name, step in state.done.items() for n in step.notes]
    return (f"Written by `stepload setup`; {rest}. Behind each value: where it is from.", *notes)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def state_to_take_it(rig: Path) -> State:
    """The state of the set-up that wrote `rig`, which may take a calibration record.

    Raises:
        BadInputError: no set-up wrote this file, or somebody has changed it since.
    """
    state = read_state(rig) if rig.is_file() else State()
    if not state.done:
        raise BadInputError(
            f"{rig} was not written by `stepload setup`",
            hint="write the record there yourself, below `system_stiffness:` as `record: FILE`",
        )
    return state


def put_record(rig: Path, file: Path, record: CalibrationRecord, today: date) -> None:
    """Name the record in `file` in the rig file; what the set-up has done stays done.

    Raises:
        BadInputError: see `state_to_take_it`.
        RefusedError: the record is of another rig, or simulated.
    """
    state = state_to_take_it(rig)
    text = state.values["name"].text
    name = json.loads(text) if text.startswith('"') else text
    if record.simulated:
        raise RefusedError(
            f"{file} was made in a dry run: it does not go into a rig file",
            hint="calibrate on the rig itself",
        )
    if record.rig != name:
        raise RefusedError(
            f"{file} is of the rig {record.rig!r}, {rig} describes {name!r}",
            hint="name in the plan of the calibration the rig file that the record is for",
        )
    path = os.path.relpath(file.resolve(), rig.resolve().parent)
    until = record.valid_until.isoformat()
    value = Value(quoted(path), f"measured {record.measured_on}, valid until {until}")
    note = f"system stiffness from {path}, valid until {until}"
    state.done[CALIBRATION] = Found(
        {"system_stiffness.record": value}, (note,), on=today.isoformat()
    )
    write_state(rig, state)
