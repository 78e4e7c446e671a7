"""Statistics of a batch against published examples, with their numbers."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.report.batch_statistics import (
    capability,
    chart,
    esd_limit,
    gauge,
    outliers,
    student,
    trend,
)


def _numbers(text: str) -> np.ndarray:
    return np.array([float(each) for each in text.split()])


AIAG = _numbers("""
0.29 -0.56 1.34 0.47 -0.80 0.02 0.59 -0.31 2.26 -1.36
0.41 -0.68 1.17 0.50 -0.92 -0.11 0.75 -0.20 1.99 -1.25
0.64 -0.58 1.27 0.64 -0.84 -0.21 0.66 -0.17 2.01 -1.31
0.08 -0.47 1.19 0.01 -0.56 -0.20 0.47 -0.63 1.80 -1.68
0.25 -1.22 0.94 1.03 -1.20 0.22 0.55 0.08 2.12 -1.62
0.07 -0.68 1.34 0.20 -1.28 0.06 0.83 -0.34 2.19 -1.50
0.04 -1.38 0.88 0.14 -1.46 -0.29 0.02 -0.46 1.77 -1.49
-0.11 -1.13 1.09 0.20 -1.07 -0.67 0.01 -0.56 1.45 -1.77
-0.15 -0.96 0.67 0.11 -1.45 -0.49 0.21 -0.49 1.87 -2.16
""")
"""AIAG MSA, 4th edition: 3 appraisers × 3 trials (rows), 10 parts."""
FLOW = np.array([49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1])
"""NIST/SEMATECH e-Handbook 6.3.2.2: ten batches, flow rate."""
ROSNER = _numbers("""
-0.25 0.68 0.94 1.15 1.20 1.26 1.26 1.34 1.38 1.43 1.49 1.49 1.55 1.56 1.58 1.65 1.69 1.70 1.76
1.77 1.81 1.91 1.94 1.96 1.99 2.06 2.09 2.10 2.14 2.15 2.23 2.24 2.26 2.35 2.37 2.40 2.47 2.54
2.62 2.64 2.90 2.92 2.92 2.93 3.21 3.26 3.30 3.59 3.68 4.30 4.64 5.34 5.42 6.01
""")
"""NIST/SEMATECH e-Handbook 1.3.5.17: Rosner's 54 values."""


def _study() -> np.ndarray:
    return AIAG.reshape(3, 3, 10).transpose(2, 0, 1)


def test_gauge_rr_of_the_aiag_manual() -> None:
    found = gauge(_study(), tolerance=8.0)
    assert found.interaction_p == pytest.approx(0.974, abs=5e-4)
    assert found.pooled
    assert [each.name for each in found.lines] == ["EV", "AV", "INT", "GRR", "PV", "TV"]
    assert [each.sigma_n_per_m for each in found.lines] == pytest.approx(
        [0.199933, 0.226838, 0.0, 0.302373, 1.042327, 1.085300], abs=5e-6
    )
    assert [100.0 * each.of_study for each in found.lines] == pytest.approx(
        [18.42, 20.90, 0.0, 27.86, 96.04, 100.0], abs=5e-3
    )
    assert found.lines[3].of_tolerance == pytest.approx(6.0 * 0.302373 / 8.0, abs=5e-6)
    assert found.ndc == 4


def test_an_interaction_is_kept_apart() -> None:
    study = _study()
    study[:5, 0] += 1.0
    found = gauge(study)
    assert not found.pooled
    ev, _, both = (each.sigma_n_per_m for each in found.lines[:3])
    assert ev**2 == pytest.approx(2.7589 / 60, abs=1e-6)
    cells = study.mean(axis=2)
    crossed = cells - cells.mean(axis=1)[:, None] - cells.mean(axis=0) + study.mean()
    assert both == pytest.approx(np.sqrt((3.0 * (crossed**2).sum() / 18.0 - ev**2) / 3.0))


def test_one_operator_has_no_reproducibility() -> None:
    found = gauge(_study()[:, :1])
    assert [each.name for each in found.lines] == ["EV", "GRR", "PV", "TV"]
    assert found.lines[0].sigma_n_per_m == found.lines[1].sigma_n_per_m
    assert found.pooled
    assert found.interaction_p is None


def test_individuals_chart_of_the_nist_handbook() -> None:
    found = chart(FLOW)
    assert found.centre_n_per_m == pytest.approx(50.81)
    assert found.mean_range_n_per_m == pytest.approx(1.8778, abs=5e-5)
    assert found.limits_n_per_m == pytest.approx((45.8159, 55.8041), abs=5e-5)
    assert not any(found.broken)


@pytest.mark.parametrize(
    ("tail", "rules"),
    [
        ([3.0, 3.1], {"WE1", "WE2"}),
        ([2.5, 0.2, 2.5], {"WE2"}),
        ([1.5, 1.5, 0.2, 1.5, 1.5], {"WE3"}),
        ([0.3] * 8, {"WE4"}),
        ([0.3] * 7, set()),
    ],
)
def test_rules_of_the_chart(tail: list[float], rules: set[str]) -> None:
    """In units of σ, behind 200 values that alternate with the moving range of σ = 1."""
    quiet = np.tile([0.564, -0.564], 100)
    found = chart(np.array([*quiet, *tail]))
    assert not any(found.broken[:200])
    assert set(found.broken[-1]) == rules


def test_outliers_of_rosner() -> None:
    assert [esd_limit(54, i) for i in (1, 2, 3, 10)] == pytest.approx(
        [3.158, 3.151, 3.143, 3.085], abs=1e-3
    )
    assert [ROSNER[at] for at in outliers(ROSNER, most=10)] == [6.01, 5.42, 5.34]
    assert outliers(ROSNER[:-4], most=10) == []


def test_capability_of_the_nist_handbook() -> None:
    """Limits 8 and 20, mean 16, σ 2: Cp 1.0, Cpk 0.6667."""
    values = 16.0 + 2.0 * np.array([-1.0, 0.0, 1.0])
    found = capability(values, 8.0, 20.0, 2.0)
    assert (found.cp, found.cpk, found.pp, found.ppk) == pytest.approx((1.0, 2 / 3, 1.0, 2 / 3))
    one_sided = capability(values, None, 20.0, 2.0)
    assert one_sided.cp is None
    assert one_sided.cpk == pytest.approx(2 / 3)


def test_trend() -> None:
    line = trend(FLOW)
    assert line.slope_n_per_m == pytest.approx(np.polyfit(np.arange(10), FLOW, 1)[0])
    assert line.rank_p < 0.05
    assert line.slope_interval_n_per_m[0] > 0.0
    assert student(9) == pytest.approx(2.262, abs=5e-4)
    level = trend(np.tile([1.0, 2.0, 0.0], 5))
    assert level.rank_p > 0.5
