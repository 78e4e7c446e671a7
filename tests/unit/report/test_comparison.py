"""Comparisons of runs made by hand: which are repeats, what they share, at which force."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepload.errors import BadInputError
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.difference import Agreement
from stepload.identification.origin import Origin
from stepload.record.curves import Curve
from stepload.record.lag import Lag
from stepload.record.rows import Phase
from stepload.report import comparison
from stepload.report.comparison import compare
from stepload.report.comparison_curve import CurveGiven, _deformation_at
from stepload.report.comparison_document import comparison_data, comparison_document
from stepload.report.comparison_runs import ComparedRun, origin_of
from stepload.report.comparison_table import power_of_ten, sides, table_two, table_two_csv
from stepload.report.page import render
from stepload.report.press_data import PressData, TouchPoint
from stepload.report.run_record import SavedRun
from stepload.report.terminal import BESIDE, NARROW

K, N, KS = 6.57e8, 1.5, 3.49e6
SENSOR = "cell: S2 {}, firmware 1.0, calibration 2026-01"
CONDITIONS = Conditions(
    sources=Sources(
        KS,
        3.49e4,
        0.5e-6,
        smooth_length_n=50.0,
        force_noise_n=0.5,
        position_resolution_m=1e-6,
        gain_sigma=0.005,
    ),
    secant_force_n=300.0,
    touch_force_n=3.0,
    position_resolution_m=1e-6,
    pose="bench",
)


@pytest.fixture(autouse=True)
def _identified_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same run at the same force is identified once in this file."""
    monkeypatch.setattr(comparison, "compared_run", _identified)


_plain = comparison.compared_run
_known: dict[tuple[int, float], tuple[ComparedRun, SavedRun]] = {}


def _identified(run: SavedRun, secant_force_n: float) -> ComparedRun:
    key = id(run.data), secant_force_n
    if key not in _known or _known[key][1].conditions is not run.conditions:
        _known[key] = _plain(run, secant_force_n), run
    return replace(_known[key][0], run=run)


@cache
def saved(
    run_id: str,
    *,
    draw: int = 1,
    k: float = K,
    top_n: float = 300.0,
    surface_m: float = 5e-3,
    conditions: Conditions = CONDITIONS,
    gauge: bool = False,
    **metadata: str,
) -> SavedRun:
    rng = np.random.default_rng(draw)
    force = np.linspace(0.0, top_n, 400)
    travel = (force / k) ** (1 / N) + force / KS
    touch = TouchPoint(
        time_s=0.0, position_m=surface_m, force_n=3.0, cycle=1, purpose="first", travel_m=0.0
    )
    data = PressData(
        time_s=np.linspace(0.0, 30.0, 400),
        force_n=force + 0.5 * rng.standard_normal(400),
        travel_m=np.round(travel / 1e-6) * 1e-6,
        phase=np.full(400, int(Phase.LOAD)),
        cycle=np.ones(400, int),
        touches=(
            touch,
            touch.model_copy(update={"time_s": 99.0, "position_m": 1.0, "purpose": "last"}),
        ),
        noise_n=0.5,
        zero_shift_n=0.0,
        lag=Lag(0.0, 1e-4, "made"),
        lag_corrected_s=0.0,
        clocks=(),
        gauge=gauge,
    )
    told = {
        "run_id": run_id, "plan": "sphere", "payload": "sphere", "rig": "STVF", "dry_run": "false",
        "force_axis": "+fz", "arm": "axis: A 7, firmware 2, calibration none",
        "force_sensor": SENSOR.format(3), "calibration": "sha256 1",
    } | metadata  # fmt: skip
    return SavedRun(Path(f"{run_id}.mcap"), data, conditions, told, partial=False)


def three(prefix: str, draw: int, **how: object) -> list[SavedRun]:
    return [saved(f"{prefix}{i}", draw=draw + i, **how) for i in range(3)]  # type: ignore[arg-type]


