"""What the command line of `identify` states beside a curve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stepload.report.from_file import Stated, identify_file

KS, K = 3.49e6, 6.57e8


@pytest.fixture
def curve(tmp_path: Path) -> Path:
    """A loading to 300 N on a system of stiffness KS, a lead-in in free air before it."""
    time_s = np.arange(0.0, 12.0, 0.01)
    force_n = np.clip((time_s - 2.0) * 30.0, 0.0, None)
    position_m = np.minimum(time_s - 2.0, 0.0) * 1e-5 + force_n / KS + (force_n / K) ** (2.0 / 3.0)
    rng = np.random.default_rng(2)
    position_m += rng.normal(0.0, 1e-7, position_m.size)
    force_n = force_n + rng.normal(0.0, 0.1, force_n.size)
    path = tmp_path / "curve.csv"
    rows = np.stack([time_s, position_m, force_n], axis=1)
    np.savetxt(path, rows, delimiter=",", header="time_s,position_m,force_n", comments="")
    return path


def sizes(curve: Path, **stated: float) -> dict[str, str]:
    found, _ = identify_file(curve, Stated(system_stiffness_n_per_m=KS, **stated))
    assert found.headline is not None
    return {line.source: line.size for line in found.headline.lines}


def test_a_stated_stiffness_is_known_as_stated_and_to_five_percent_where_nobody_states_it(
    curve: Path,
) -> None:
    for sigma in (0.01, 0.07):
        told = sizes(curve, system_stiffness_sigma_n_per_m=sigma * KS)
        assert told["system stiffness K_s"] == f"{100 * sigma:.0f} %"
    assert "5 %" in sizes(curve)["system stiffness K_s"]


def test_a_stated_length_is_taken_and_an_unknown_one_is_a_range(curve: Path) -> None:
    source = "smooth deformation error"
    told = sizes(curve, smooth_error_m=5e-7, smooth_length_n=40.0)
    assert told[source] == "0.5 µm over 40 N"
    unknown = sizes(curve, smooth_error_m=5e-7)
    assert unknown[source] != "0.5 µm over 40 N"


def test_a_stated_drift_takes_the_place_of_what_one_cycle_leaves_open(curve: Path) -> None:
    assert "drift as stated" not in sizes(curve)
    assert "drift as stated" in sizes(curve, travel_drift_m_per_s=1e-9)
