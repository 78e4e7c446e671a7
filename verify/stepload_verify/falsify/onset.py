"""Faults that begin when the force reaches a level, instead of at a time.

A slightly slower run reaches the same force at another time: the most harmful moment of a fault
depends on the force, not on the clock. A search over the force finds it; a search over the time
alone has to hit a window of some tenths of a second, which every change of the rig shifts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from random import Random
from typing import NamedTuple

from stepload.engine.tick import Engine
from stepload.record.rows import TickRow
from stepload.rig.world import WorldFault, WorldView
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.plants import log_uniform
from stepload_verify.campaign.scenario import Scenario
from stepload_verify.campaign.single import run_scenario

BY_FORCE_SHARE = 0.5
"""Share of the faults that begin at a force; the others begin when a campaign draws it."""
LATER_S = (1e-3, 1.0)
"""Range of the time between that force and the fault, where there is one."""
LATER_SHARE = 0.5


class Onset(NamedTuple):
    """A fault begins with this delay after the true force first exceeds this share of F_c."""

    share: float
    later_s: float


def draw_onset(chance: Random) -> Onset | None:
    """Where a fault begins by force; None where it begins by the clock. Reads four numbers."""
    by_force, share = chance.random() < BY_FORCE_SHARE, chance.random()
    at_once, later_s = chance.random() >= LATER_SHARE, log_uniform(chance, *LATER_S)
    return Onset(share, 0.0 if at_once else later_s) if by_force else None


def placed(
    scenario: Scenario, onsets: Sequence[Onset | None], ablation: Ablation | None
) -> Scenario:
    """The same run with its faults at the times at which their forces are passed.

    The run is first simulated without these faults, up to the last of these forces, to find the
    times. A fault whose force is never exceeded begins when the force is largest.

    Args:
        scenario: its faults begin by the clock.
        onsets: of each of its faults.
        ablation: what is left out, as in the run itself.
    """
    waiting = [onset for onset in onsets if onset is not None]
    if not waiting:
        return scenario
    pairs = list(zip(scenario.faults, onsets, strict=True))
    look = _Look([onset.share * scenario.limits.elastic_limit_n for onset in waiting])
    by_clock = [fault for fault, onset in pairs if onset is None]
    run_scenario(_with_faults(scenario, by_clock), ablation, look.at_tick, look.at_begin)
    times_s = iter(look.times_s)
    return _with_faults(scenario, [
        fault if onset is None else replace(fault, start_s=next(times_s) + onset.later_s)
        for fault, onset in pairs
    ])  # fmt: skip


def _with_faults(scenario: Scenario, faults: Sequence[WorldFault]) -> Scenario:
    return replace(scenario, truth=replace(scenario.truth, faults=tuple(faults)))


class _SeenError(Exception):
    """All forces were exceeded: the simulation can end."""


class _Look:
    """Observes a run, and records when each of these forces was first exceeded."""

    def __init__(self, forces_n: Sequence[float]) -> None:
        self._forces_n = forces_n
        self._passed_s: dict[int, float] = {}
        self._peak_n, self._peak_s = 0.0, 0.0
        self._world: WorldView | None = None

    @property
    def times_s(self) -> list[float]:
        """Time at which each force was passed, or at which the force was largest."""
        return [self._passed_s.get(i, self._peak_s) for i in range(len(self._forces_n))]

    def at_begin(self, _engine: Engine, world: WorldView) -> None:
        """The run begins in this world."""
        self._world = world

    def at_tick(self, row: TickRow) -> None:
        """After a tick."""
        assert self._world is not None
        peak_n = self._world.true_peak_force_n
        if peak_n <= self._peak_n:
            return
        self._peak_n, self._peak_s = peak_n, row.time_s
        for index, force_n in enumerate(self._forces_n):
            if peak_n > force_n:
                self._passed_s.setdefault(index, row.time_s)
        if len(self._passed_s) == len(self._forces_n):
            raise _SeenError
