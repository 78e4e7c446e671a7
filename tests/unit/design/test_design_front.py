"""Which plans are worth their time, and which one is chosen."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from stepload.design import grid as room
from stepload.design import make
from stepload.design.answers import Can
from stepload.design.binomial import share
from stepload.design.ceiling import ceiling
from stepload.design.course import RATE_HZ, course
from stepload.design.front import ALIKE, Tried, choose, finalists, front
from stepload.design.grid import Candidate, grid
from stepload.design.make import AGAIN, Design, design
from stepload.design.words import sentences
from stepload.design.work import Row
from stepload.envelope.order import Order
from stepload.errors import RefusedError
from stepload.plan.shipped import payload_folder
from stepload.runner.pool import Pool

SPHERE = payload_folder() / "plastic-sphere.yaml"


@cache
def candidate() -> Candidate:
    """The last plan of a small grid."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(room, "STEPS", (4,))
        patch.setattr(room, "HOLDS_S", (1.0,))
        return grid("stvf", SPHERE, ceiling("stvf", SPHERE), "5 mm").candidates[-1]


def tried(duration_s: float, half_width: float, right: int = 250) -> Tried:
    """A plan that was rightly IDENTIFIED in so many of 250 runs."""
    measured, all_of_them = share(right, 250), share(250, 250)
    plan = candidate()
    row = Row(plan.point(0, plan.conditions), 1.0, all_of_them, measured, measured,
              all_of_them, half_width, "")  # fmt: skip
    return Tried(replace(plan, duration_s=duration_s), row)


def test_the_front_holds_what_no_faster_plan_beats() -> None:
    fast, slow, worse, hopeless = (
        tried(60.0, 0.12), tried(120.0, 0.09), tried(90.0, 0.13), tried(50.0, math.nan)
    )  # fmt: skip
    assert front([worse, slow, hopeless, fast]) == [fast, slow]
    assert front([]) == []


def test_of_plans_of_one_second_only_the_better_one_is_on_the_front() -> None:
    one, other = tried(72.1, 0.12), tried(72.3, 0.11)
    assert front([one, other]) == [other]


def test_finalists_are_the_front_and_those_behind_it_but_none_that_fails() -> None:
    fast, slow, behind = tried(60.0, 0.12), tried(120.0, 0.09), tried(130.0, 0.10)
    third = tried(140.0, 0.11)
    failing = tried(55.0, 0.05, right=100)
    assert finalists([third, failing, behind, slow, fast]) == [fast, slow, behind]


def test_the_narrowest_within_the_time_is_chosen_and_of_those_alike_the_fastest() -> None:
    slow, faster = tried(120.0, 0.09), tried(100.0, 0.09 * ALIKE * 0.999)
    wide = tried(60.0, 0.12)
    assert choose([slow, faster, wide], 300.0) is faster
    assert choose([slow, replace(faster, row=tried(1.0, 0.09 * ALIKE * 1.001).row)], 300.0) is slow
    assert choose([slow, faster, wide], 99.0) is wide
    assert choose([slow, faster, wide], 59.0) is None


def test_a_plan_that_is_not_shown_to_be_good_enough_is_never_chosen() -> None:
    unsure, failing = tried(60.0, 0.05, right=232), tried(60.0, 0.05, right=150)
    assert (unsure.can, failing.can) == (Can.UNSURE, Can.NO)
    assert choose([unsure, failing], 300.0) is None
    good = tried(70.0, 0.2)
    assert choose([unsure, failing, good], 300.0) is good


SLOW = Order(4, 1.0, 1.0, up_s=(1.0, 1.0, 2.0, 6.0), down_s=(1.0, 1.0, 3.0))


@pytest.mark.parametrize("order", [Order(4, 5.0), Order(12, 1.0), Order(), SLOW])
def test_a_course_follows_its_order(order: Order) -> None:
    run = course(240.0, 4.0, order)
    holds = [each for each in run.branch(1, loading=True) if each.held]
    assert [run.force_n[each.start] for each in holds] == pytest.approx(
        [240.0 * number / order.steps for number in range(1, order.steps + 1)]
    )
    assert {each.stop - each.start for each in holds} == {round(order.hold_s * RATE_HZ)}
    assert run.time_s[-1] == pytest.approx(2.0 * order.cycle_s)
    up, down = (
        [each for each in run.branch(1, loading=loading) if not each.held]
        for loading in (True, False)
    )
    for ramps, asked in ((up, order.up_s), (down, order.down_s[::-1])):
        took = [(each.stop - each.start) / RATE_HZ for each in ramps]
        assert took == pytest.approx(asked or (order.ramp_s,) * len(took))


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """A grid of two orders at the largest top force."""
    monkeypatch.setattr(room, "SHARES", (1.0,))
    monkeypatch.setattr(make, "SHARES", (1.0,))
    monkeypatch.setattr(room, "STEPS", (4,))
    monkeypatch.setattr(room, "HOLDS_S", (1.0, 5.0))
    monkeypatch.setattr(room, "RAMPS_S", (2.0,))