def test_the_origin_of_a_run_is_what_its_record_tells() -> None:
    found = origin_of(saved("a"))
    reach = found.reach_m
    assert reach == pytest.approx(50.0 * ((300 / K) ** (1 / N) + 300 / KS) / 300.0, rel=0.02)
    assert found == Origin(
        rig="STVF", arm="axis: A 7", force_sensor="cell: S2 3, 2026-01", axis="+fz", pose="bench",
        kinematics="", calibration="sha256 1", stiffness_n_per_m=(KS, 3.49e4), surface_m=5e-3,
        reach_m=reach,
    )  # fmt: skip
    dry = origin_of(saved("a", dry_run="true", seed="4"))
    assert (dry.rig, dry.kinematics) == ("STVF (simulated)", "seed 4")
    gauge = CONDITIONS.sources
    gauged = replace(CONDITIONS, sources=replace(gauge, system_stiffness_n_per_m=None))
    across = origin_of(saved("a", conditions=gauged, gauge=True))
    assert (across.stiffness_n_per_m, across.reach_m) == (None, None)


@pytest.mark.parametrize("text", ["", "cell: S2 unknown, firmware 1.0, calibration x", "cell: S2 "])
def test_a_device_without_a_number_is_not_known(text: str) -> None:
    assert origin_of(saved("a", arm=text, force_sensor=text)).arm == ""
    assert origin_of(saved("a", arm=text, force_sensor=text)).force_sensor == ""


@pytest.mark.long
def test_five_percent_are_told_apart_on_one_rig() -> None:
    found = compare([*three("a", 1), *three("b", 11, k=K * 1.05**N, plan="stiffer")])
    (each,) = found.differences
    assert found.groups == ((0, 1, 2), (3, 4, 5))
    assert each.verdict is Agreement.DIFFER
    assert each.interval[0] < 0.05 < each.interval[1]
    assert each.smallest_detectable < 0.05
    alike = compare([*three("a", 1), *three("b", 11, plan="again")])
    assert alike.differences[0].verdict is Agreement.AGREE
    assert comparison_data(alike)["verdict"] == comparison_data(alike)["agreement"] == "agree"
    said = comparison_data(found)
    assert (said["verdict"], said["agreement"]) == ("disagree", "differ")
    assert said["differences"][0]["smallest_detectable"] == each.smallest_detectable
    shown = comparison_document(found)
    assert len(shown.tables[2].rows) >= 5, "the lines of the difference"


@pytest.mark.parametrize(
    ("change", "source", "said"),
    [
        ({"rig": "another"}, "system stiffness K_s", "K_s is not taken as common"),
        ({"calibration": "sha256 2"}, "system stiffness K_s", "K_s is not taken as common"),
        (
            {"conditions": replace(CONDITIONS, pose="elbow")},
            "system stiffness K_s",
            "different rigs",
        ),
        ({"force_sensor": SENSOR.format(4)}, "force calibration", "different force sensors"),
        ({"surface_m": 6e-3}, "smooth deformation error", ""),
    ],
)
def test_errors_that_are_not_shared_do_not_cancel(
    change: dict[str, object], source: str, said: str
) -> None:
    def left(**how: object) -> tuple[float, tuple[str, ...]]:
        found = compare([saved("a"), saved("b", draw=2, **how)])  # type: ignore[arg-type]
        lines = found.differences[0].lines
        return next(each.left for each in lines if each.source == source), found.notes

    shared, _ = left()
    alone, notes = left(**change)
    assert alone > 0.003
    assert shared < 0.35 * alone
    assert any(said in note for note in notes)


