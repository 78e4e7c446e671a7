"""A force that stands while the travel goes on is a sensor at its end; a hold is none."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.identification.fit import FloatArray
from stepload.identification.samples import select
from stepload.report.curve import clipped_doubts

DEPTH_M, TOP_N, NOISE_N = 60e-6, 300.0, 0.2
RAMP = np.linspace(0.01, 1.0, 1500)


def doubts(force_n: FloatArray, deformation_m: FloatArray) -> int:
    noise = NOISE_N * np.random.default_rng(1).standard_normal(force_n.size)
    return len(list(clipped_doubts(select(deformation_m, force_n + noise), NOISE_N, 0.0)))


@pytest.mark.parametrize("end_n", [150.0, 200.0, 240.0, 280.0, 294.0])
def test_a_clipped_force_is_doubted(end_n: float) -> None:
    force_n = np.minimum(TOP_N * RAMP, end_n)
    assert doubts(force_n, DEPTH_M * RAMP ** (2.0 / 3.0)) == 1


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0, 3.0])
def test_a_whole_loading_is_not(n: float) -> None:
    assert doubts(TOP_N * RAMP, DEPTH_M * RAMP ** (1.0 / n)) == 0


@pytest.mark.parametrize("creep", [0.0, 0.05, 0.2])
def test_a_hold_at_the_top_is_not_though_it_creeps(creep: float) -> None:
    rest = np.linspace(0.0, 1.0, 1500)
    force_n = np.concatenate([TOP_N * RAMP, np.full(1500, TOP_N)])
    deformation_m = DEPTH_M * np.concatenate([RAMP ** (2.0 / 3.0), 1.0 + creep * rest])
    assert doubts(force_n, deformation_m) == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_hold_whose_travel_flickers_by_a_quantum_is_not(seed: int) -> None:
    rest = np.ones(600)
    force_n = TOP_N * np.concatenate([RAMP, rest])
    deformation_m = DEPTH_M * np.concatenate([RAMP, rest])
    quantum_m = 2e-6
    flicker = 0.4 * np.random.default_rng(seed).standard_normal(force_n.size)
    assert doubts(force_n, np.round(deformation_m / quantum_m + flicker) * quantum_m) == 0


def test_a_payload_that_softens_but_rises_is_not() -> None:
    force_n = np.minimum(TOP_N * RAMP, 0.5 * TOP_N + 0.3 * (TOP_N * RAMP - 0.5 * TOP_N))
    assert doubts(force_n, DEPTH_M * RAMP) == 0
