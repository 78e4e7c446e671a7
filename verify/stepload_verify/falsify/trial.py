"""One evaluation of a search: run the scenario at a point, and measure how near to F_c it came."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

from stepload.engine.margins import margins
from stepload.engine.tick import Engine
from stepload.plan.model import Plan
from stepload.record.rows import TickRow
from stepload.rig.world import WorldView
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.digest import loaded
from stepload_verify.campaign.scenario import BLIND, Scenario
from stepload_verify.campaign.single import run_scenario
from stepload_verify.falsify.excuses import excuses
from stepload_verify.falsify.scene import scenario_at
from stepload_verify.falsify.strata import Stratum

NO_RUN = "no run"
"""Status of a point at which there is no rig that can press, or none within the time."""
LOOK_TICKS = 8
"""Interval in ticks at which margins are computed, on a rising force: each costs a tick."""
FORCE_RULES = ("R1", "R2")
UNSEEN_WEIGHT = REACHED_WEIGHT = 0.1
"""Weights, relative to J, of the force that no channel showed and of the share of the top force
reached.

They rank runs that never exceeded the top force, for which J says little.
"""


@dataclass(frozen=True, slots=True)
class Trial:
    """Result of the run at one point.

    Attributes:
        series, index: stratum and number of the point in it.
        j: (peak − F_top)/(F_c − F_top): 0 for a healthy run, above 1 where F_c was passed; −inf at
            a point without a run.
        unseen: the most by which the true force was above what either channel showed just then,
            over F_c.
        hazard: the hazard that preflight names for such a run and that takes it out of the claim,
            or "".
        peak_ratio: true peak force over F_c.
        reached: true peak force over the top force.
        margin: the share of its limit that the rule nearest to a stop had left when the true force
            was largest, R1 and R2 apart; looked at every `LOOK_TICKS` ticks.
        status, rule, phase: how it ended.
    """

    series: str
    index: int
    j: float
    unseen: float
    hazard: str
    peak_ratio: float
    reached: float
    margin: float
    status: str
    rule: str
    phase: str

    @property
    def score(self) -> float:
        """The score that the search maximises."""
        if self.status == NO_RUN:
            return -math.inf
        shaped = UNSEEN_WEIGHT * self.unseen + REACHED_WEIGHT * min(1.0, self.reached)
        return max(0.0, self.j) + shaped

    @property
    def ended_by(self) -> str:
        """The rule or the status by which it ended."""
        return self.rule or self.status

    @property
    def broken(self) -> bool:
        """Whether F_c was exceeded, and no named hazard explains it."""
        return self.j > 1.0 and not self.hazard

    def to_line(self) -> str:
        """One line of JSON, without its line end; a j of −inf is null."""
        row = asdict(self)
        row["j"] = None if math.isinf(self.j) else self.j
        return json.dumps(row, separators=(",", ":"), allow_nan=False)

    @classmethod
    def from_line(cls, line: str) -> Trial:
        """The inverse of `to_line`.

        Raises:
            ValueError: not such a line.
        """
        try:
            row = json.loads(line)
            trial = cls(**{**row, "j": -math.inf if row["j"] is None else float(row["j"])})
            whole = trial.j < math.inf and all(
                map(math.isfinite, (trial.unseen, trial.peak_ratio, trial.reached, trial.margin))
            )
        except (TypeError, KeyError) as error:
            raise ValueError(f"not a trial of a search: {error}") from error
        if not whole:
            raise ValueError("not a trial of a search: its figures are none")
        return trial


class Point(NamedTuple):
    """A point to be tried."""

    stratum: Stratum
    number: int
    point: tuple[float, ...]


class Search(NamedTuple):
    """Common settings of all trials of a search; `ablation` is the omitted layer, or ""."""

    template: Plan
    ablation: str = ""

    @property
    def digest(self) -> str:
        """Digest of the code that determines the result of a trial."""
        return loaded(Path(__file__).parent)

    def run(self, at: Point, /) -> Trial:
        """Try a point."""
        return try_point(self, at)


@cache
def left_out(name: str) -> Ablation | None:
    """What is left out under this name; None for ""."""
    return Ablation(name) if name else None


def try_point(search: Search, at: Point) -> Trial:
    """The result at a point."""
    scenario = scenario_at(
        search.template, at.stratum, at.number, at.point, left_out(search.ablation)
    )
    if scenario is None:
        return no_run(at)
    if scenario.hazard == BLIND:
        return no_run(at, scenario.hazard)
    return judge(scenario, search.ablation)


def no_run(at: Point, hazard: str = "") -> Trial:
    """The trial of a point without a run."""
    return Trial(at.stratum.name, at.number, -math.inf, 0.0, hazard, 0.0, 0.0, 0.0, NO_RUN, "", "")


def judge(scenario: Scenario, ablation: str = "") -> Trial:
    """Run a scenario and say how near to F_c it came."""
    look = _Look()
    result, _ = run_scenario(scenario, left_out(ablation), look.at_tick, look.at_begin)
    top_n = scenario.plan.procedure.top_force_n
    room_n = scenario.limits.elastic_limit_n - top_n
    j, hazard = (result.peak_n - top_n) / room_n, scenario.hazard
    if j > 1.0 and not hazard:
        for name, rest in excuses(scenario, result.peak_n):
            if judge(rest, ablation).j <= 1.0:
                hazard = name
                break
    return Trial(
        series=scenario.series,
        index=scenario.index,
        j=j,
        unseen=look.unseen_n / scenario.limits.elastic_limit_n,
        hazard=hazard,
        peak_ratio=result.peak_ratio,
        reached=result.peak_n / top_n,
        margin=look.margin,
        status=result.status,
        rule=result.rule,
        phase=result.phase,
    )


class _Look:
    """Observes a run: the hidden force, and how near the rules were to a stop."""

    def __init__(self) -> None:
        self.unseen_n = 0.0
        self.margin = 0.0
        self._peak_n = 0.0
        self._ticks = 0
        self._seen: tuple[Engine, WorldView] | None = None

    def at_begin(self, engine: Engine, world: WorldView) -> None:
        """The run begins."""
        self._seen = engine, world

    def at_tick(self, row: TickRow) -> None:
        """After a tick."""
        assert self._seen is not None
        engine, world = self._seen
        unseen_n = world.true_force_n - max(row.force_n, row.second_force_n)
        if unseen_n > self.unseen_n:
            self.unseen_n = unseen_n
        self._ticks += 1
        if self._ticks % LOOK_TICKS:
            return
        if world.true_force_n > self._peak_n and engine.cause is None:
            self._peak_n = world.true_force_n
            shares = margins(engine.supervisor, engine.limits, row.time_s, row.phase)
            nearest = max((s for rule, s in shares.items() if rule not in FORCE_RULES), default=0.0)
            self.margin = max(0.0, 1.0 - nearest)
