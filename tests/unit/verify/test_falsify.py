"""The directed search: tapes, strata, points, onsets, rows, and what searches have found."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from long_ones import long

from stepload.errors import DomainError, RefusedError
from stepload.jobs.pool import Pool
from stepload.plan.load import load_plan
from stepload.rig.world import WorldFault
from stepload_verify.campaign.mishaps import FOR_GOOD_S
from stepload_verify.campaign.scenario import Scenario
from stepload_verify.falsify.falsify import FILES, TABLE, Search, falsify, stored_from
from stepload_verify.falsify.hunt import Hunt, Row
from stepload_verify.falsify.onset import Look, Tape, placed, starts_of
from stepload_verify.falsify.scene import Bench, length, rig_length
from stepload_verify.falsify.scene_file import read_scene, text_of
from stepload_verify.falsify.strata import (
    ONLY_START,
    PHASES,
    START,
    Stratum,
    kinds_for,
    phases_of,
    strata,
)
from stepload_verify.falsify.trial import judge

ROOT = Path(__file__).parents[3]
TEMPLATE = load_plan(ROOT / "procedures/campaign.yaml")
LOADED = Stratum("one", 2, ("second_freeze",), "load")


def scene(stratum: Stratum = LOADED, seed: int = 1) -> tuple[Scenario, tuple[float, ...]]:
    """The first point of a seed at which there is a run."""
    hunt = Hunt(TEMPLATE, stratum, seed)
    for number, point in zip(range(400), hunt._at_random(), strict=False):
        found = Bench(TEMPLATE, stratum).scenario(number, point)
        if found is not None:
            return found, point
    raise AssertionError(f"no run in {stratum.name}")


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_every_draw_from_a_tape_is_monotone_in_its_number(low: float, high: float) -> None:
    low, high = sorted((low, high))

    def draws(u: float) -> list[float]:
        tape = Tape((u,) * 6)
        return [
            tape.random(), tape.uniform(2.0, 3.0), tape.choice((1, 2, 3)), tape.randrange(5),
            tape.gauss(0.0, 1.0), tape.getrandbits(32),
        ]  # fmt: skip

    assert all(a <= b for a, b in zip(draws(low), draws(high), strict=True))
    assert all(map(math.isfinite, draws(high)))
    assert draws(high)[2:4] <= [3, 4]


def test_each_fault_has_a_stratum_for_each_phase_and_rig_once() -> None:
    found = strata(("one", "six"))
    assert len({one.name for one in found}) == len(found)
    for axes in ("one", "six"):
        for channels in (1, 2):
            mine = [one for one in found if (one.axes, one.channels) == (axes, channels)]
            kinds = kinds_for(axes, channels)
            assert {one.wrong[0] for one in mine} == set(kinds)
            assert len(mine) == sum(len(phases_of(kind)) for kind in kinds)
    alone = kinds_for("six", 1)
    assert not any(kind.startswith(("second_", "arm_force_", "link_")) for kind in alone)
    assert set(kinds_for("six", 2)) - set(kinds_for("one", 2)) >= {"plate_slips", "plate_tilted"}
    assert {one.phase for one in found if one.wrong[0] in ONLY_START} == {START}
    assert {one.phase for one in found} == set(PHASES)


@pytest.mark.parametrize(
    "stratum",
    [
        Stratum("one", 2, ("arm_turned",), START),
        Stratum("one", 2, ("force_gain", "second_freeze"), ""),
        Stratum("six", 2, ("link_freeze",), "load"),
        *long(Stratum("one", 2, ("force_gain",), phase) for phase in PHASES[1:]),
        *long(
            [Stratum("one", 1, ("signal_int",), "hold"), Stratum("six", 1, ("wrong_lever",), START)]
        ),
    ],
    ids=lambda stratum: stratum.name,
)
def test_a_point_is_one_run_and_its_parts_move_alone(stratum: Stratum) -> None:
    found, point = scene(stratum)
    assert len(point) == length(stratum)
    assert found.wrong == stratum.wrong
    assert found == Bench(TEMPLATE, stratum).scenario(found.index, point)
    other = [*point[: rig_length(stratum)], *(0.5 * x for x in point[rig_length(stratum) :])]
    moved = Bench(TEMPLATE, stratum).scenario(0, other)
    assert moved is None or moved.preflight == found.preflight
    with pytest.raises(DomainError):
        Bench(TEMPLATE, stratum).scenario(0, point[:10])


def test_a_fault_begins_in_its_phase() -> None:
    found, _ = scene()
    look = Look(found)
    touch_s, back_s, end_s = look.touch_s, look.back_s, look.end_s
    assert 0.0 < touch_s < look.holds_s[0] < back_s < end_s
    middle = (0.5, 0.0, 0.0, 0.0)
    onsets = {phase: look.onset_s(phase, Tape(middle), 0.1) for phase in PHASES[1:]}
    assert onsets["free"] < touch_s < onsets["load"] < back_s < onsets["back"] < end_s
    assert look.onset_s("free", Tape((0.0,) * 4), 0.1) == 0.0
    assert onsets["hold"] in look.holds_s
    assert abs(onsets["touch"] - touch_s) < 0.5
    assert look.passed_s(0.2) < look.passed_s(0.6) < math.inf
    assert look.passed_s(9.0) == math.inf


def test_faults_of_one_cause_are_moved_together() -> None:
    found, _ = scene(Stratum("one", 2, ("link_lost",), "hold"))
    [start_s] = starts_of(found)
    moved = placed(found, {start_s: 1.25})
    assert {fault.start_s for fault in moved.faults} == {1.25}
    signals, _ = scene(Stratum("one", 2, ("signal_int",), "hold"), 3)
    first_s = signals.incidents[0].start_s
    later = placed(signals, {first_s: first_s + 0.5})
    for one, other in zip(signals.incidents, later.incidents, strict=True):
        assert other.start_s == pytest.approx(one.start_s + 0.5)


@pytest.mark.long
def test_a_search_goes_on_where_it_was_left_and_ends_alike(tmp_path: Path) -> None:
    strata_of = [Stratum("one", 2, ("force_nan",), "free"), Stratum("one", 1, ("arm_nan",), "free")]
    what = Search(TEMPLATE, 2, 3)
    first = falsify(what, strata_of[:1], pool=Pool(1), directory=tmp_path)
    rows = falsify(what, strata_of, pool=Pool(1), directory=tmp_path)
    assert first[0] in rows
    assert all(row.evaluations >= 2 for row in rows)
    assert len((tmp_path / FILES[1]).read_text().splitlines()) == 2
    least = max(row.j for row in rows if row.j is not None)
    assert stored_from(tmp_path, least) == {rows[0].series}
    with (tmp_path / TABLE).open() as file:
        table = list(csv.DictReader(file))
    assert [row["stratum"] for row in table] == [row.series for row in rows]
    with pytest.raises(RefusedError, match="seed"):
        falsify(what._replace(seed=4), strata_of, pool=Pool(1), directory=tmp_path)
    for row in rows:
        assert Row.from_line(row.to_line()) == row
        stratum = next(one for one in strata_of if one.name == row.series)
        again = Bench(TEMPLATE, stratum).scenario(0, row.point)
        assert again is not None
        assert judge(again).j == row.j
    with pytest.raises(ValueError, match="not a row"):
        Row.from_line("{}")


def test_a_search_climbs_and_counts_hazards_apart() -> None:
    hunt = Hunt(TEMPLATE, Stratum("one", 1, ("force_stuck_mean",), "load"), 1)
    hunt.search(10)
    row = hunt.row(10)
    assert row.hazards == row.evaluations >= 4
    assert (row.j, row.above, row.hazard) == (None, 0, "only_channel_lies")
    assert row.hazard_j is not None


def test_a_scene_file_replays_exactly(tmp_path: Path) -> None:
    found, _ = scene()
    before = judge(found)
    path = tmp_path / "scene.json"
    path.write_text(text_of(found, {"j": before.j, "peak_ratio": before.peak_ratio}))
    again, figures = read_scene(path)
    assert (again.truth, again.limits, again.hazard) == (found.truth, found.limits, found.hazard)
    assert judge(again) == before
    assert figures["j"] == before.j


@pytest.mark.parametrize(
    "path", sorted((ROOT / "docs/scenes").glob("*.json")), ids=lambda p: p.stem
)
def test_what_searches_have_found_stays_below_f_c(path: Path) -> None:
    found, figures = read_scene(path)
    assert figures["j"] > 1.0
    assert judge(found).j < 1.0


def test_j_is_nothing_at_the_top_force_and_more_than_one_beyond_the_limit() -> None:
    found, _ = scene()
    fault = WorldFault("force_nan", 0.0, FOR_GOOD_S, 0.0)
    early = replace(found, truth=replace(found.truth, faults=(fault,)))
    assert judge(early).j < 0.0
    plain = judge(replace(found, truth=replace(found.truth, faults=()), anomalies=(), wrong=()))
    assert -0.1 < plain.j < 1.0
