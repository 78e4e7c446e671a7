"""A curve without a time: its rows stand for it, numbered once over all cycles."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from stepload.identification.fit import FloatArray
from stepload.report.conditions import Stated
from stepload.report.from_file import identify_file

K = 1.1e9


def depth_m(force_n: FloatArray) -> FloatArray:
    return np.asarray((np.maximum(force_n, 0.0) / K) ** (1 / 1.5))


def written(path: Path, seed: int, drift_m: float = 0.0) -> Path:
    """Two equal cycles of an elastic contact; `drift_m` per row."""
    rng = np.random.default_rng(seed)
    turns = [0.0, 300.0, 0.0, 300.0, 0.0]
    force = np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(turns)])
    air = np.linspace(-5e-6, 0.0, 300, endpoint=False)
    force, travel = np.concatenate([np.zeros(300), force]), np.concatenate([air, depth_m(force)])
    travel = travel + drift_m * np.arange(travel.size) + rng.normal(0.0, 3e-9, travel.size)
    rows = zip(travel, force + rng.normal(0.0, 0.1, force.size), strict=True)
    path.write_text("displacement_m,force_n\n" + "".join(f"{x:.10g},{f:.10g}\n" for x, f in rows))
    return path


@pytest.mark.parametrize("seed", range(3))
def test_no_drift_is_invented(tmp_path: Path, seed: int) -> None:
    found, *_ = identify_file(written(tmp_path / "curve.csv", seed), Stated())
    chord = found.quantities["chord"]
    for from_n, figure in ((chord.from_n, chord), (0.0, found.quantities["secant_from_touch"])):
        low, high = figure.interval_n_per_m
        deep_m = np.diff(depth_m(np.array([from_n, figure.to_n])))
        assert low <= (figure.to_n - from_n) / deep_m[0] <= high
        assert figure.verdict == "identified"
    assert not any("drifts" in why for why in chord.why)


def test_a_drift_is_told_by_rows(tmp_path: Path) -> None:
    found, *_ = identify_file(written(tmp_path / "curve.csv", 1, 1e-8), Stated())
    chord = found.quantities["chord"]
    low, high = chord.interval_n_per_m
    deep_m = np.diff(depth_m(np.array([chord.from_n, chord.to_n])))
    assert low <= (chord.to_n - chord.from_n) / deep_m[0] <= high
    assert next(line.relative for line in chord.lines if line.source == "drift") > 0.0
    assert found.judgement is not None
    assert found.judgement.drift_m_per_s is None
