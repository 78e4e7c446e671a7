"""RS-RTLS: batch-equal without forgetting, frozen at rest, flagged when wound up."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.identification.fit import Flag, FloatArray
from stepload.identification.ls import rs_btls
from stepload.identification.recursive import RsRtls

quick = settings(max_examples=20, deadline=None)
EVERY_SAMPLE = -1.0


def ramp(seed: int, size: int = 500) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    force_n = np.linspace(3.0, 300.0, size) + rng.normal(0.0, 0.3, size)
    deformation_m = (force_n / 6.57e8) ** (1 / 1.5) + rng.normal(0.0, 0.1e-6, size)
    return deformation_m, force_n


def steps(hold_s: float) -> tuple[FloatArray, FloatArray]:
    """100 Hz: six ramps of 50 N in 1 s, each held, with the noise of the 2 µm rig."""
    rng = np.random.default_rng(0)
    parts = []
    for level in range(0, 300, 50):
        parts.append(np.linspace(level + 0.5, level + 50.0, 100))
        parts.append(np.full(round(100 * hold_s), level + 50.0))
    true_n = np.concatenate(parts)
    force_n = true_n + rng.normal(0.0, 0.4, true_n.size)
    deformation_m = (true_n / 6.57e8) ** (1 / 1.5) + rng.normal(0.0, 0.6e-6, true_n.size)
    return deformation_m, force_n


def run(filter_: RsRtls, x: FloatArray, y: FloatArray) -> RsRtls:
    for deformation_m, force_n in zip(x.tolist(), y.tolist(), strict=True):
        filter_.update(deformation_m, force_n)
    return filter_


@quick
@given(st.integers(0, 10_000))
def test_equals_batch_without_forgetting(seed: int) -> None:
    x, y = ramp(seed)
    fit = run(RsRtls(1.0, rest_band_n=EVERY_SAMPLE), x, y).fit()
    batch = rs_btls(x, y)
    assert fit.n == pytest.approx(batch.n, rel=1e-11)
    assert math.log(fit.k) == pytest.approx(math.log(batch.k), rel=1e-11)
    assert fit.secant_n_per_m == pytest.approx(batch.secant_n_per_m, rel=1e-10)
    assert fit.points == np.sum((x > 0) & (y > 0))


@quick
@given(st.integers(0, 10_000), st.floats(0.95, 0.999))
def test_forgetting_is_an_exponential_weight(seed: int, forgetting: float) -> None:
    """Second implementation: singular value decomposition of the weighted batch matrix."""
    x, y = ramp(seed)
    x, y = x[20:], y[20:]
    fit = run(RsRtls(forgetting, rest_band_n=EVERY_SAMPLE), x, y).fit()
    weights = x * forgetting ** (np.arange(x.size)[::-1] / 2)
    rows = weights[:, None] * np.column_stack([np.ones(x.size), np.log(x), np.log(y)])
    v = np.linalg.svd(rows, full_matrices=False)[2][-1]
    assert fit.n == pytest.approx(-v[1] / v[2], rel=1e-8)


def test_forgetting_through_a_hold_loses_the_exponent_and_says_so() -> None:
    x, y = steps(hold_s=3.0)
    fit = run(RsRtls(0.99, rest_band_n=EVERY_SAMPLE), x, y).fit()
    assert abs(fit.n - 1.5) > 0.1
    assert Flag.HOLD_WINDUP in [doubt.flag for doubt in fit.doubts]


def test_freezing_at_rest_keeps_the_exponent() -> None:
    x, y = steps(hold_s=3.0)
    filter_ = run(RsRtls(0.99), x, y)
    fit = filter_.fit()
    assert fit.n == pytest.approx(1.5, abs=0.08)
    assert Flag.HOLD_WINDUP not in [doubt.flag for doubt in fit.doubts]
    assert filter_.fit().points < 400


def test_points_without_logarithm_are_left_out_and_flagged() -> None:
    x, y = ramp(3)
    filter_ = run(RsRtls(1.0), x[20:], y[20:])
    for _ in range(20):
        assert not filter_.update(-1e-6, 5.0)
        assert not filter_.update(1e-6, 0.0)
    assert Flag.NOT_POSITIVE in [doubt.flag for doubt in filter_.fit().doubts]