def designed(within_s: float, samples: int, seed: int = 1, rig: str = "stvf") -> Design:
    return design(
        rig, SPHERE, within_s=within_s, surface="5 mm", samples=samples, seed=seed,
        pool=Pool(1),
    )  # fmt: skip


@cache
def _known() -> Design:
    """One of the two orders of `few`; to be read only."""
    return designed(150.0, 60)


def as_asked(found: Design) -> tuple[int, float, float]:
    order = found.chosen.candidate.order
    return order.steps, order.hold_s, order.ramp_s


@pytest.mark.usefixtures("few")
def test_the_best_are_judged_again_by_more_runs() -> None:
    found = _known()
    assert as_asked(found) == (4, 5.0, 2.0)
    assert found.chosen.half_width == min(each.half_width for each in found.again)
    assert {each.row.measured.of for each in found.tried} == {60}
    assert {each.row.measured.of for each in found.again} == {60 * AGAIN}
    assert found.chosen in found.again
    again = designed(150.0, 60)
    assert [each.row for each in again.again] == [each.row for each in found.again]


@pytest.mark.usefixtures("few")
def test_a_plan_that_takes_longer_than_the_time_given_is_named_and_not_chosen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(room, "HOLDS_S", (1.0,))
    monkeypatch.setattr(room, "RAMPS_S", (1.0, 2.0))
    with pytest.raises(RefusedError, match="that takes 80 s or less was shown") as refused:
        designed(80.0, 60)
    assert "give it more --time: 300 N in 4 steps of 75 N" in refused.value.hint


@pytest.mark.usefixtures("few")
def test_the_best_are_judged_again_by_other_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(make, "AGAIN", 1)
    found = designed(150.0, 240)
    first = {each.candidate.order: each.half_width for each in found.tried}
    assert all(each.half_width != first[each.candidate.order] for each in found.again)


@pytest.mark.usefixtures("few")
def test_what_is_said_of_a_design_bears_its_figures() -> None:
    found = replace(_known(), within_s=100.0)
    said = "\n".join(sentences(found))
    assert found.chosen.candidate.text in said
    assert f"±{found.chosen.half_width:.1%}" in said
    assert "The top force cannot be larger: the table" in said
    assert "More time than the 100 s given: up to" in said
    assert "would narrow the interval by less than" in said


@pytest.mark.usefixtures("few")
def test_no_time_no_runs_and_no_rig_are_each_refused_with_a_reason() -> None:
    with pytest.raises(RefusedError, match="takes only 60 s: the fastest") as short:
        designed(60.0, 60)
    assert "longer --time" in short.value.hint
    with pytest.raises(RefusedError, match="was shown to be rightly IDENTIFIED") as unsure:
        designed(100.0, 3)
    assert "more --samples would tell" in unsure.value.hint


def test_what_to_buy_is_said_where_no_plan_is_good_enough(few: None, tmp_path: Path) -> None:
    rig = tmp_path / "ur5e.yaml"
    rig.write_text(
        "profile: ur5e\narm: {driver: sim, options: {}}\nforce: {driver: sim, options: {}}\n"
        "system_stiffness: {stuck_ratio: 1}\n"
    )
    silicone = payload_folder() / "silicone-sphere.yaml"
    with pytest.raises(RefusedError, match="no plan for silicone sphere on UR5e") as refused:
        design(
            str(rig),
            silicone,
            within_s=300.0,
            surface="5 mm",
            samples=60,
            seed=1,
            pool=Pool(1),
        )
    assert "any one of these would do: " in refused.value.hint
    assert "position of" not in refused.value.hint  # helps, but not enough
    assert "gauge of 1 µm (7" in refused.value.hint


@pytest.mark.usefixtures("few")
def test_time_that_no_plan_would_use_is_not_said_to_have_been_looked_at() -> None:
    found = replace(_known(), within_s=1e6)
    longest_s = max(each.duration_s for each in found.tried)
    [said] = [each for each in sentences(found) if each.startswith("More time")]
    assert f"no plan that was looked at takes longer than {longest_s:.0f} s" in said
    assert "would narrow" not in said


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("surface", ["1e9 m", "1 nm"])
def test_a_surface_that_no_plan_can_have_is_no_reason_to_buy_anything(surface: str) -> None:
    with pytest.raises(RefusedError, match="surface_distance") as refused:
        design("stvf", SPHERE, within_s=300.0, surface=surface, samples=1, seed=1, pool=Pool(1))
    assert "what to buy" not in refused.value.hint
    assert refused.value.hint