def test_runs_are_grouped_by_plan_or_as_told() -> None:
    runs = [saved(name, draw=i) for i, name in enumerate("abc", 1)]
    alone = compare(runs)
    assert alone.groups == ((0,), (1,), (2,))
    assert len(alone.differences) == 2
    assert any("name repeats with `vs`" in note for note in alone.notes)
    told = compare(runs, sizes=[2, 1])
    assert any("budget alone" in note for note in told.notes)
    assert told.groups == ((0, 1), (2,))
    assert [each.first for each in told.differences] == [("a", "b")]
    for sizes in ([3, 0], [2, 2]):
        with pytest.raises(BadInputError, match="empty"):
            compare(runs, sizes=sizes)
    with pytest.raises(BadInputError, match="given twice"):
        compare([runs[0], runs[0]])
    for tolerance in (0.0, 1.5, float("nan")):
        with pytest.raises(BadInputError, match="tolerance"):
            compare(runs, tolerance=tolerance)


def test_secants_are_taken_where_all_runs_have_been() -> None:
    short = saved("b", draw=2, top_n=150.0)
    found = compare([saved("a"), short])
    assert found.secant_force_n == pytest.approx(150.0, abs=2.0)
    assert found.differences[0].to_n == pytest.approx(150.0, abs=3.0)
    assert any("instead of 300 N" in note for note in found.notes)
    beyond = compare([saved("a"), short], secant_force_n=300.0)
    assert beyond.differences[0].to_n == pytest.approx(150.0, abs=3.0)
    assert [each.reached(300.0) for each in beyond.runs] == [True, False]


def test_a_run_that_is_not_identifiable_shows_nothing() -> None:
    wide = replace(CONDITIONS, sources=replace(CONDITIONS.sources, smooth_error_m=5e-5))
    runs = [saved("a"), saved("b", draw=2, conditions=wide)]
    found = compare(runs)
    assert found.runs[1].found.verdict == "not identifiable"
    assert found.differences[0].verdict is Agreement.CANNOT_TELL
    assert found.differences[0].smallest_detectable > 1.0


def curve(factor: float, top_n: float = 300.0) -> Curve:
    force = np.linspace(5.0, top_n, 60)
    return Curve(None, None, (force / (K * factor)) ** (1 / N), force)


def test_a_curve_is_judged_by_what_the_run_can_tell() -> None:
    run = saved("a", conditions=replace(CONDITIONS, modulus_pa=2.91e9))
    # V-A: the curve was made against steel; corrected it ends at 293 N
    found = compare([run], given=[CurveGiven("FE", curve(1.0246), modulus_pa=2.91e9 * 1.0246)])
    (each,) = found.curve
    assert each.to_n == pytest.approx(300.0 / 1.0246)
    assert each.chord is not None
    assert each.secant is not None
    assert each.secant.relative == pytest.approx(0.0, abs=0.02)
    assert each.chord.relative == pytest.approx(0.0, abs=0.02)
    assert each.verdict is Agreement.AGREE
    data = comparison_data(found)
    assert data["verdict"] == "agree"
    assert data["curve"][0]["secant_force_n"] == each.to_n
    assert data["curve"][0]["smallest_detectable"] == each.chord.smallest_detectable
    strict = compare([run], given=[CurveGiven("FE", curve(1.0))], tolerance=0.01)
    assert strict.curve[0].verdict is Agreement.CANNOT_TELL
    softer = compare([run], given=[CurveGiven("FE", curve(0.6))])
    assert comparison_data(softer)["verdict"] == "differs"
    assert comparison_data(softer)["agreement"] == "differ"


