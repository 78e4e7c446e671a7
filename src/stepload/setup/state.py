"""The progress of a set-up, kept beside the rig file so that it can be resumed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.plan.whole_file import alone_in, replace_file
from stepload.setup.yaml_keys import Value, written

VERSION = 1
CALIBRATION = "calibration"
"""The step that no set-up does: `calibrate --into` adds it."""


@dataclass(frozen=True, slots=True)
class Found:
    """What a step has found: values for the rig file by dotted key, and notes for people.

    `facts` are for later steps.
    """

    values: Mapping[str, Value] = field(default_factory=dict)
    notes: Sequence[str] = ()
    facts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Done:
    """A finished step, and the day (ISO) it was finished on."""

    on: str
    found: Found


@dataclass(slots=True)
class State:
    """Answers and finished steps.

    `doubted` names the answers of a step that failed: a person is asked for them again.
    `rig_sha256` are checksums of the rig file as it was written last and before: a process killed
    between the two files of a step leaves the older one. `redoing` are the steps that were to be
    done again and have not been since: what they found before is doubtful. `read` is the file of
    the state as it was read or written last.
    """

    answers: dict[str, str] = field(default_factory=dict)
    done: dict[str, Done] = field(default_factory=dict)
    rig_sha256: list[str] = field(default_factory=list)
    doubted: set[str] = field(default_factory=set)
    redoing: set[str] = field(default_factory=set)
    read: bytes | None = None

    @property
    def values(self) -> dict[str, Value]:
        """The rig so far: a later step replaces what an earlier one found."""
        merged: dict[str, Value] = {}
        for step in self.done.values():
            merged |= step.found.values
        return merged


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
        state = _from_data(json.loads(kept.decode()))
        state.read = kept
    except FileNotFoundError:
        state = State()
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
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


def _refuse_overtaken(rig: Path, state: State) -> None:
    """Refuse to overwrite what another process, or a person, has written meanwhile.

    Raises:
        BadInputError: the state or the rig file is not as this process left it.
    """
    path = state_path(rig)
    now = path.read_bytes() if path.exists() else None
    if now != state.read:
        raise BadInputError(
            f"{path} was written by somebody else meanwhile",
            hint="start again: what was kept there goes on, this step is to be done anew",
        )
    _refuse_foreign(rig, state)


def write_state(rig: Path, state: State, left: Sequence[str]) -> None:
    """Write the rig file as far as it is known, and the state; `left` are the steps to come.

    Raises:
        BadInputError: one of the two cannot be written, or somebody else has written meanwhile.
    """
    with alone_in(rig.resolve().parent):
        _refuse_overtaken(rig, state)
        _write(rig, state, left)


def _write(rig: Path, state: State, left: Sequence[str]) -> None:
    text = written(state.values, head=_head(state, left)).encode()
    state.rig_sha256 = [*state.rig_sha256[-1:], _sha256(text)]
    data = {
        "stepload_setup": VERSION, "answers": state.answers, "rig_sha256": state.rig_sha256,
        "doubted": sorted(state.doubted), "redoing": sorted(state.redoing),
        "done": {name: _done_data(step) for name, step in state.done.items()},
    }  # fmt: skip
    kept = json.dumps(data, indent=1, ensure_ascii=False).encode()
    part = [(state_path(rig), kept)] + ([(rig, text)] if state.done else [])
    try:
        for path, content in part:
            replace_file(path, content)
        state.read = kept
    except OSError as error:
        raise BadInputError(f"cannot write {rig}: {error.strerror}") from error


def _head(state: State, left: Sequence[str]) -> tuple[str, ...]:
    rest = f"UNFINISHED, to come: {', '.join(left)}" if left else "finished"
    if state.redoing:
        again = ", ".join(sorted(state.redoing))
        rest = f"UNFINISHED, to be done again: {again}; what it found before is below"
    notes = [
        f"{name}, {step.on}: {note}" for name, step in state.done.items()
        for note in step.found.notes
    ]  # fmt: skip
    return (f"Written by `stepload setup`; {rest}. Behind each value: where it is from.", *notes)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _done_data(step: Done) -> dict[str, Any]:
    return {"on": step.on, "values": step.found.values, "notes": list(step.found.notes),
            "facts": dict(step.found.facts)}  # fmt: skip


def _from_data(data: Any) -> State:
    redoing = data.get("redoing", ())
    if data["stepload_setup"] != VERSION:
        raise ValueError(f"version {data['stepload_setup']}, this stepload knows {VERSION}")
    done = {
        name: Done(step["on"], Found({k: Value(*v) for k, v in step["values"].items()},
                                     step["notes"], step["facts"]))
        for name, step in data["done"].items()
    }  # fmt: skip
    return State(
        dict(data["answers"]), done, list(data["rig_sha256"]), set(data.get("doubted", ())),
        set(redoing.split() if isinstance(redoing, str) else map(str, redoing)),
    )  # fmt: skip
