"""Lack of fit against the spread between two loadings: no stated error hides it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed_runs import World, hertz, press, told
from stepload.evidence.gates import HARMLESS, Gate

from stepload.estimators.fit import FloatArray
from stepload.evidence.answer import weigh
from stepload.evidence.pressed import Pressed

TOUCH = "secant_from_touch"
FINE = World(quantum_m=0.0, position_noise_m=1e-9, force_noise_n=0.01, smooth_m=2e-8, loop=0.0)


def bent(share: float) -> World:
    """A fine rig on a sphere that gives way by a share of its deformation in the middle."""
    top_m = float(hertz(np.array([300.0]))[0])

    def law(force_n: FloatArray) -> FloatArray:
        more = share * top_m * np.exp(-0.5 * ((force_n - 150.0) / 30.0) ** 2)
        return np.asarray(hertz(force_n) + more)

    return replace(FINE, law=law)


def overstated(run: Pressed, times: float = 120.0) -> Pressed:
    errors = ("force_noise_n", "position_noise_m", "smooth_error_m")
    wider = {name: times * getattr(run.conditions.sources, name) for name in errors}
    return told(run, **wider)


def gates(run: Pressed) -> dict[str, Gate]:
    return {gate.name: gate for gate in weigh(run).gates}


def test_errors_stated_too_large_do_not_hide_that_the_law_does_not_fit() -> None:
    run = overstated(press(bent(0.06)))
    fired = {name for name, gate in gates(run).items() if gate.fires}
    assert fired == {"misfit"}
    found = weigh(run)
    assert found.headline.verdict == "identified"
    assert found.quantities[TOUCH].verdict != "identified"
    assert "the law (power law) does not fit" in " ".join(found.quantities[TOUCH].why)


@pytest.mark.parametrize("times", [1.0, 0.1, 10.0])
def test_a_law_that_fits_is_quiet_whatever_errors_were_stated(times: float) -> None:
    for seed in range(3):
        assert not gates(overstated(press(World(), seed), times))["misfit"].fires


def test_a_fine_sensor_does_not_refuse_what_does_no_harm() -> None:
    gate = gates(press(bent(0.005)))["misfit"]
    assert not gate.fires
    span_m = 270.0 / weigh(press(bent(0.005))).headline.value_n_per_m
    assert gate.threshold == pytest.approx(HARMLESS * span_m, rel=0.02)


def test_a_chosen_law_is_held_against_the_spread_too() -> None:
    cone = told(overstated(press(FINE), 20.0), laws=("cone",))
    assert gates(cone)["misfit"].fires
    assert not gates(told(cone, laws=("hertz",)))["misfit"].fires


def test_one_loading_has_no_pure_error() -> None:
    assert "misfit" not in gates(press(World(cycles=1)))


def test_a_stated_error_that_repeats_is_no_misfit() -> None:
    world = replace(FINE, smooth_m=1.2e-6)
    found = [gates(press(world, seed))["misfit"] for seed in range(6)]
    assert not any(gate.fires for gate in found)
    span_m = 270.0 / weigh(press(world)).headline.value_n_per_m
    assert max(gate.value for gate in found) > HARMLESS * span_m
