"""A run as an HDF5 file of NeXus base classes: NXdata for each table, with units and meanings."""

from __future__ import annotations

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
    "_n_per_m": "N/m", "_m_per_n": "m/N", "_n_m": "N.m", "_rad": "rad", "_n": "N", "_m": "m",
    "_s": "s", "_c": "degC",
}  # fmt: skip
"""UDUNITS names by the end of a column's name, the longest first."""
CURVE = {
    "force_n": "contact force, tared, drift of the zero subtracted",
    "travel_m": "travel since the first touch, corrected for lateral force where calibrated",
    "deformation_m": "travel less the deflection of the system",
    "branch": "1 while loading, -1 while unloading, else 0",
}
SIGNALS = {"arm": "position_m", "displacement": "displacement_m", "second_force": "force_z_n"}
"""The column to plot, where it is not the force."""


def write_hdf5(run: Run, parts: Mapping[str, Table], path: Path, about: Mapping[str, str]) -> None:
    """Write tables and results of a run to an HDF5 file; raises as `library`."""
    h5py = library("h5py", "HDF5")
    told = {key: value.replace("\0", "") for key, value in {**run.metadata, **about}.items()}
    with h5py.File(path, "w", track_order=True) as file:
        file.attrs.update({"NX_class": "NXroot", "default": "entry", "creator": "stepload"})
        entry = _group(
            file, "entry", "NXentry", title=told["plan"], entry_identifier=told["run_id"],
            start_time=told["started"], program_name="stepload", notes=told.get("notes", ""),
        )  # fmt: skip
        entry.attrs.update({key: told[key] for key in about})
        entry.attrs["default"] = "curve" if "curve" in parts else "force"
        _group(entry, "user", "NXuser", name=told.get("operator", ""))
        told_of = {"name": told["payload"], "description": told.get("specimen", "")}
        _group(entry, "sample", "NXsample", **told_of)
        _group(entry, "instrument", "NXinstrument", name=told["rig"])
        axis = told.get("force_axis", "")[-1:] or "z"
        for name, table in parts.items():
            signal = f"force_{axis}_n" if name == "force" else SIGNALS.get(name, "force_n")
            _fill(_group(entry, name, "NXdata"), table, signal, _meanings(name), h5py)
        if run.results is not None:
            kind = {"type": "application/json", "description": SCHEMA_ID}
            _group(entry, "results", "NXnote", data=json_text(run.results), **kind)


def _group(parent: Any, name: str, kind: str, /, **texts: str) -> Any:
    """A group of a NeXus class with text fields."""
    made = parent.create_group(name, track_order=True)
    made.attrs["NX_class"] = kind
    for key, text in texts.items():
        made[key] = text
    return made


def _meanings(name: str) -> dict[str, str]:
    """What the columns of a table mean, by their names."""
    if name == "curve":
        return CURVE
    if name in ("levels", "touches"):
        fields = (Level if name == "levels" else TouchPoint).model_fields
        return {key: field.description or "" for key, field in fields.items()}
    hints = get_type_hints(STREAMS[name.removesuffix("s")].row, include_extras=True)
    found = {key: ", ".join(getattr(hint, "__metadata__", ())) for key, hint in hints.items()}
    return found | {each: found.get(key, "") for key, names in SIX.items() for each in names}


def _fill(group: Any, table: Table, signal: str, meanings: Mapping[str, str], h5py: Any) -> None:
    """Put the columns of a table into an NXdata group."""
    group.attrs.update({"axes": [table.time], f"{table.time}_indices": 0})
    if signal in table:
        group.attrs["signal"] = signal
    for key, values in table.items():
        kind: Any = h5py.string_dtype() if values.dtype.kind == "U" else values.dtype
        if key == PHASE:
            kind = h5py.enum_dtype({phase.name.lower(): phase for phase in Phase}, basetype="i1")
        column = group.create_dataset(key, data=np.asarray(values, kind), dtype=kind)
        if unit := next((unit for end, unit in UNITS.items() if f"_{key}".endswith(end)), ""):
            column.attrs["units"] = unit
        if meanings.get(key):
            column.attrs["long_name"] = meanings[key]
