"""One evaluation of a search: run a scenario, and measure how near to F_c it came."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.engine.tick import Engine
from stepload.record.rows import TickRow
from stepload.rig.world import WorldView
from stepload_verify.campaign.scenario import Scenario
from stepload_verify.campaign.single import run_scenario

UNSEEN_WEIGHT = 0.1
"""Weight, relative to J, of the force that no channel showed: it ranks runs in which a fault has
some effect before those in which it has none."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Result of a run.

    Attributes:
        j: (peak − F_top)/(F_c − F_top), F_c the counted one: 0 for a healthy run, above 1 where F_c
            was passed.
        peak_ratio: true peak force over F_c.
        unseen: the most by which the true force was above what either channel showed just then,
            over F_c.
        hazard: named hazard that takes the run out of the claim, or "".
        status, rule, phase: how it ended.
    """

    j: float
    peak_ratio: float
    undetected: float
    hazard: str
    status: str
    rule: str
    phase: str

    @property
    def score(self) -> float:
        """The score that the search maximises."""
        return self.j + UNSEEN_WEIGHT * self.undetected

    @property
    def ended_by(self) -> str:
        """The rule or the status by which it ended."""
        return self.rule or self.status


def judge(scenario: Scenario) -> Trial:
    """Run a scenario and say how near to F_c it came."""
    look = _Unseen()
    result, _ = run_scenario(scenario, None, look.at_tick, look.at_begin)
    return Trial(
        j=result.j,
        peak_ratio=result.peak_ratio,
        undetected=look.undetected_n / result.elastic_limit_n,
        hazard=result.hazard,
        status=result.status,
        rule=result.rule,
        phase=result.phase,
    )


class _Unseen:
    """Observes the force that no channel shows."""

    def __init__(self) -> None:
        self.undetected_n = 0.0
        self._world: WorldView | None = None

    def at_begin(self, _engine: Engine, world: WorldView) -> None:
        """The run begins."""
        self._world = world

    def at_tick(self, row: TickRow) -> None:
        """After a tick."""
        assert self._world is not None
        true_n = self._world.true_force_n
        if true_n > 0.0:
            shown_n = row.force_n
            if row.second_force_n > shown_n:
                shown_n = row.second_force_n
            if true_n - shown_n > self.undetected_n:
                self.undetected_n = true_n - shown_n
