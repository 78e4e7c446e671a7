"""State of a run for viewers besides its raw streams: forces, limits, deformation, margins."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np

from stepload.engine.replay import Replayer, changed_limits, group_by_tick, limits_from, zero_of
from stepload.engine.rules import RULES, margins
from stepload.engine.sequence import PHASES
from stepload.engine.watch import wrench_axis
from stepload.record.reader import Event
from stepload.record.rows import (
    ArmColumns,
    FloatArray,
    ForceColumns,
    Phase,
    TickColumns,
    TickRow,
    rows_of,
)
from stepload.report.conditions import from_attachments
from stepload.report.model import finite
from stepload.report.press_data import LOADING, UNLOADING
from stepload.rig.samples import ArmSample, ForceSample

LONGEST_TARE_S = 60.0
LIVE = "/live"
"""Topic of `State.told`."""


def _number(meaning: str) -> dict[str, Any]:
    return {"type": ["number", "null"], "description": meaning}


LIVE_SCHEMA: dict[str, Any] = {
    "title": "stepload.Live",
    "type": "object",
    "properties": {
        "time_s": _number("the run's clock"),
        "phase": {"type": "string"},
        "may": {"type": "string", "description": "what the phase may command"},
        "cycle": {"type": "integer"},
        "step": {"type": "integer"},
        "level_n": _number("load level aimed at"),
        "force_n": _number("tared contact force, positive when pressing"),
        "largest_force_n": _number("largest since the last message"),
        "second_force_n": _number("the second channel, tared"),
        "predicted_peak_n": _number("as R2 predicts it"),
        "force_limit_n": _number("F_lim"),
        "elastic_limit_n": _number("F_c"),
        "used_limit_n": _number("what of F_c is counted on"),
        "target_um": _number("commanded travel from the start pose"),
        "deformation_um": _number("of the payload since the first touch"),
        "margins": {
            "type": "object",
            "description": "share of its limit that each rule has used; 1 stops the run",
            "properties": {code: _number(rule.name) for code, rule in RULES.items() if rule.used},
        },
    },
}
"""Content of `State.told`, as JSON Schema."""


def layout() -> str:
    """A layout for Foxglove and Lichtblick, as JSON."""
    made = json.loads((resources.files("stepload.live") / "layout.json").read_text())
    made["configById"]["Plot!margins"]["paths"] = [
        {"value": f"{LIVE}.margins.{code}", "label": f"{code} {rule.name}", "enabled": True,
         "timestampMethod": "receiveTime"}
        for code, rule in RULES.items()
        if rule.used
    ]  # fmt: skip
    return json.dumps(made, indent=1) + "\n"


class State:
    """Follows a run's rows and events; `told` is the state after the newest tick, for viewers.

    `taken` are the ticks of the last update, each with the arm's position in m.

    Streams are written one after the other, so the samples of the newest ticks may come with the
    next ticks: they wait for those, or for the end.

    The supervisor is run again on every tick, since its margins are not recorded.

    Args:
        metadata, attachments: of the record.

    Raises:
        BadInputError: the record does not contain the limits.
    """

    def __init__(self, metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> None:
        limits = limits_from(attachments)
        axis = metadata.get("force_axis", "+fz")
        self._first_limits = limits
        self._replayer = Replayer(limits, axis, metadata.get("second_force_axis", ""))
        self._index, self._sign = wrench_axis(axis)
        self._conditions = from_attachments(attachments)
        self._force: list[ForceSample] = []
        self._arm: list[ArmSample] = []
        self._second: list[ForceSample] = []
        self._recent: deque[ForceSample] = deque()
        self._zero = (0.0,) * 6
        self._touch_m = math.nan
        self._rows: list[TickRow] = []
        self.taken: list[tuple[TickRow, float]] = []
        self._limits_seen = 0
        self._largest_n = 0.0
        self.row: TickRow | None = None
        self.arm: ArmSample | None = None
        self.force: ForceSample | None = None
        self.tared = False

    def take(
        self,
        ticks: TickColumns,
        force: ForceColumns,
        arm: ArmColumns,
        second: ForceColumns,
        events: tuple[Event, ...],
        *,
        ended: bool = False,
    ) -> None:
        """Process the rows since the last call; `ended`: nothing more will come."""
        self._force += rows_of(ForceSample, force)
        self._recent += rows_of(ForceSample, force)
        self._arm += rows_of(ArmSample, arm)
        self._second += rows_of(ForceSample, second)
        while self._recent and (
            self._recent[-1].receive_time_s - self._recent[0].receive_time_s > LONGEST_TARE_S
        ):
            self._recent.popleft()
        for event in events:
            self._hear(event)
        new = rows_of(TickRow, ticks)
        if ended:
            rows, self._rows = [*self._rows, *new], []
        else:
            rows, self._rows = (self._rows, new) if new else ([], self._rows)
        self._largest_n = max((row.force_n for row in rows), key=abs, default=self._largest_n)
        self.taken = []
        left = list(self._force), list(self._arm), list(self._second)
        for tick in group_by_tick(rows, *left):
            self._replayer.judge(tick)
            self._replayer.follow(tick.row)
            self.force = tick.force[-1] if tick.force else self.force
            self.arm = tick.arm[-1] if tick.arm else self.arm
            self.row = tick.row
            self.taken.append((tick.row, self._position_m))
            del self._force[: len(tick.force)]
            del self._arm[: len(tick.arm)]
            del self._second[: len(tick.second)]

    def _hear(self, event: Event) -> None:
        told: Any = event.data
        if event.kind == "tare":
            zero = zero_of(event)
            self._replayer.tare(zero)
            self._take_zero(event.time_s - float(told["duration_s"]), event.time_s, zero.force_n)
        elif event.kind == "limits":
            self._limits_seen += 1
            if self._limits_seen > 1:
                limits = changed_limits(self._first_limits, event)
                self._replayer.adopt(event.time_s, limits)
        elif event.kind == "touch" and self._touch_m != self._touch_m:
            self._touch_m = float(told["position_m"])

    def _take_zero(self, start_s: float, end_s: float, zero_n: float) -> None:
        """The mean wrench of a tare; its axial component is the zero that the run used."""
        wrenches = [s.wrench for s in self._recent if start_s <= s.receive_time_s <= end_s]
        mean = np.mean(wrenches, axis=0).tolist() if wrenches else [0.0] * 6
        mean[self._index] = self._sign * zero_n
        self._zero = tuple(mean)
        self.tared = True

    @property
    def tared_wrench(self) -> tuple[float, ...] | None:
        """The newest wrench less that of the tare; None before the first tare."""
        if self.force is None or not self.tared:
            return None
        return tuple(a - b for a, b in zip(self.force.wrench, self._zero, strict=True))

    @property
    def _position_m(self) -> float:
        return self.arm.position_m if self.arm is not None else math.nan

    def told(self) -> dict[str, Any] | None:
        """The newest tick for display; None before the first. Forces in N, lengths in µm."""
        row = self.row
        if row is None:
            return None
        limits = self._replayer.limits
        largest_n, self._largest_n = self._largest_n, row.force_n
        return {
            "time_s": row.time_s,
            "phase": Phase(row.phase).name.replace("_", " ").lower(),
            "may": PHASES[Phase(row.phase)].may.value,
            "cycle": row.cycle,
            "step": row.step,
            "level_n": row.level_n,
            "force_n": finite(row.force_n),
            "largest_force_n": finite(largest_n),
            "second_force_n": finite(row.second_force_n),
            "predicted_peak_n": finite(row.predicted_peak_n),
            "force_limit_n": finite(row.limit_n),
            "elastic_limit_n": limits.elastic_limit_n,
            "used_limit_n": limits.used_limit_n,
            "target_um": finite(row.target_m * 1e6),
            "deformation_um": finite(float(self.deformation_um([(row, self._position_m)])[0])),
            "margins": margins(self._replayer.supervisor, limits, row.time_s, row.phase),
        }

    def deformation_um(self, ticks: Sequence[tuple[TickRow, float]]) -> FloatArray:
        """Deformation in µm at `ticks` of `taken`; NaN before the touch or if nothing is pressed.

        It counts from the first touch.
        """
        force_n = np.array([row.force_n for row, _ in ticks])
        travel_m = np.array([position_m for _, position_m in ticks]) - self._touch_m
        pressing = np.isin([row.phase for row, _ in ticks], [*LOADING, *UNLOADING])
        return np.where(pressing, (travel_m - self._conditions.bend(force_n)) * 1e6, np.nan)
