"""A finished run opened for users: columns, typed objects, and its settings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from stepload.data.table import Column, Table
from stepload.errors import BadInputError
from stepload.identification.conditions import Conditions
from stepload.identification.contact_quality import ContactQuality
from stepload.identification.fit import Missing
from stepload.plan.model import Plan
from stepload.record.reader import Event, Recording, read_recording
from stepload.record.untrusted import untrusted
from stepload.report.conditions import FILE as CONDITIONS
from stepload.report.conditions import from_attachments, measured
from stepload.report.levels import Level, levels_of
from stepload.report.press_data import LOADING, UNLOADING, PressData, TouchPoint, press_data
from stepload.report.quality import quality_of
from stepload.report.run_record import condensed, plan_of, read_to_evaluate, record_in, told_ticks

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


@dataclass(frozen=True)
class Run:
    """One run from its record; times are on the run's clock (host monotonic, or virtual), in s.

    Raw streams are tables as the devices delivered them, not tared: `force`, `second_force` (None
    without one), `arm`, `displacement` (None without one), and `ticks`, what the engine decided in
    each period. `curve` is the input of identification: tared force and compensated deformation on
    one time base.

    Attributes:
        path: the record.
        events: what happened, in the order of time.
        metadata: settings at the start of the run as texts: plan, rig, payload, operator, versions.
        outcome: its end: verdict, numbers of recorded and dropped messages.
        results: content of results.json; None where the run ended before it was written.
        partial: the record was never finished: interrupted, recovered or cut.
        damage: where and why reading ended early, "" where it did not.
    """

    path: Path
    force: Table
    second_force: Table | None
    arm: Table
    displacement: Table | None
    ticks: Table
    events: tuple[Event, ...]
    metadata: Mapping[str, str]
    outcome: Mapping[str, str]
    results: Mapping[str, Any] | None
    partial: bool
    damage: str
    _recording: Recording = field(repr=False)

    @property
    def run_id(self) -> str:
        """Twelve hexadecimal digits, unique to the run; "" in records that do not state it."""
        return self.metadata.get("run_id", "")

    @property
    def simulated(self) -> bool:
        """Whether simulated devices made it."""
        return "true" in (self.metadata.get("simulated"), self.metadata.get("dry_run"))

    @property
    def started(self) -> datetime | None:
        """Start time of the run, with its time zone; None where the record does not state it."""
        try:
            return datetime.fromisoformat(self.metadata.get("started", ""))
        except ValueError:
            return None

    @property
    def files(self) -> Mapping[str, bytes]:
        """Attached files of the record, by name: plan, rig, conditions, preflight."""
        return self._recording.attachments

    @cached_property
    def plan(self) -> Plan:
        """The plan as it was on the day of the run, from the texts in the record.

        Raises:
            PlanError: the record has kept no plan that this version can read.
        """
        return plan_of(self.metadata, self.files)

    @cached_property
    def preflight(self) -> Mapping[str, Any]:
        """The result of the preflight: `verdict` (go, warn or refused) and `reasons`, each with
        code, severity, message and remedy.

        Raises:
            BadInputError: the record does not hold it.
        """
        with untrusted(self.path):
            if not (told := json.loads(self.files.get("preflight.json", b"{}"))):
                raise BadInputError(f"{self.path}: the record holds no preflight")
            return dict(told)

    @cached_property
    def _press(self) -> PressData:
        with untrusted(self.path):
            told = from_attachments(self.files) if CONDITIONS in self.files else None
            return press_data(self._recording, across=told.across if told else None)

    @cached_property
    def _evaluated(self) -> PressData:
        """The samples that the results are of: those of `_press`, or means where it is long."""
        if condensed(told_ticks(self.path)) == 1:
            return self._press
        with untrusted(self.path):
            across = self._conditions.across
            return press_data(read_to_evaluate(self.path), across=across)

    @cached_property
    def _conditions(self) -> Conditions:
        return measured(from_attachments(self._recording.attachments), self._press)

    @cached_property
    def curve(self) -> Table:
        """Force and deformation, one row per usable force sample.

        Columns: `time_s`; `force_n`, tared, drift of the zero taken out; `travel_m` since the first
        touch, corrected for lateral force where that was calibrated; `deformation_m`, travel less
        the deflection of the system; `phase`, `cycle`, `step`, `level_n` of the engine; `branch`, 1
        while loading, -1 while unloading, else 0.

        Raises:
            BadInputError: the run ended before there was a contact.
        """
        press, ticks = self._press, self._recording.ticks
        tick = np.searchsorted(ticks.time_s, press.time_s, side="right") - 1
        tick = np.clip(tick, 0, len(ticks.time_s) - 1)
        branch = np.isin(press.phase, LOADING).astype(np.int64)
        branch -= np.isin(press.phase, UNLOADING)
        return Table(
            {
                "time_s": press.time_s,
                "force_n": press.force_n,
                "travel_m": press.travel_m,
                "deformation_m": press.travel_m - self._conditions.bend(press.force_n),
                "phase": press.phase,
                "cycle": press.cycle,
                "step": ticks.step[tick],
                "level_n": ticks.level_n[tick],
                "branch": branch,
            }
        )

    @cached_property
    def wrench(self) -> Table:
        """The six components of the force sensor, in its frame, one row per row of `curve`.

        Tared, with the drift of the zero between tares subtracted. Columns: `time_s`, those of
        `force`, `phase`, `cycle`. A component that the sensor does not have is NaN. Raises as
        `curve`.
        """
        press = self._press
        index, sign = "xyz".index(press.axis[2]), -1.0 if press.axis[0] == "-" else 1.0
        others = [i for i in range(3) if i != index]
        none = np.full(press.time_s.size, np.nan)
        columns = dict.fromkeys(SIX["wrench"], none)
        columns[SIX["wrench"][index]] = sign * press.force_n
        if press.across_n is not None:
            for place, i in enumerate(others):
                columns[SIX["wrench"][i]] = press.across_n[:, place]
        if press.torque_n_m is not None:
            for place, i in enumerate((*others, index)):
                columns[SIX["wrench"][3 + i]] = press.torque_n_m[:, place]
        rest = {"phase": press.phase, "cycle": press.cycle}
        return Table({"time_s": press.time_s, **columns, **rest})

    @cached_property
    def contact(self) -> ContactQuality | Missing:
        """How the contact of the run was made: lateral force, slips, place. Raises as `curve`.

        `Missing` says why nothing is known, as with a force sensor of one axis.
        """
        return quality_of(self._evaluated, self._conditions.lever_m)

    @property
    def touches(self) -> tuple[TouchPoint, ...]:
        """Every touch.

        Raises:
            BadInputError: the run ended before there was a contact.
        """
        return tuple(self._press.touches)

    @cached_property
    def levels(self) -> tuple[Level, ...]:
        """Every hold of a load level; raises as `curve`."""
        return tuple(levels_of(self._evaluated, self.events, self._conditions))


def _table(columns: Any, time: str) -> Table:
    """A stream: one column for each field or vector component."""
    flat: dict[str, Column] = {}
    for name, values in columns._asdict().items():
        if names := SIX.get(name):
            flat |= {each: values[:, index] for index, each in enumerate(names)}
        else:
            flat[name] = values
    return Table(flat, time)


def open_run(path: str | Path) -> Run:
    """Open a run: its directory or its record, finished, unfinished or resumed.

    An unfinished record is read as far as it is intact; `Run.damage` says where it ends.

    Raises:
        BadInputError: there is no record of stepload, or nothing readable in it.
    """
    file = record_in(Path(path))
    with untrusted(file):
        recording = read_recording(file)
        streams: dict[str, Any] = {
            name: None if (columns := getattr(recording, name)) is None else _table(columns, time)
            for name, time in STREAMS.items()
        }
        return Run(
            path=file,
            **streams,
            events=recording.events,
            metadata=recording.metadata,
            outcome=recording.outcome,
            results=recording.results,
            partial=recording.partial,
            damage=recording.damage,
            _recording=recording,
        )
