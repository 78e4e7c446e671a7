"""Raw streams of a record as tables: one column for each field or vector component."""

from __future__ import annotations

from typing import Any

from stepload.data.table import Column, Table
from stepload.record.reader import Recording

SIX = {
    "wrench": (
        "force_x_n", "force_y_n", "force_z_n", "torque_x_n_m", "torque_y_n_m", "torque_z_n_m",
    ),
    "pose": ("x_m", "y_m", "z_m", "rotation_x_rad", "rotation_y_rad", "rotation_z_rad"),
}  # fmt: skip
"""Names of the six numbers of a field."""
RECEIVED = "receive_time_s"
STREAMS = {
    "force": RECEIVED, "second_force": RECEIVED, "arm": RECEIVED, "displacement": RECEIVED,
    "ticks": "time_s",
}  # fmt: skip
"""The column of each stream that is its time."""


def tables_of(streams: Recording) -> dict[str, Any]:
    """Every stream as a table, by name; None for a missing one.

    Forces are not tared, in the sensor's frame; the arm's travel is from the start pose.
    """
    return {
        name: None if (columns := getattr(streams, name)) is None else _table(columns, time)
        for name, time in STREAMS.items()
    }


def _table(columns: Any, time: str) -> Table:
    flat: dict[str, Column] = {}
    for name, values in columns._asdict().items():
        if names := SIX.get(name):
            flat |= {each: values[:, index] for index, each in enumerate(names)}
        else:
            flat[name] = values
    return Table(flat, time)
