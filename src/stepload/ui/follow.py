"""A run for the page while its record grows: its state, what is left, and new points."""

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
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.remaining import Remaining
from stepload.live.state import State
from stepload.live.tail import Tail
from stepload.record.rows import TickRow
from stepload.report.run_record import plan_of
from stepload.ui.folder import curve, goes_on, numbers

MOST_BYTES = 1 << 18
"""Bytes of a record that are read in one step."""
PART_S, PARTS = 0.05, 4000
"""A point stands for so long a time, or for a share of the run so far if that is longer."""
QUIET = 4
"""Steps without anything new after which every sample of the last ticks is there."""
STOP = ("rule", "message")


class Follower:
    """Reads the record of a run that goes on, step by step.

    Raises:
        SteploadError, OSError: in every step, where it is no record.
    """

    def __init__(self, record: Path) -> None:
        self._record = record
        self._tail = Tail(record)
        self._state: State | None = None
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
        alone = self._quiet > 0 and not goes_on(self._record)  # before it is read to the end
        tail.read(MOST_BYTES)
        rows, (_, events) = tail.rows(), tail.events()
        told: dict[str, Any] = {}
        if self._state is None and tail.attachments.get("limits.json"):
            told["run"] = self._begin()
        if self._state is not None:
            self._state.take(*rows, events, ended=tail.ended or self._quiet >= QUIET)
            for event in events:
                if event.kind == "trip":
                    stop: Any = event.data
                    told.setdefault("stop", {key: str(stop.get(key)) for key in STOP})
            if self._state.taken:
                told |= self._points(self._state, self._state.taken)
        if (alone or tail.ended) and "state" not in told:
            self.ended = True
            told["ended"] = "whole" if tail.ended else "broken"
        self._quiet = 0 if told else self._quiet + 1
        return told or None

    def _begin(self) -> dict[str, Any]:
        metadata, attachments = self._tail.metadata, self._tail.attachments
        self._state = State(metadata, attachments)
        with suppress(SteploadError):  # a plan of another version: then without its times
            preflight = preflight_of(plan_of(metadata, attachments))
            self._remaining = Remaining(preflight.stages, preflight.plan.procedure)
        virtual = metadata.get("dry_run") == "true"
        self._same_clock = not virtual and metadata.get("host") == platform.node()
        return {
            "virtual": virtual,
            "rules": {code: rule.name for code, rule in RULES.items() if rule.used},
        }

    def _points(self, state: State, taken: Sequence[tuple[TickRow, float]]) -> dict[str, Any]:
        """The state, smallest and largest force of each short time, its last limit, mean curve."""
        time_s, force_n, limit_n, level_n = np.array(
            [(row.time_s, row.force_n, row.limit_n, row.level_n) for row, _ in taken]
        ).T
        if math.isnan(self._start_s):
            self._start_s = float(time_s[0])
        since_s = time_s - self._start_s
        part = np.floor(since_s / max(PART_S, float(since_s[-1]) / PARTS))
        starts = np.flatnonzero(np.diff(part, prepend=-1.0))
        ends = np.append(starts[1:], len(part)) - 1
        told: dict[str, Any] = {
            "state": state.told(),
            "time": {
                "time_s": numbers(since_s[ends], 3),
                "low_n": numbers(np.fmin.reduceat(force_n, starts), 2),
                "high_n": numbers(np.fmax.reduceat(force_n, starts), 2),
                "limit_n": numbers(limit_n[ends], 2),
                "level_n": numbers(level_n[ends], 2),
            },
            "curve": curve(state.deformation_um(taken), force_n, starts),
        }
        if self._same_clock:
            told["behind_s"] = round(time.monotonic() - float(time_s[-1]), 1)
        if self._remaining is not None:
            left_s = [self._remaining.at(taken[end][0]) for end in ends]
            told |= {"left_s": round(left_s[-1], 1), "share": round(self._remaining.share, 4)}
        return told
