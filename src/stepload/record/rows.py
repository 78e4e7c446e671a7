"""Rows that only the engine makes: what it decided in each tick, in the words of a record."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


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


class TickRow(NamedTuple):
    """One tick of the engine.

    `time_s` is the tick's time on the host's monotonic clock, `target_m` the commanded travel,
    `force_n` the tared contact force (positive when pressing), `predicted_peak_n` R2's prediction,
    `limit_n` the force limit F_lim in force, `compliance_m_per_n` the c_use of the controller,
    `level_n` the load level aimed at (0 where none), `cycle` and `step` count from 1 (0: none),
    `late_s` how late the tick began.
    """

    time_s: float
    target_m: float
    force_n: float
    second_force_n: float
    predicted_peak_n: float
    limit_n: float
    compliance_m_per_n: float
    level_n: float
    late_s: float
    phase: int
    cycle: int
    step: int
