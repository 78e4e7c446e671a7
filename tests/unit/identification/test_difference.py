"""Differences of groups of runs: what cancels, what averages, what repeats say, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.stats

from stepload.errors import DomainError
from stepload.identification.difference import (
    REPEATABILITY,
    Agreement,
    Difference,
    DifferenceLine,
    Measured,
    Scatter,
    difference,
    scatter_of,
    within,
)
from stepload.identification.origin import (
    ACROSS_ALIKE,
    OF_CALIBRATION,
    OPEN,
    OWN,
    REPEATS,
    SAME,
    Origin,
    common,
)
from stepload.identification.quantity import Line, Quantity, ResultVerdict

KS, GAIN, SMOOTH, NOISE = (
    "system stiffness K_s", "force calibration", "smooth deformation error",
    "position noise and quantum",
)  # fmt: skip
HERE = Origin(
    rig="STVF", arm="axis 7", force_sensor="cell 3, none", axis="+fz", pose="bench",
    calibration="sha256 1", stiffness_n_per_m=(3.49e6, 3.49e4), surface_m=5e-3, reach_m=24e-6,
)  # fmt: skip
Z, POWER = 1.959964, 0.841621


def run(value: float = 5e6, origin: Origin = HERE, **lines: float) -> Measured:
    names = {"ks": KS, "gain": GAIN, "smooth": SMOOTH, "noise": NOISE}
    return with_lines(value, origin, {names[key]: sigma for key, sigma in lines.items()})


def with_lines(value: float, origin: Origin, lines: Mapping[str, float], **how: Any) -> Measured:
    of = [Line(source, "", sigma) for source, sigma in lines.items()]
    figure = Quantity(
        "chord", value, (0.0, math.inf), 0.0, 300.0, tuple(of), ResultVerdict.IDENTIFIED, ()
    )
    return Measured("run", replace(figure, **how), origin)


def line(found: Difference, source: str) -> DifferenceLine:
    return next(each for each in found.lines if each.source == source)


def test_what_both_feel_alike_cancels_and_the_rest_stays() -> None:
    first, second = run(ks=0.013, gain=0.005, noise=0.01), run(ks=0.015, gain=0.005, noise=0.02)
    found = difference([first], [second], tolerance=0.2)
    ks, gain, noise = (line(found, source) for source in (KS, GAIN, NOISE))
    assert ks.left == pytest.approx(0.002)
    assert (ks.first, ks.second, ks.common) == (0.013, 0.015, "by all")
    assert gain.left == 0.0
    assert noise.common == "no"
    assert noise.left == pytest.approx(math.hypot(0.01, 0.02))
    sigma = math.hypot(0.002, 0.01, 0.02)
    assert found.half_width == pytest.approx(Z * sigma)
    assert found.smallest_detectable == pytest.approx(math.expm1((Z + POWER) * sigma))
    assert found.interval == pytest.approx((math.expm1(-Z * sigma), math.expm1(Z * sigma)))


def test_own_errors_average_and_those_of_a_group_do_not() -> None:
    there = replace(HERE, rig="other", arm="axis 8", calibration="sha256 2")
    first = [run(ks=0.01, noise=0.01) for _ in range(4)]
    second = [run(origin=there, ks=0.01, noise=0.01) for _ in range(2)]
    found = difference(first, second, tolerance=0.2)
    assert line(found, NOISE).left == pytest.approx(0.01 * math.sqrt(1 / 4 + 1 / 2))
    ks = line(found, KS)
    assert (ks.left, ks.common) == (pytest.approx(0.01 * math.sqrt(2)), "within a group only")


def test_what_is_not_shared_does_not_cancel() -> None:
    for change, source in (
        ({"rig": "another"}, KS),
        ({"arm": "axis 8"}, KS),
        ({"pose": "elbow up"}, KS),
        ({"axis": "-fz"}, KS),
        ({"calibration": "sha256 2"}, KS),
        ({"stiffness_n_per_m": (3.5e6, 3.49e4)}, KS),
        ({"force_sensor": "cell 4, none"}, GAIN),
        ({"axis": "-fz"}, GAIN),
        ({"arm": "axis 8"}, SMOOTH),
        ({"pose": "elbow up"}, SMOOTH),
        ({"kinematics": "seed 2"}, SMOOTH),
    ):
        assert common(source, HERE, replace(HERE, **change)) == OWN, change
        other = run(origin=replace(HERE, **change), ks=0.01, gain=0.01, smooth=0.01)
        found = difference([run(ks=0.01, gain=0.01, smooth=0.01)], [other], tolerance=0.2)
        assert line(found, source).left == pytest.approx(0.01 * math.sqrt(2)), change
    assert common(KS, HERE, HERE) == common(GAIN, HERE, HERE) == SAME
    assert common(NOISE, HERE, HERE) == OWN
    gauge = replace(HERE, stiffness_n_per_m=None)
    assert common(KS, gauge, gauge) == OWN, "there is no K_s in the chain"


def test_the_smooth_error_belongs_to_its_place() -> None:
    def away(metres: float) -> float:
        least, most = common(SMOOTH, HERE, replace(HERE, surface_m=5e-3 + metres))
        assert least == most
        return least

    assert away(0.0) == REPEATS
    assert away(24e-6) == pytest.approx(REPEATS * math.exp(-0.5))
    assert away(-24e-6) == pytest.approx(away(24e-6))
    assert away(1e-3) < 1e-6
    stiffer = difference([run(5e6, smooth=0.02)], [run(6e6, smooth=0.02)], tolerance=0.2)
    alike = difference([run(5e6, smooth=0.02)], [run(5e6, smooth=0.02)], tolerance=0.2)
    assert line(alike, SMOOTH).left == pytest.approx(0.02 * math.sqrt(2 * (1 - REPEATS)))
    moved = 0.5 * (300.0 / 5e6 - 300.0 / 6e6)
    same = REPEATS * math.exp(-0.5 * (moved / 24e-6) ** 2)
    assert line(stiffer, SMOOTH).left == pytest.approx(0.02 * math.sqrt(2 * (1 - same)))


def test_what_the_records_do_not_tell_stays_open() -> None:
    for change, source, expected in (
        ({"arm": ""}, KS, OPEN),
        ({"rig": ""}, KS, OPEN),
        ({"calibration": ""}, KS, SAME),
        ({"force_sensor": ""}, GAIN, OPEN),
        ({"pose": ""}, KS, SAME),
        ({"pose": ""}, SMOOTH, (0.0, REPEATS)),
        ({"surface_m": None}, SMOOTH, (0.0, REPEATS)),
        ({"reach_m": None}, SMOOTH, (0.0, REPEATS)),
        ({"arm": ""}, SMOOTH, (0.0, REPEATS)),
    ):
        here = replace(HERE, **change)
        assert common(source, here, here) == expected, change
    unnamed = replace(HERE, arm="")
    assert common(KS, unnamed, replace(HERE, arm="", rig="another")) == OWN
    assert common(KS, HERE, replace(HERE, arm="", calibration="sha256 2")) == OWN


FRICTION, ASKEW, TURNS = (
    "lateral force", "misalignment of sensor and plate",
    "gauge off the axis of an arm that turns",
)  # fmt: skip


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        ((), (), (OF_CALIBRATION, 1.0)),
        ((0.1, 0.0), (0.3, 0.0), (ACROSS_ALIKE, ACROSS_ALIKE)),
        ((0.1, 0.0), (-0.3, 0.0), (-ACROSS_ALIKE, -ACROSS_ALIKE)),
        ((0.1, 0.0), (0.0, 0.1), (0.0, 0.0)),
        ((0.1, 0.0), (), OPEN),
        ((0.1, 0.0), (0.0, 0.0), OPEN),
        ((0.1, 0.0), (0.1, 0.0, 0.0), OPEN),
    ],
)
def test_what_friction_leaves_is_shared_as_far_as_it_points_the_same_way(
    one: tuple[float, ...], other: tuple[float, ...], alike: tuple[float, float]
) -> None:
    here, there = replace(HERE, across=one), replace(HERE, across=other)
    assert common(FRICTION, here, there) == pytest.approx(alike)
    for change in ({"arm": "axis 8"}, {"pose": "wall"}, {"calibration": "sha256 2"}):
        assert common(FRICTION, here, replace(there, **change)) == OWN
    no_name = common(FRICTION, replace(here, pose=""), replace(there, pose=""))
    assert no_name.least <= 0.0 <= no_name.most


def test_repeats_of_unknown_friction_do_not_average() -> None:
    def group() -> list[Measured]:
        return [with_lines(5e6, HERE, {FRICTION: 0.26}) for _ in range(3)]

    found = difference(group(), group(), tolerance=0.2)
    assert line(found, FRICTION).left == pytest.approx(0.26)
    assert found.open_sources == (FRICTION,)


def test_a_rig_is_as_askew_in_all_its_runs_and_a_payload_put_in_anew_is_not() -> None:
    assert common(ASKEW, HERE, HERE) == OPEN
    assert common(TURNS, HERE, HERE) == SAME
    for source in (ASKEW, TURNS):
        assert common(source, HERE, replace(HERE, arm="axis 8")) == OWN


def test_both_ways_must_come_to_the_same_verdict() -> None:
    here = replace(HERE, pose="")

    def found(ratio: float, **how: float) -> Difference:
        groups = [[run(5e6 * r, here, smooth=0.02, **how) for _ in "123"] for r in (1.0, ratio)]
        return difference(*groups, tolerance=0.2)

    near = found(1.05, noise=0.005)
    assert near.verdict is Agreement.CANNOT_TELL
    assert near.open_sources == (SMOOTH,)
    assert "do not tell whether the runs share smooth deformation error" in near.why
    worst = math.hypot(line(near, SMOOTH).left, line(near, NOISE).left)
    assert near.half_width == pytest.approx(Z * worst)
    grouped = 0.02 * math.sqrt(2 * (REPEATS + (1 - REPEATS) / 3))
    assert line(near, SMOOTH).left == pytest.approx(grouped), "shared within a group alone"
    assert found(1.08, noise=0.005).verdict is Agreement.DIFFER
    assert found(1.005, noise=0.005).verdict is Agreement.AGREE


def test_a_verdict_needs_the_accuracy_that_was_asked_for() -> None:
    sigma = 0.01
    u = sigma * math.sqrt(2)

    def said(change: float, tolerance: float) -> Agreement:
        runs = [run(5e6, noise=sigma)], [run(5e6 * math.exp(change), noise=sigma)]
        return difference(*runs, tolerance=tolerance).verdict

    assert said(0.0, 0.05) is Agreement.AGREE
    assert said(0.0, math.expm1((Z + POWER) * u) * 0.999) is Agreement.CANNOT_TELL
    assert said(1.01 * Z * u, 0.2) is said(-1.01 * Z * u, 0.2) is Agreement.DIFFER
    assert said(0.99 * Z * u, 0.2) is Agreement.AGREE
    assert said(0.99 * Z * u, 0.05) is Agreement.CANNOT_TELL, "the interval reaches beyond 5 %"
    assert said(1.01 * Z * u, 1e-3) is Agreement.DIFFER, "a difference is one at any tolerance"


def repeats(*ln: float, noise: float = 0.001, smooth: float = 0.0, **how: str) -> list[Measured]:
    origins = [replace(HERE, **{key: f"{value} {i}" for key, value in how.items()})
               for i in range(len(ln))]  # fmt: skip
    return [run(5e6 * math.exp(x), o, noise=noise, smooth=smooth)
            for x, o in zip(ln, origins, strict=True)]  # fmt: skip


def test_scatter_beyond_the_budget_takes_its_place_with_student() -> None:
    ln = (-0.02, 0.0, 0.02)
    found = difference(repeats(*ln), repeats(*ln), tolerance=0.2)
    assert (found.scatter, found.scatter_degrees) == (pytest.approx(0.02), 4)
    assert found.scatter_expected == pytest.approx(0.001)
    t = float(scipy.stats.t.isf(0.025, 4))
    assert found.half_width == pytest.approx(t * 0.02 * math.sqrt(2 / 3), rel=1e-3)
    assert line(found, REPEATABILITY).common == "no; widened for 4 degrees of freedom"
    alike = repeats(-0.0002, 0.0, 0.0002, noise=0.001)
    quiet = difference(alike, alike, tolerance=0.2)
    assert all(each.source != REPEATABILITY for each in quiet.lines)
    assert quiet.half_width == pytest.approx(Z * 0.001 * math.sqrt(2 / 3))


def test_a_smooth_error_of_each_run_is_as_large_as_it_scatters() -> None:
    """Stated 2 %, seen 0.2 % by six runs of six rigs; shared ones never show in a scatter."""
    ln = (-0.002, 0.0, 0.002)
    seeds = repeats(*ln, smooth=0.02, kinematics="seed")
    found = difference(seeds, seeds, tolerance=0.2)
    # the runs of both groups have pairwise the same seeds here: part them
    other = [r._replace(origin=replace(r.origin, kinematics=f"x{i}")) for i, r in enumerate(seeds)]
    parted = difference(seeds, other, tolerance=0.2)
    t = float(scipy.stats.t.isf(0.025, 4)) / Z
    assert line(parted, SMOOTH).left == pytest.approx(t * 0.002 * math.sqrt(2 / 3), rel=1e-4)
    assert "scatter" in line(parted, SMOOTH).common
    assert "scatter" not in line(found, SMOOTH).common
    there = [r._replace(origin=replace(HERE, surface_m=6e-3)) for r in repeats(*ln, smooth=0.02)]
    grouped = difference(repeats(*ln, smooth=0.02), there, tolerance=0.2)
    assert line(grouped, SMOOTH).left > 0.02, "within a group it repeats and does not scatter"


def test_scatter_is_that_within_groups() -> None:
    rng = np.random.default_rng(3)
    value, group = rng.standard_normal(7), np.array([0, 0, 0, 1, 1, 1, 1])
    parts = [value[group == g] for g in (0, 1)]
    expected = math.sqrt(sum(float(np.sum((p - p.mean()) ** 2)) for p in parts) / 5)
    assert scatter_of(value, group) == (pytest.approx(expected), 5)
    assert scatter_of(value[2:4], group[2:4]) is None
    assert within(group) @ value == pytest.approx(np.concatenate([p - p.mean() for p in parts]))
    assert Scatter(0.0, 4).beyond(0.0, 0.975) == 0.0
    assert Scatter(0.01, 1).beyond(0.0, 0.975) > 0.0
    assert Scatter(0.01, 1).instead_of(1.0, 0.975) is None


def test_only_like_is_compared_with_like() -> None:
    one = run(noise=0.01)
    for other, said in (
        (with_lines(5e6, HERE, {NOISE: 0.01}, to_n=200.0), "different definition"),
        (with_lines(5e6, HERE, {NOISE: 0.01}, from_n=30.0), "different definition"),
        (with_lines(5e6, HERE, {NOISE: 0.01}, kind="tangent"), "different definition"),
        (with_lines(math.nan, HERE, {NOISE: 0.01}), "no number"),
        (with_lines(5e6, HERE, {}), "without a budget"),
        (with_lines(5e6, HERE, {NOISE: -0.01}), "must be 0 or more"),
        (with_lines(5e6, HERE, {NOISE: math.inf}), "must be 0 or more"),
    ):
        with pytest.raises(DomainError, match=said):
            difference([one], [other], tolerance=0.2)
    for tolerance in (0.0, -0.1, math.nan):
        with pytest.raises(DomainError, match="tolerance"):
            difference([one], [one], tolerance=tolerance)
    with pytest.raises(DomainError, match="group without a run"):
        difference([one], [], tolerance=0.2)
