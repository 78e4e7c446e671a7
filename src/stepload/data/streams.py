"""Raw streams of a record as tables: one column for each field or vector component."""

from __future__ import annotations

from typing import Any

from stepload.data.table import Column, Table
from stepload.record.reader import Recording
from stepload.record.rows import ArmColumns, DisplacementColumns, ForceColumns, TickColumns
from stepload.record.stretches import Stretch

SIX = {
    "wrench": (
        "force_x_n", "force_y_n", "force_z_n", "torque_x_n_m", "torque_y_n_m", "torque_z_n_m",
    ),
    "pose": ("x_m", "y_m", "z_m", "rotation_x_rad", "rotation_y_rad", "rotation_z_rad"),
}  # fmt: skip
"""Names of the six numbers of a field."""
RECEIVED = "receive_time_s"


def force_table(columns: ForceColumns) -> Table:
    """A force sensor's samples: not tared, in the sensor's frame."""
    return _table(columns, RECEIVED)


def arm_table(columns: ArmColumns) -> Table:
    """States of the arm: travel from the start pose, its own force channel, TCP pose."""
    return _table(columns, RECEIVED)


def displacement_table(columns: DisplacementColumns) -> Table:
    """Readings of the gauge across the contact."""
    return _table(columns, RECEIVED)


def tick_table(columns: TickColumns) -> Table:
    """What the engine saw and decided in each period."""
    return _table(columns, "time_s")


def tables_of(streams: Recording | Stretch) -> dict[str, Any]:
    """Every stream as a table, by name; None for a missing one."""
    second, gauge = streams.second_force, streams.displacement
    return {
        "force": force_table(streams.force),
        "second_force": None if second is None else force_table(second),
        "arm": arm_table(streams.arm),
        "displacement": None if gauge is None else displacement_table(gauge),
        "ticks": tick_table(streams.ticks),
    }


def _table(columns: Any, time: str) -> Table:
    flat: dict[str, Column] = {}
    for name, values in columns._asdict().items():
        if names := SIX.get(name):
            flat |= {each: values[:, index] for index, each in enumerate(names)}
        else:
            flat[name] = values
    return Table(flat, time)
