"""CSV curves: what is found in them, what is assumed and said, and which doubts can be raised."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from stepload.errors import BadInputError
from stepload.identify.curve_parts import (
    FINEST_M,
    first_loading,
    first_touch,
    free_air_force,
    quantum,
    white_noise,
)
from stepload.identify.fit import Flag, FloatArray
from stepload.identify.identification import Identification
from stepload.results.from_file import Wishes, identify_file

K, N, KS = 6.57e8, 1.5, 3.49e6
SECANT = 300.0 ** (1 - 1 / N) * K ** (1 / N)
NOTHING = Wishes()
RIG = Wishes(system_stiffness_n_per_m=KS, system_stiffness_sigma_n_per_m=35e3)
Found = tuple[Identification, str]


def course(top_n: float = 300.0, rate_hz: int = 100) -> FloatArray:
    """Free air for 1 s, then steps of 50 N with ramps of 1 s and holds of 1 s."""
    parts = [np.zeros(rate_hz)]
    for level in np.arange(0.0, top_n, 50.0):
        parts += [level + 50.0 * np.arange(1, rate_hz + 1) / rate_hz, np.full(rate_hz, level + 50)]
    return np.concatenate(parts)


def travel(force_n: FloatArray, k: float = K, gap_m: float = 30e-6) -> FloatArray:
    position = (force_n / k) ** (1 / N) + force_n / KS
    free = int(np.argmax(force_n > 0))
    position[:free] = np.linspace(-gap_m, 0.0, free, endpoint=False)
    return position


@pytest.fixture
def identified(tmp_path: Path) -> Callable[..., Found]:
    def write_and_identify(wishes: Wishes = NOTHING, /, **columns: FloatArray) -> Found:
        path = tmp_path / "curve.csv"
        table = np.column_stack(list(columns.values()))
        np.savetxt(path, table, "%.10g", ",", header=",".join(columns), comments="")
        found, notes = identify_file(path, wishes)
        return found, "\n".join(notes)

    return write_and_identify


def test_a_clean_curve_gives_its_law_back(identified: Callable[..., Found]) -> None:
    force = np.linspace(1.0, 300.0, 300)
    found, notes = identified(displacement_m=(force / K) ** (1 / N), force_n=force)
    for name in ("rs_btls", "rs_rtls", "joint"):
        assert found.fits[name].n == pytest.approx(N, abs=1e-4), name
        assert found.fits[name].secant_n_per_m == pytest.approx(SECANT, rel=1e-4), name
        low, high = found.budgets[name].interval_secant_n_per_m
        assert low <= found.fits[name].secant_n_per_m <= high
    assert found.judgement.verdict == "identified"
    assert "taken from the residuals" in notes


def covers(found: Identification) -> bool:
    assert found.budget is not None
    low, high = found.budget.interval_secant_n_per_m
    return low < SECANT < high


@pytest.mark.parametrize("bias_n", [0.0, 12.0, -20.0])
def test_force_in_free_air_is_taken_out(identified: Callable[..., Found], bias_n: float) -> None:
    rng = np.random.default_rng(1)
    force = course()
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=travel(force) + rng.normal(0, 0.3e-6, force.size),
        force_n=force + bias_n + rng.normal(0, 0.5, force.size),
    )  # fmt: skip
    assert found.believe == "joint"
    assert found.fit.n == pytest.approx(N, abs=0.05)
    assert covers(found)
    assert "touch taken where the force passes 3" in notes
    assert ("taken out" in notes) == (bias_n != 0.0)


def test_only_the_first_loading_counts(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(2)
    up = course()
    force = np.concatenate([up, up[::-1], 1.01 * up])
    position = travel(force)
    position[up.size : 2 * up.size] += 5e-6
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=position + rng.normal(0, 0.3e-6, force.size),
        force_n=force + rng.normal(0, 0.5, force.size),
    )  # fmt: skip
    assert "first loading only" in notes
    assert found.fit.secant_n_per_m == pytest.approx(SECANT, rel=0.01)
    assert covers(found)


def test_data_that_begin_in_contact_are_told_and_found(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(3)
    force = np.linspace(30.0, 300.0, 2000)
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=3e-3 + travel(force) + rng.normal(0, 0.3e-6, force.size),
        force_n=force + rng.normal(0, 0.3, force.size),
    )  # fmt: skip
    assert "the data begin in contact, at 30" in notes
    assert found.believe == "joint"
    # At the first sample payload and system are bent by 30 N already.
    assert found.fit.zero_m == pytest.approx(-((30 / K) ** (1 / N) + 30 / KS), abs=1e-6)
    assert covers(found)
    low, high = found.budgets["rs_btls"].interval_secant_n_per_m
    assert high > 3.0 * low, "a fit that takes this zero as given knows next to nothing"


def test_a_spike_in_free_air_is_no_touch(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(4)
    force = course()
    spiked = force + rng.normal(0, 0.3, force.size)
    spiked[40] = 80.0
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100, position_m=travel(force), force_n=spiked
    )
    assert abs(found.fit.zero_m) < 8e-6
    assert covers(found)


def flags(found: Identification) -> set[Flag]:
    return {doubt.flag for fit in found.fits.values() for doubt in fit.doubts}


def test_noise_and_quanta_leave_points_without_logarithm(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(5)
    force = course()
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=np.round((travel(force) + rng.normal(0, 3e-7, force.size)) / 2e-6) * 2e-6,
        force_n=np.round((force + rng.normal(0, 0.5, force.size)) / 1.5) * 1.5,
    )  # fmt: skip
    assert flags(found) >= {Flag.NOT_POSITIVE, Flag.EXPONENT_UNDETERMINED}
    assert found.conditions.position_resolution_m == pytest.approx(2e-6)
    assert covers(found)


def test_a_payload_beyond_the_rig_is_not_identified(identified: Callable[..., Found]) -> None:
    force = course()
    position = np.round(travel(force, k=8.87e10) / 2e-6) * 2e-6
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100, position_m=position, force_n=force
    )
    assert Flag.BEYOND_K_MAX in flags(found)
    assert found.judgement.verdict != "identified"


def test_force_above_the_elastic_limit_is_flagged(identified: Callable[..., Found]) -> None:
    force = np.linspace(1.0, 300.0, 100)
    found, _ = identified(
        Wishes(elastic_limit_n=250.0), displacement_m=(force / K) ** (1 / N), force_n=force
    )
    assert all(Flag.ABOVE_ELASTIC_LIMIT in {d.flag for d in f.doubts} for f in found.fits.values())
    assert found.judgement.verdict == "marginal"


def test_few_samples_are_flagged_and_fewer_refused(identified: Callable[..., Found]) -> None:
    force = np.linspace(10.0, 300.0, 30)
    found, _ = identified(displacement_m=(force / K) ** (1 / N), force_n=force)
    assert Flag.TOO_FEW_POINTS in flags(found)
    assert found.fit.n == pytest.approx(N, abs=1e-3)
    with pytest.raises(BadInputError, match="9 samples"):
        identified(displacement_m=force[:9] * 1e-7, force_n=force[:9])


def test_a_law_that_falls_is_believed_by_nobody(identified: Callable[..., Found]) -> None:
    found, _ = identified(
        displacement_m=np.linspace(60e-6, 1e-6, 100), force_n=np.linspace(1.0, 300.0, 100)
    )
    assert flags(found) >= {Flag.ILL_CONDITIONED, Flag.NOT_CONVERGED}
    assert found.judgement.verdict == "not identifiable"
    assert any("believe none" in why for why in found.why)


def test_a_long_unrest_at_the_top_winds_the_recursive_fit_up(
    identified: Callable[..., Found],
) -> None:
    seconds = np.arange(0, 300 * 100) / 100
    force = np.concatenate([course(), 295.0 + 5.0 * np.cos(2 * np.pi * 0.2 * seconds)])
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100, position_m=travel(force), force_n=force
    )
    assert Flag.HOLD_WINDUP in {doubt.flag for doubt in found.fits["rs_rtls"].doubts}
    assert found.believe == "joint"


def test_force_that_pulls_is_refused(identified: Callable[..., Found]) -> None:
    with pytest.raises(BadInputError, match="turn the sign"):
        identified(displacement_m=np.linspace(0, 1e-5, 50), force_n=-np.linspace(1, 300, 50))


def test_intervals_without_a_stated_smooth_error_cover(identified: Callable[..., Found]) -> None:
    """Nominal 95 %: fewer than 16 of 20 inside would happen by chance once in 400 times."""
    inside = 0
    force = np.linspace(3.0, 300.0, 150)
    grid = np.linspace(0.0, 300.0, 61)
    root = np.linalg.cholesky(
        np.exp(-0.5 * (np.subtract.outer(grid, grid) / 50) ** 2) + 1e-9 * np.eye(61)
    )
    for seed in range(20):
        draw = 0.54e-6 * root @ np.random.default_rng(seed).standard_normal(61)
        found, _ = identified(
            displacement_m=(force / K) ** (1 / N) + np.interp(force, grid, draw), force_n=force
        )
        low, high = found.budgets["joint"].interval_secant_n_per_m
        inside += low < SECANT < high
    assert inside >= 16


def test_noise_is_told_from_curvature_and_quantum_from_noise() -> None:
    rng = np.random.default_rng(0)
    force = np.linspace(10, 300, 40)
    law = (force / K) ** (1 / N)
    assert white_noise(law) < 3e-8
    assert white_noise(law[:7]) == 0.0
    noise = rng.normal(0, 2.0, 5000)
    assert white_noise(noise) == pytest.approx(2.0, rel=0.1)
    assert quantum(law) == FINEST_M
    assert quantum(np.round(rng.normal(0, 2e-5, 500) / 2e-6) * 2e-6) == pytest.approx(2e-6)


def test_parts_of_a_loading() -> None:
    force = course()
    assert first_loading(force) == slice(0, force.size)
    there_and_back = first_loading(np.concatenate([force, force[::-1]]))
    assert force.size < there_and_back.stop < 1.2 * force.size
    assert force[first_touch(force, 3.0)] >= 3.0 > force[first_touch(force, 3.0) - 1]
    assert first_touch(force + 10.0, 3.0) == 0


def test_rest_in_contact_is_no_free_air() -> None:
    force = np.concatenate([np.full(100, 20.0), np.linspace(20, 300, 500)])
    assert free_air_force(travel(force), force, 3.0) is None
    free = course() + 20.0
    assert free_air_force(travel(course()), free, 3.0) == pytest.approx(20.0, abs=0.1)
