"""A run for the page while its record grows: its state, what is left, and new points of curves."""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from stepload.engine.rules import RULES
from stepload.errors import SteploadError
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.feasibility.remaining import Remaining
from stepload.live.state import State
from stepload.live.tail import Tail
from stepload.record.reader import Event
from stepload.record.recovery import is_being_written
from stepload.record.rows import FloatArray, TickRow
from stepload.report.run_record import plan_of
from stepload.ui.folder import numbers

MOST_BYTES = 1 << 18
"""Bytes of a record that are read in one step."""
PART_S, PARTS = 0.05, 4000
"""A point stands for so long a time, or for a share of the run so far if that is longer."""
QUIET = 4
"""Steps without anything new after which every sample of the last ticks is there."""
THEORY_POINTS = 40
TEXTS = ("run_id", "plan", "payload", "specimen", "rig", "operator", "started")


class Follower:
    """Reads the record of a run that goes on, step by step.

    Raises:
        SteploadError, OSError: in every step, where it is no record.
    """

    def __init__(self, record: Path) -> None:
        self._record = record
        self._tail = Tail(record)
        self._state: State | None = None
        self._preflight: Preflight | None = None
        self._remaining: Remaining | None = None
        self._start_s = math.nan
        self._quiet, self._same_clock = 0, False
        self.ended = False

    def close(self) -> None:
        """Close the record."""
        self._tail.close()

    def step(self) -> dict[str, Any] | None:
        """What is new since the last step; None where nothing is."""
        tail = self._tail
        alone = self._quiet > 0 and not self._goes_on()  # looked at before it is read to the end
        tail.read(MOST_BYTES)
        rows, (_, events) = tail.rows(), tail.events()
        told: dict[str, Any] = {}
        if self._state is None and tail.attachments.get("limits.json"):
            told["run"] = self._begin()
        if self._state is None:
            self._quiet += 1
            self.ended = alone or tail.ended
            return {"ended": "whole" if tail.ended else "broken"} if self.ended else None
        whole = tail.ended or self._quiet >= QUIET
        self._state.take(*rows, events, ended=whole)
        stops = [_stop(event) for event in events if event.kind == "trip"]
        if self._state.taken:
            told |= self._points(self._state.taken) | {"state": self._state.told()}
            row = self._state.row
            if row is not None and self._same_clock:
                told["behind_s"] = round(time.monotonic() - row.time_s, 1)
            if row is not None and self._remaining is not None:
                told["left_s"] = round(self._remaining.at(row), 1)
                told["share"] = round(self._remaining.share, 4)
        elif alone or tail.ended:
            self.ended = True
            told["ended"] = "whole" if tail.ended else "broken"
        if stops:
            told["stop"] = stops[0]
        self._quiet = 0 if told else self._quiet + 1
        return told or None

    def _goes_on(self) -> bool:
        try:
            return is_being_written(self._record)
        except OSError:  # renamed: it is finished
            return False

    def _begin(self) -> dict[str, Any]:
        metadata, attachments = self._tail.metadata, self._tail.attachments
        self._state = State(metadata, attachments)
        with suppress(SteploadError):  # a plan of another version: then without its times
            self._preflight = preflight_of(plan_of(metadata, attachments))
            procedure = self._preflight.plan.procedure
            self._remaining = Remaining(self._preflight.stages, procedure)
        virtual = metadata.get("dry_run") == "true"
        self._same_clock = not virtual and metadata.get("host") == platform.node()
        return {
            **{name: metadata.get(name, "") for name in TEXTS},
            "simulated": "true" in (metadata.get("simulated"), metadata.get("dry_run")),
            "virtual": virtual,
            "rules": {code: rule.name for code, rule in RULES.items() if rule.used},
            "theory": self._theory(),
        }

    def _theory(self) -> dict[str, Any] | None:
        """Force against deformation by theory, of the softest and the stiffest payload stated."""
        if self._preflight is None:
            return None
        theory = self._preflight.theory
        force_n = np.linspace(0.0, self._preflight.plan.procedure.top_force_n, THEORY_POINTS)
        laws = {"softest": theory.softest, "stiffest": theory.stiffest}
        curves = {
            name: numbers(np.array([law.deformation(each) * 1e6 for each in force_n]), 3)
            for name, law in laws.items()
        }
        return {"equation": theory.law.equation, "force_n": numbers(force_n, 2), **curves}

    def _points(self, taken: Sequence[tuple[TickRow, float]]) -> dict[str, Any]:
        """Smallest and largest force of each short time, its last limit and mean curve."""
        assert self._state is not None
        columns = {
            name: np.array([getattr(row, name) for row, _ in taken])
            for name in ("time_s", "force_n", "limit_n", "level_n", "predicted_peak_n")
        }
        if math.isnan(self._start_s):
            self._start_s = float(columns["time_s"][0])
        time_s = columns["time_s"] - self._start_s
        width_s = max(PART_S, float(time_s[-1]) / PARTS)
        part = np.floor(time_s / width_s)
        starts = np.flatnonzero(np.diff(part, prepend=-1.0))
        ends = np.append(starts[1:], len(part)) - 1
        if self._remaining is not None:
            for end in ends[:-1]:
                self._remaining.at(taken[end][0])
        deformation_um = self._state.deformation_um(taken)
        force_n = columns["force_n"]
        return {
            "time": {
                "time_s": numbers(time_s[ends], 3),
                "low_n": numbers(_reduced(np.fmin, force_n, starts), 2),
                "high_n": numbers(_reduced(np.fmax, force_n, starts), 2),
                "limit_n": numbers(columns["limit_n"][ends], 2),
                "level_n": numbers(columns["level_n"][ends], 2),
                "predicted_n": numbers(_reduced(np.fmax, columns["predicted_peak_n"], starts), 2),
            },
            "curve": {
                "deformation_um": numbers(_means(deformation_um, starts, ends), 3),
                "force_n": numbers(_means(force_n, starts, ends), 2),
            },
        }


def _reduced(how: np.ufunc, values: FloatArray, starts: Any) -> FloatArray:
    return np.asarray(how.reduceat(values, starts))


def _means(values: FloatArray, starts: Any, ends: Any) -> FloatArray:
    return np.asarray(np.add.reduceat(values, starts) / (ends - starts + 1))


def _stop(event: Event) -> dict[str, Any]:
    told: Any = event.data
    return {"rule": str(told.get("rule")), "message": str(told.get("message"))}
