"""All fits of one run, from displacement to doubts."""

from typing import Any

import numpy as np
import pytest

from stepload.identification import estimators as room
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.fit import Fit, Flag, FloatArray
from stepload.identification.samples import select

K_S = 3.49e6
TWO_PARAMETER = {"log_ls", "log_tls", "rs_btls", "mixed_ls_tls", "inverse_ls", "rs_rtls"}


def fit_all(
    x: FloatArray,
    y: FloatArray,
    *,
    system_stiffness_n_per_m: float | None,
    secant_force_n: float,
    time_s: FloatArray | None = None,
    **wanted: Any,
) -> dict[str, Fit]:
    """Every fit of what is selected from a run."""
    conditions = Conditions(Sources(system_stiffness_n_per_m), 300.0, 0.0, 0.0)
    chosen = select(x - conditions.bend(y), y, time_s=time_s)
    return room.fit_all(chosen, secant_force_n=secant_force_n, **wanted)


def run(zero_m: float = 0.0, noise: float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(time in s, displacement in m, force in N) of a step protocol at 500 Hz."""
    rng = np.random.default_rng(0)
    parts = []
    for level in range(0, 300, 50):
        parts.append(np.linspace(level + 1.0, level + 50.0, 500))
        parts.append(np.full(1000, level + 50.0))
    true_n = np.concatenate(parts)
    total_m = (true_n / 6.57e8) ** (1 / 1.5) + true_n / K_S + zero_m
    displacement_m = total_m + noise * rng.normal(0.0, 0.3e-6, true_n.size)
    force_n = true_n + noise * rng.normal(0.0, 0.2, true_n.size)
    return np.arange(true_n.size) / 500.0, displacement_m, force_n


def test_every_fit_finds_the_law_when_the_zero_is_right() -> None:
    time_s, x, y = run()
    fits = fit_all(
        x,
        y,
        system_stiffness_n_per_m=K_S,
        secant_force_n=300.0,
        time_s=time_s,
        sigma_m=0.3e-6,
        sigma_n=0.2,
    )
    assert set(fits) == TWO_PARAMETER | {"joint", "ew_tls", "odr"}
    for name, fit in fits.items():
        assert fit.estimator == name
        assert fit.n == pytest.approx(1.5, abs=0.03), name
        assert fit.secant_n_per_m == pytest.approx(5.06e6, rel=0.01), name
        assert fit.secant_force_n == 300.0
        assert fit.force_rms_n == pytest.approx(1.7, rel=0.3), name
        assert fit.doubts == (), name


def test_wrong_zero_is_found_by_the_joint_fit_only() -> None:
    time_s, x, y = run(zero_m=4e-6)
    fits = fit_all(x, y, system_stiffness_n_per_m=K_S, secant_force_n=300.0, time_s=time_s)
    assert fits["joint"].zero_m == pytest.approx(4e-6, abs=0.2e-6)
    assert fits["joint"].n == pytest.approx(1.5, abs=0.03)
    for name in TWO_PARAMETER:
        assert abs(fits[name].n - 1.5) > 0.08, name


def test_negative_deformation_leaves_the_joint_fit_and_flags_the_others() -> None:
    _, x, y = run(zero_m=-20e-6)
    fits = fit_all(x, y, system_stiffness_n_per_m=K_S, secant_force_n=300.0)
    assert fits["joint"].doubts == ()
    assert Flag.NOT_POSITIVE in [doubt.flag for doubt in fits["rs_btls"].doubts]
    _, x, y = run(zero_m=-1e-3)
    fits = fit_all(x, y, system_stiffness_n_per_m=K_S, secant_force_n=300.0)
    assert "rs_btls" not in fits
    assert fits["joint"].n == pytest.approx(1.5, abs=0.03)


def test_samples_in_free_air_do_not_enter() -> None:
    _, x, y = run()
    fits = fit_all(x, y, system_stiffness_n_per_m=K_S, secant_force_n=300.0)
    with_air = fit_all(
        np.append(np.zeros(500), x),
        np.append(np.full(500, -0.3), y),
        system_stiffness_n_per_m=K_S,
        secant_force_n=300.0,
    )
    for name, fit in fits.items():
        assert (with_air[name].k, with_air[name].n) == (fit.k, fit.n)


@pytest.mark.parametrize("stiffer", [1.5, 2.5, 3.0, 5.0])
def test_a_system_stiffer_than_believed_breaks_no_estimator(
    stiffer: float, capfd: pytest.CaptureFixture[str]
) -> None:
    """Deformations around and below zero: an estimator may refuse them, and alone."""
    force_n = run()[2]
    bent = force_n / K_S
    displacement_m = (force_n / 6.57e8) ** (1 / 1.5) + bent / stiffer
    fits = fit_all(
        displacement_m, force_n, system_stiffness_n_per_m=K_S, secant_force_n=300.0,
        sigma_m=1e-6, sigma_n=0.3,
    )  # fmt: skip
    assert fits
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")
