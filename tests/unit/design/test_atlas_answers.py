"""What a map says: never more than its bounds bear."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from stepload.design import points as cells
from stepload.design.answers import REQUIRED, Can, Map, can, payload_answers, reaches, sentences
from stepload.design.atlas import make, shipped_payloads
from stepload.design.atlas_tables import payload_table
from stepload.design.binomial import share
from stepload.design.changes import (
    finer,
    for_sale,
    gauged,
    known,
    relative_sigma,
    stiffer,
)
from stepload.design.points import points
from stepload.design.work import Row, Work, run_all
from stepload.envelope.benches import Specimen, bench, k_max, specimen
from stepload.errors import BadInputError
from stepload.plan.problems import PlanError
from stepload.runner.pool import Pool

STVF = bench("stvf", None)
SPHERE, CONE = (
    next(path for path in shipped_payloads() if path.stem == name)
    for name in ("plastic-sphere", "plastic-cone")
)


def test_a_share_has_the_interval_of_clopper_and_pearson() -> None:
    assert share(45, 50).low == pytest.approx(0.7819, abs=1e-4)
    assert share(45, 50).high == pytest.approx(0.9667, abs=1e-4)
    assert (share(0, 10).low, share(10, 10).high) == (0.0, 1.0)
    assert (share(0, 0).low, share(0, 0).high) == (0.0, 1.0)
    assert math.isnan(share(0, 0).value)


@pytest.mark.parametrize(
    ("count", "of", "expected"),
    [
        (30, 30, Can.UNSURE),  # all of a few is no proof
        (250, 250, Can.YES),
        (232, 250, Can.UNSURE),  # 92.8 %, but the bound is below 90 %
        (180, 250, Can.NO),
        (17, 20, Can.UNSURE),  # 85 %, but so few that it may be 90 %
        (0, 0, Can.UNSURE),
    ],
)
def test_yes_needs_the_lower_bound(count: int, of: int, expected: Can) -> None:
    assert can(share(count, of)) is expected
    assert (can(share(count, of)) is Can.YES) == (of > 0 and share(count, of).low >= REQUIRED)


def rows(told: dict[tuple[str, str], list[int]], specimens: list[Specimen]) -> Map:
    """A map whose cells have these counts of 250 by (series, change), column by column."""
    secants = [1e6, 3e6, 1e7, 3e7]
    made = []
    for point in points(STVF, specimens, secants):
        key = (point.series, point.change)
        if key in told:
            count = told[key][point.index % 4 if point.series != "payloads" else 0]
            each, all_of_them = share(count, 250), share(250, 250)
            limit = k_max(point.cell.conditions, point.cell.payload.at_n)
            made.append(Row(point, limit, all_of_them, each, each, all_of_them, 0.1, ""))
    return Map(STVF, specimens, made, 1, 250)


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ([250, 250, 250, 0], "too careful, by 1.38"),
        ([250, 0, 0, 0], "too bold, by 2.41"),
        ([250, 250, 0, 0], "right"),
        ([0, 0, 0, 0], "nothing is measured"),
        ([232, 0, 0, 0], "not tested"),
        ([250, 232, 0, 0], "right"),
    ],
)
def test_the_guideline_is_held_against_what_is_measured(counts: list[int], said: str) -> None:
    [found] = reaches(rows({("buy", "as it is"): counts}, []))
    assert said in found.guideline


def test_a_reach_ends_at_the_first_gap_below_it() -> None:
    [found] = reaches(rows({("buy", "as it is"): [250, 0, 250, 0]}, []))
    assert (found.from_n_per_m, found.to_n_per_m, found.beyond_n_per_m) == (1e7, 1e7, 3e7)


def test_a_map_that_ends_too_early_does_not_call_the_guideline_right() -> None:
    [found] = reaches(rows({("buy", "as it is"): [250, 250, 250, 250]}, []))
    assert "not tested" in replace(found, k_max_n_per_m=1e9).guideline


def test_payloads_are_answered_in_words_with_the_change_that_gains_most() -> None:
    bodies = [specimen("stvf", SPHERE, 300.0), specimen("stvf", CONE, 300.0)]
    gauge = "gauge of 1 µm"
    found = rows(
        {("payloads", "as it is"): [0], ("payloads", gauge): [250], ("buy", "as it is"): [0] * 4,
         ("buy", gauge): [250] * 4}, bodies
    )  # fmt: skip
    sphere, cone = payload_answers(found)
    assert sphere.can is Can.NO
    assert f"To buy: {gauge}" in sphere.text
    assert (cone.can, cone.row) == (Can.NO, None)
    assert "must not be pressed here: its elastic limit is 9.61 N" in cone.text
    assert any("reaches farthest" in each for each in sentences(found))
    better = rows({("payloads", "as it is"): [250], ("payloads", gauge): [250],
                   ("buy", "as it is"): [250] * 4}, bodies)  # fmt: skip
    assert "yes" in payload_answers(better)[0].text
    assert "To buy" not in payload_answers(better)[0].text


def test_no_single_change_is_sold_as_a_way_out_that_it_is_not() -> None:
    body = specimen("stvf", SPHERE, 300.0)
    found = rows({("payloads", "as it is"): [0], ("payloads", "gauge of 1 µm"): [100]}, [body])
    assert "No single change will do" in payload_answers(found)[0].text


def test_a_payload_is_pressed_no_harder_than_is_safe() -> None:
    aluminium = next(path for path in shipped_payloads() if path.stem == "aluminium-sphere")
    found = specimen("stvf", aluminium, 300.0)
    assert found.conditions is not None
    assert found.top_n == pytest.approx(150.4, abs=0.1)
    assert "176 N" in found.why
    assert found.conditions.elastic_limit_n is not None
    assert found.top_n < found.conditions.elastic_limit_n


def test_changes_change_what_they_say() -> None:
    told = STVF.conditions
    stiffness = told.sources.system_stiffness_n_per_m
    assert stiffness is not None
    assert for_sale(told)["as it is"](told) is told
    assert finer(told, 4.0).sources.position_resolution_m == pytest.approx(0.5e-6)
    assert finer(told, 4.0).position_resolution_m == pytest.approx(0.5e-6)
    assert finer(told, 4.0).sources.position_noise_m == pytest.approx(0.05e-6)
    across = gauged(told, 1e-6)
    assert across.sources.system_stiffness_n_per_m is None
    assert across.sources.deflection() is None
    twice = stiffer(told, 2.0)
    assert twice.sources.system_stiffness_n_per_m == 2.0 * stiffness
    assert relative_sigma(twice) == pytest.approx(relative_sigma(told))
    assert twice.sources.deflection_m[0] == pytest.approx(told.sources.deflection_m[0] / 2.0)
    assert relative_sigma(known(told, 0.1)) == pytest.approx(0.1)
    assert known(told, 0.1).sources.deflection() is None
    ur = bench("ur10e", None).conditions
    table = known(ur, 0.01).sources.deflection()
    assert table is not None
    assert ur.sources.system_stiffness_n_per_m is not None
    assert table.deflection_m[-1] == pytest.approx(
        table.force_n[-1] / ur.sources.system_stiffness_n_per_m
    )
    assert list(for_sale(across)) == ["as it is", "position of 0.25 µm"]


def test_forces_that_the_table_does_not_cover_are_told_and_a_table_that_is_bought_covers_them() -> (
    None
):
    assert "ends at 300 N, the data reach 400 N" in bench("stvf", 400.0).note
    assert "ends at" not in STVF.note
    assert STVF.note.endswith("(a table of the pose)")
    small = bench("stvf", 60.0)
    assert small.conditions.sources.system_stiffness_note
    assert small.note.endswith(small.conditions.sources.system_stiffness_note)
    far = specimen("stvf", SPHERE, 400.0)
    assert "ends at 300 N, the data reach 400 N" in far.why
    assert far.conditions is not None
    assert known(far.conditions, 0.005).table_doubts(400.0) == []
    near = specimen("stvf", SPHERE, 300.0).conditions
    assert near is not None
    assert known(near, 0.005).sources.deflection_m == near.sources.deflection_m


def test_a_gauge_of_the_rig_leaves_only_what_can_still_be_changed(tmp_path: Path) -> None:
    rig = tmp_path / "mine.yaml"
    rig.write_text(
        "profile: stvf\ndisplacement: {driver: sim, rate: 100 Hz, resolution: 1 um}\n"
    )  # fmt: skip
    found = bench(str(rig), 200.0)
    assert found.conditions.sources.system_stiffness_n_per_m is None
    assert {each.series for each in points(found, [], [1e6])} == {
        "exponent", "position resolution", "buy",
    }  # fmt: skip
    assert "gauge" in found.note


def test_a_rig_that_cannot_push_as_hard_as_the_papers_is_mapped_at_what_it_can() -> None:
    assert STVF.top_n == 300.0
    assert bench("ur3e", None).top_n == pytest.approx(84.0)


@pytest.mark.parametrize(
    ("rig", "top_n", "said"),
    [
        ("stfv", None, "no rig profile is named 'stfv'"),
        ("nowhere/rig.yaml", None, "there is no such rig file"),
        ("stvf", 2000.0, "can press with 1000 N at most"),
        ("stvf", -1.0, "can press with"),
    ],
)
def test_bad_rigs_and_forces_are_told(rig: str, top_n: float | None, said: str) -> None:
    with pytest.raises(BadInputError, match=said) as found:
        bench(rig, top_n)
    assert "map.yaml" not in str(found.value), "a file that nobody has written"


def test_a_bad_rig_file_is_told_with_its_place(tmp_path: Path) -> None:
    rig = tmp_path / "mine.yaml"
    rig.write_text("profile: stvf\nsystem_stiffness: {value: 3 N}\n")
    with pytest.raises(PlanError, match=r"mine\.yaml:2:"):
        bench(str(rig), None)


def test_a_cell_is_the_same_in_whatever_order_and_compared_on_the_same_draws(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cells, "PANELS", ("exponent",))
    jobs = [p for p in points(STVF, [], [5e6]) if p.cell.payload.exponent
            == 1.5][:2]  # fmt: skip
    work = Work(seed=5, samples=12)
    pool = Pool(1)
    forth, back = run_all(work, jobs, pool), run_all(work, jobs[::-1], pool)[::-1]
    assert forth == back
    panel, bought = forth
    assert (panel.point.series, bought.point.change) == ("exponent", "as it is")
    assert (panel.measured, panel.half_width) == (bought.measured, bought.half_width)
    other = run_all(Work(seed=6, samples=12), jobs[:1], pool)[0]
    assert other.half_width != panel.half_width


def test_a_payload_that_bears_no_stiffness_is_a_row_with_its_problem(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from stepload.design import work as room
    from stepload.errors import DomainError

    def none(*_: object) -> None:
        raise DomainError("nothing to fit")

    monkeypatch.setattr(room, "reference", none)
    job = points(STVF, [], [5e6])[0]
    row = Work(1, 10).run(job)
    assert row.problem == "nothing to fit"
    assert can(row.measured) is Can.NO


def test_a_payload_of_the_users_stands_for_the_shipped_one_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cells, "PANELS", ())
    monkeypatch.setattr(cells, "COLUMNS", 1)
    own = tmp_path / "own.yaml"
    own.write_text(SPHERE.read_text().replace("28.7 mm", "20 mm"))
    found = make("stvf", [own], shipped=[SPHERE, CONE], samples=1, seed=1, pool=Pool(1))
    assert [each.path for each in found.specimens] == [own, CONE]
    with pytest.raises(BadInputError, match="two payloads are named 'plastic sphere'"):
        make("stvf", [own, SPHERE], samples=1, seed=1, pool=Pool(1))


def test_the_columns_of_payloads_are_explained_with_their_limits() -> None:
    body = specimen("stvf", SPHERE, 300.0)
    found = payload_table(rows({("payloads", "as it is"): [250]}, [body]))
    assert {"within ±20%", "can be measured"} <= set(found.columns)
    [note] = found.notes
    assert "250 simulated runs" in note
    assert "90%" in note
