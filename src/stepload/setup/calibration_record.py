"""A calibration record put into the rig file that the set-up wrote, and into the set-up's state."""

from __future__ import annotations

import json
import os
from datetime import date
from pathlib import Path

from stepload.errors import BadInputError, RefusedError
from stepload.plan.calibration import CalibrationRecord
from stepload.setup.state import CALIBRATION, Done, Found, State, read_state, write_state
from stepload.setup.wizard import STEPS
from stepload.setup.yaml_keys import Value, quoted


def state_to_take_it(rig: Path) -> State:
    """The state of the set-up that wrote `rig`, which may be written on.

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
    state.done[CALIBRATION] = Done(
        today.isoformat(), Found({"system_stiffness.record": value}, (note,))
    )
    write_state(rig, state, [step for step in STEPS if step not in state.done])
