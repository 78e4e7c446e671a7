"""The rows of a record: what the engine decided in each tick, and columns of every row type."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Annotated, Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from stepload.rig.samples import ArmFields, DisplacementFields, ForceFields, Number, Whole

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Row = TypeVar("Row")


class Phase(IntEnum):
    """Where in the procedure a tick belongs. Numbers are written to records: never renumber."""

    WARM_UP = 0
    TARE = 1
    DRIFT_CHECK = 2
    FAST_APPROACH = 3
    GUARDED_APPROACH = 4
    DWELL = 5
    TOUCH_RETRACT = 6
    LOAD = 7
    HOLD = 8
    UNLOAD = 9
    UNLOAD_HOLD = 10
    RETRACT = 11
    POST_TARE = 12
    PAUSED = 13
    SAFING = 14
    DONE = 15
    FREE_AIR = 16
    ALIGN = 18


class TickFields(NamedTuple, Generic[Whole, Number]):
    """One tick of the engine.

    `time_s` is the tick's time on the host's monotonic clock, `target_m` the commanded travel,
    `force_n` the tared contact force (positive when pressing), `predicted_peak_n` R2's prediction,
    `limit_n` the force limit F_lim in force, `compliance_m_per_n` the c_use of the controller,
    `level_n` the load level aimed at (0 where none), `cycle` and `step` count from 1 (0: none),
    `late_s` how late the tick began.
    """

    time_s: Annotated[Number, "the host's monotonic clock"]
    target_m: Annotated[Number, "commanded travel"]
    force_n: Annotated[Number, "tared, positive when pressing"]
    second_force_n: Number
    predicted_peak_n: Number
    limit_n: Number
    compliance_m_per_n: Number
    level_n: Number
    late_s: Number
    phase: Whole
    cycle: Whole
    step: Whole


class TickRow(TickFields[int, float]):
    """One row of `TickFields`."""

    __slots__ = ()


ForceColumns = ForceFields[IntArray, FloatArray, FloatArray]
ArmColumns = ArmFields[IntArray, FloatArray, FloatArray]
DisplacementColumns = DisplacementFields[IntArray, FloatArray]
TickColumns = TickFields[IntArray, FloatArray]
SampleColumns = ForceColumns | ArmColumns | DisplacementColumns
"""N rows: every field an array of shape (N,); wrench and pose of shape (N, 6)."""


def rows_of(row: Callable[..., Row], columns: tuple[NDArray[Any], ...] | None) -> list[Row]:
    """The rows that columns hold, oldest first; none without columns."""
    lists = [[tuple(x) for x in c.tolist()] if c.ndim > 1 else c.tolist() for c in columns or ()]
    return [row(*values) for values in zip(*lists, strict=True)]