def test_results_stand_side_by_side_as_in_table_one_and_the_curve_keeps_its_correction() -> None:
    told = replace(CONDITIONS, modulus_pa=2.91e9)
    runs = [saved("a", conditions=told, specimen="S 1"), saved("b", draw=2, conditions=told)]
    found = compare(runs, given=[CurveGiven("FE", curve(1.05), modulus_pa=2.91e9 * 1.05)])
    assert [each.correction for each in found.curve] == pytest.approx([1 / 1.05] * 2)
    for each in found.curve:
        top_n = each.to_n
        assert each.secant_n_per_m == pytest.approx(top_n / (top_n / K) ** (1 / N), rel=2e-3)
    document = comparison_document(found)
    one = next(each for each in document.tables if each.page_only)
    assert [row[:2] for row in one.rows] == [["1", "S 1"], ["2", "b"]]
    fit = found.runs[0].found.fits["rs_btls"]
    printed = [power_of_ten(fit.k), f"{fit.n:.2f}", power_of_ten(fit.secant_n_per_m)]
    assert one.rows[0][2:5] == printed
    assert any("0.9524" in note for each in document.tables for note in each.notes)
    two = next(each for each in document.tables if each.rows[0][2:5] == printed)
    assert [row[0] for row in two.rows] == ["S 1", "b", "FE"]
    assert document.certificate is not None
    assert document.certificate.figure is not None
    assert "</svg>" in document.certificate.figure.draw()
    assert [power_of_ten(x) for x in (4.8e6, 2e14)] == ["4.80e6", "2.00e14"]


def test_any_number_of_curves_is_listed_with_bounds_and_changes_relative_to_the_first() -> None:
    exact = CurveGiven("theory", curve(1.0))
    machine = CurveGiven("Instron", curve(0.9), resolution_m=1e-6, msde_m=1.31e-6)
    found = compare([saved("a"), saved("b", draw=2)], given=[exact, machine])
    assert [(each.curve, each.run) for each in found.curve] == [
        ("theory", "a"), ("theory", "b"), ("Instron", "a"), ("Instron", "b"),
    ]  # fmt: skip
    first, _, theory, instron = sides(found)
    assert (theory.fit.k, theory.fit.n) == (pytest.approx(K, rel=1e-3), pytest.approx(N, abs=1e-3))
    assert instron.secant_change == pytest.approx(
        instron.fit.secant_n_per_m / first.fit.secant_n_per_m - 1.0
    )
    assert first.secant_change is None
    # Figs. 8-13: δ ± (δ_Δ + √MSDE); exact curves have no bounds
    assert first.bound_m == pytest.approx(1e-6 + 0.5e-6)
    assert (theory.bounds_n_per_m, theory.interval_n_per_m) == (None, None)
    own_m = 300.0 / instron.fit.secant_n_per_m
    assert instron.bounds_n_per_m == pytest.approx(
        (300 / (own_m + 2.31e-6), 300 / (own_m - 2.31e-6))
    )
    half_m = 1.96 * np.hypot(1e-6 / np.sqrt(12), 1.31e-6)
    assert instron.interval_n_per_m[0] == pytest.approx(300 / (own_m + half_m), rel=1e-3)
    assert first.interval_n_per_m[0] < first.touch_secant_n_per_m < first.interval_n_per_m[1]
    lines = [line.split(",") for line in table_two_csv(found).splitlines()]
    assert [line[0] for line in lines] == ["name", "a", "b", "theory", "Instron"]
    assert float(lines[4][lines[0].index("k")]) == pytest.approx(instron.fit.k)
    for each in table_two(sides(found), found.secant_force_n):
        widths = [max(map(len, cells)) + BESIDE for cells in zip(*each.rows, strict=True)]
        assert sum(widths) <= NARROW
    data = comparison_data(found)
    assert [row["name"] for row in data["results"]] == [row["name"] for row in data["bounds"]]
    assert data["results"][3]["secant_change"] == instron.secant_change


def test_curves_that_differ_are_named_beside_runs_that_agree() -> None:
    found = compare(
        [saved("a"), saved("b", draw=2)],
        given=[CurveGiven("soft", curve(0.5)), CurveGiven("alike", curve(1.0))],
    )
    assert [each.verdict for each in found.curve] == [Agreement.DIFFER] * 2 + [Agreement.AGREE] * 2
    document = comparison_document(found)
    assert document.verdict.word == Agreement.AGREE
    assert "soft from a, soft from b" in document.reasons[0]


