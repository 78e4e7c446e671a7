"""A run as an HDF5 file of NeXus base classes: NXdata for each table, with units and meanings."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from stepload.data.columns import library
from stepload.data.run import SIX, Run
from stepload.data.table import PHASE, Table
from stepload.record.layout import STREAMS
from stepload.record.plain import json_text
from stepload.record.rows import Phase
from stepload.report.levels import Level
from stepload.report.press_data import TouchPoint
from stepload.report.run_results import SCHEMA_ID

UNITS = {
    "n_per_m": "N/m", "m_per_n": "m/N", "n_m": "N.m", "rad": "rad", "n": "N", "m": "m", "s": "s",
    "c": "degC",
}  # fmt: skip
"""UDUNITS names by the end of a column's name, the longest first."""
_UNIT = re.compile(f"_({'|'.join(UNITS)})$")
CURVE = {
    "force_n": "contact force, tared, drift of the zero subtracted",
    "travel_m": "travel since the first touch, corrected for lateral force where calibrated",
    "deformation_m": "travel less the deflection of the system",
    "branch": "1 while loading, -1 while unloading, else 0",
}
"""What the columns of the curve mean."""
SIGNALS = {"arm": "position_m", "displacement": "displacement_m", "second_force": "force_z_n"}
"""The column to plot, where it is not the force."""
SENSORS = {
    "force": "force_sensor", "second_force": "second_force_sensor", "arm": "arm",
    "displacement": "displacement_sensor",
}  # fmt: skip
"""Metadata that identify the device of each stream."""


def unit_of(name: str) -> str:
    """The unit of a column in UDUNITS; "" for a plain number."""
    found = _UNIT.search(f"_{name}")
    return UNITS[found[1]] if found else ""


def write_hdf5(run: Run, parts: Mapping[str, Table], path: Path, about: Mapping[str, str]) -> None:
    """Write tables, results and plan of a run to an HDF5 file."""
    h5py = library("h5py", "HDF5")
    with h5py.File(path, "w", track_order=True) as file:
        _describe(file, "NXroot", default="entry", creator="stepload", file_name=path.stem)
        entry = _group(file, "entry", "NXentry", default="curve" if "curve" in parts else "force")
        entry.attrs.update({key: _text(value) for key, value in about.items()})

        def told(key: str) -> str:
            return _text(run.metadata.get(key, ""))

        for key, value in (
            ("title", told("plan")), ("entry_identifier", run.run_id),
            ("start_time", told("started")), ("program_name", "stepload"),
            ("notes", told("notes")),
        ):  # fmt: skip
            entry[key] = value
        _group(entry, "user", "NXuser")["name"] = told("operator")
        sample = _group(entry, "sample", "NXsample")
        sample["name"], sample["description"] = told("payload"), told("specimen")
        instrument = _group(entry, "instrument", "NXinstrument")
        instrument["name"] = told("rig")
        for name, table in parts.items():
            axis = told("force_axis")[-1:] or "z"
            signal = f"force_{axis}_n" if name == "force" else SIGNALS.get(name, "force_n")
            _table(_group(entry, name, "NXdata"), name, table, signal)
            if name in SENSORS:
                sensor = _group(instrument, name, "NXsensor")
                sensor["model"] = told(SENSORS[name])
                sensor["data"] = h5py.SoftLink(f"/entry/{name}")
        if run.results is not None:
            _note(entry, "results", "application/json", json_text(run.results), SCHEMA_ID)
        texts = [(name, data) for name, data in run.files.items() if name.startswith("plan")]
        for number, (name, data) in enumerate(texts):
            named = f"plan_{number}" if number else "plan"
            _note(entry, named, "application/yaml", data.decode(errors="replace"), name)


def _text(text: str) -> str:
    """A text of a record without what HDF5 cannot hold."""
    return text.replace("\0", "")


def _describe(group: Any, kind: str, **attributes: str) -> None:
    group.attrs["NX_class"] = kind
    group.attrs.update(attributes)


def _group(parent: Any, name: str, kind: str, **attributes: str) -> Any:
    made = parent.create_group(name, track_order=True)
    _describe(made, kind, **attributes)
    return made


def _note(entry: Any, name: str, media_type: str, text: str, description: str) -> None:
    note = _group(entry, name, "NXnote")
    note["type"], note["data"], note["description"] = media_type, _text(text), _text(description)


def _meanings(name: str) -> dict[str, str]:
    """What the columns of a table mean, by their names."""
    if name == "curve":
        return CURVE
    if name in ("levels", "touches"):
        row = Level if name == "levels" else TouchPoint
        return {key: field.description or "" for key, field in row.model_fields.items()}
    hints = get_type_hints(STREAMS[name.removesuffix("s")].row, include_extras=True)
    found = {key: ", ".join(getattr(hint, "__metadata__", ())) for key, hint in hints.items()}
    return found | {each: found.get(key, "") for key, names in SIX.items() for each in names}


def _table(group: Any, name: str, table: Table, signal: str) -> None:
    """The columns of a table, with what NXdata says of them."""
    h5py = library("h5py", "HDF5")
    group.attrs["axes"], group.attrs[f"{table.time}_indices"] = [table.time], 0
    if signal in table:
        group.attrs["signal"] = signal
    meanings = _meanings(name)
    for key, values in table.items():
        kind = values.dtype
        if key == PHASE:
            kind = h5py.enum_dtype({phase.name.lower(): phase for phase in Phase}, basetype="i1")
        elif kind.kind == "U":
            kind = h5py.string_dtype()
        column = group.create_dataset(key, data=np.asarray(values, kind), dtype=kind)
        if unit := unit_of(key):
            column.attrs["units"] = unit
        if meanings.get(key):
            column.attrs["long_name"] = meanings[key]
