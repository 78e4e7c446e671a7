"""The table of phases: complete, told in docs/record.md, and kept by every tick of whole runs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from long_ones import long
from run_bench import bench_for, run
from run_plans import stvf_plan
from tilted_plans import tilted_plan

from stepload.engine.phases import May
from stepload.engine.sequence import PHASES
from stepload.plan.model import Plan
from stepload.record.rows import Phase, TickRow

PAGE = Path(__file__).parents[3] / "docs" / "record.md"
SHORT = {"top_force_n": 60.0, "step_n": 30.0, "hold_s": 0.1, "settle_timeout_s": 0.5}
RUNS = {
    "two cycles": stvf_plan(**SHORT, cycles=2),
    "without lift-off": stvf_plan(**SHORT, cycles=2, lift_off=False),
}
SIX = tilted_plan(0.3, -0.2)
ROUNDING_M = 1e-15


def test_every_phase_is_in_the_table_and_the_page_tells_it() -> None:
    assert set(PHASES) == set(Phase)
    _, _, after = PAGE.read_text(encoding="utf-8").partition("| number | phase |")
    told = after.partition("\n\n")[0].splitlines()[2:]
    assert told == [
        f"| {int(number)} | {number.name.replace('_', ' ').lower()} | {row.entry} | {row.may} |"
        f" {', '.join(row.exits) or 'none'} |"
        for number, row in sorted(PHASES.items())
    ]


def moves(rows: list[TickRow], shifts_m: list[tuple[float, float]]) -> dict[Phase, set[str]]:
    """How the target moved within each phase."""
    found: dict[Phase, set[str]] = {}
    for (before, row), (from_m, to_m) in zip(pairwise(rows), pairwise(shifts_m), strict=True):
        if before.phase != row.phase:
            continue
        kinds, way_m = found.setdefault(Phase(row.phase), set()), row.target_m - before.target_m
        if abs(way_m) > ROUNDING_M:
            kinds.add("towards" if way_m > 0.0 else "back")
        if from_m != to_m:
            kinds.add("across")
    return found


ALLOWED = {
    May.STAND: set(), May.TOWARDS: {"towards"}, May.BACK: {"back"},
    May.BACK_OR_ACROSS: {"back", "across"},
}  # fmt: skip


@pytest.mark.parametrize("plan", [*RUNS.values(), *long([SIX])])
def test_no_phase_commands_what_the_table_does_not_allow(plan: Plan) -> None:
    bench = bench_for(plan)
    rows: list[TickRow] = []
    shifts_m: list[tuple[float, float]] = []
    tick = bench.engine.tick

    class Told:
        """The engine, with the shift of every tick kept."""

        def __getattr__(self, name: str) -> object:
            return getattr(bench.engine, name)

        def tick(self, *given: object) -> tuple[float, bool]:
            target_m, done = tick(*given)  # type: ignore[arg-type]
            shifts_m.append(bench.engine.shift_m)
            return target_m, done

    engine = run(replace(bench, engine=Told()), rows=rows)  # type: ignore[arg-type]
    assert engine.cause is None
    assert engine.course.done
    found = moves(rows, shifts_m)
    for number, kinds in found.items():
        assert kinds <= ALLOWED[PHASES[number].may], number.name
    assert {Phase.LOAD, Phase.HOLD, Phase.RETRACT} <= set(found)
    if plan.procedure.alignment:
        assert "across" in found[Phase.ALIGN]