def test_an_inexact_curve_widens_its_difference() -> None:
    def half(msde_m: float) -> float:
        (each,) = compare(
            [saved("a")], given=[CurveGiven("machine", curve(1.0), msde_m=msde_m)]
        ).curve
        return each.chord.half_width

    span_m = (300 / K) ** (1 / N) - (30 / K) ** (1 / N)
    added = 1.96 * np.sqrt(2.0) * 2e-6 / span_m
    assert half(2e-6) == pytest.approx(np.hypot(half(0.0), added), rel=0.02)


def test_a_curve_has_not_the_name_of_a_run() -> None:
    with pytest.raises(BadInputError, match="called 'a'"):
        compare([saved("a")], given=[CurveGiven("a", curve(1.0))])


def test_several_curves_share_the_chance_of_a_false_alarm() -> None:
    (one,) = compare([saved("a")], given=[CurveGiven("A", curve(1.0))]).curve
    two = compare([saved("a")], given=[CurveGiven(name, curve(1.0)) for name in "AB"]).curve
    assert two[0].chord.half_width / one.chord.half_width == pytest.approx(
        2.2414 / 1.9600, rel=1e-3
    )


def test_curves_alone_are_listed_and_not_judged() -> None:
    found = compare([], given=[CurveGiven("A", curve(1.0)), CurveGiven("B", curve(1.1), 1.0)])
    assert (found.secant_force_n, found.curve) == (300.0, ())
    one, two = sides(found)
    assert two.fit.k / one.fit.k == pytest.approx(1.1, rel=1e-3)
    document = comparison_document(found)
    assert document.verdict.word == Agreement.CANNOT_TELL
    assert "B" in render(document)
    for curves in ([CurveGiven("A", curve(1.0))], [CurveGiven("A", curve(1.0))] * 2):
        with pytest.raises(BadInputError):
            compare([], given=curves)


def test_a_curve_is_read_at_a_force_through_its_noise() -> None:
    rng = np.random.default_rng(2)
    force = np.linspace(3.0, 300.0, 3000)
    noisy = (force / K) ** (1 / N) + 1e-6 * rng.standard_normal(3000)
    assert _deformation_at(300.0, noisy, force) == pytest.approx((300 / K) ** (1 / N), rel=5e-3)
    few = force[::600]
    assert _deformation_at(300.0, (few / K) ** (1 / N), few) == pytest.approx(
        (float(few[-1]) / K) ** (1 / N)
    )


def test_a_chord_needs_no_zero_and_a_curve_that_begins_too_high_has_none() -> None:
    def against(travel_m: float = 0.0, least_n: float = 0.0) -> Any:
        made = curve(1.0)
        keep = made.force_n > least_n
        assert made.displacement_m is not None
        moved = Curve(None, None, made.displacement_m[keep] + travel_m, made.force_n[keep])
        return compare([saved("a")], given=[CurveGiven("FE", moved)]).curve[0]

    shifted = against(travel_m=5e-6)
    assert shifted.chord.relative == pytest.approx(0.0, abs=0.02)
    assert shifted.secant.relative == pytest.approx(-0.078, abs=0.02)
    assert shifted.verdict is shifted.chord.verdict
    high = against(least_n=100.0)
    assert high.chord is None
    assert high.judged is high.secant
    with pytest.raises(BadInputError, match="1 points of the curve FE"):
        against(least_n=297.0)


def test_what_friction_does_to_an_arm_stands_between_its_run_and_a_curve() -> None:
    """A curve that a guided axis would call different is within what an arm of this K_s may do."""
    arm = replace(CONDITIONS, arm=True, modulus_pa=2.91e9)
    given = [CurveGiven("FE", curve(0.7), modulus_pa=2.91e9)]
    (guided,) = compare([saved("a", conditions=replace(arm, arm=False))], given=given).curve
    found = compare([saved("a", conditions=arm)], given=given)
    assert guided.verdict is Agreement.DIFFER
    assert found.curve[0].chord is not None
    assert guided.chord is not None
    assert found.curve[0].chord.half_width > 3.0 * guided.chord.half_width
    assert found.curve[0].verdict is Agreement.CANNOT_TELL
