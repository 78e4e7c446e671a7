"""How well F_c is known: against its equation, drawn again and again, and by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stepload.contact.limit import elastic_limit
from stepload.contact.limit_uncertainty import doubted_limits
from stepload.contact.materials import Geometry, Material, SharpCone, Sphere

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium", 70e9, 0.33, 276e6)
STEEL = Material("steel", 200e9, 0.29, None)
BALL = Sphere(0.0287)


def limit_of(geometry: Geometry, material: Material, plate: Material) -> float:
    found = elastic_limit(geometry, material, plate)
    assert found is not None
    return found.force_n


def sources(geometry: Geometry, material: Material, plate: Material) -> dict[str, float]:
    limit = doubted_limits(geometry, material, plate)[0]
    return {source.what: source.sigma_ln for source in limit.sources}


def test_the_paper_sphere_by_hand() -> None:
    limit = doubted_limits(BALL, ACETAL, ALUMINIUM)[0]
    assert limit.force_n == pytest.approx(727.0, abs=0.1)
    squares = (3 * 0.05) ** 2 + (2 * 0.02) ** 2 + (2 * 0.05) ** 2
    squares += (3 * 0.41 * 0.03 / (0.454 + 0.41 * 0.3)) ** 2
    assert limit.sigma_ln == pytest.approx(math.sqrt(squares), rel=1e-4)
    assert limit.lower_end(2.0) == pytest.approx(491.9, abs=0.2)
    assert limit.lower_end(3.0) == pytest.approx(limit.force_n * math.exp(-3.0 * limit.sigma_ln))
    assert all(source.assumed for source in limit.sources)


@pytest.mark.parametrize(("share", "sigma", "ratio"), [(0.10, 0.33, 0.52), (0.15, 0.47, 0.39)])
def test_a_yield_strength_that_is_known_badly(share: float, sigma: float, ratio: float) -> None:
    acetal = replace(ACETAL, yield_strength_sigma_pa=share * 70e6)
    limit = doubted_limits(BALL, acetal, ALUMINIUM)[0]
    assert limit.sigma_ln == pytest.approx(sigma, abs=0.006)
    assert limit.lower_end(2.0) / limit.force_n == pytest.approx(ratio, abs=0.01)
    assert limit.probability_below(limit.lower_end(2.0)) == pytest.approx(0.02275, abs=1e-5)
    assert limit.probability_below(limit.force_n) == pytest.approx(0.5)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.4, -0.4])
def test_the_spread_of_drawn_limits_is_not_larger_than_is_told(ratio: float) -> None:
    soft = replace(ACETAL, poisson_ratio=ratio, poisson_ratio_sigma=0.02)
    chance = np.random.default_rng(1)
    logs = []
    for _ in range(4000):
        y, r, e, nu, nu_plate = chance.normal(0.0, 1.0, 5)
        body = Material(
            "drawn", 2.75e9 * math.exp(0.05 * e), ratio + 0.02 * nu, 70e6 * math.exp(0.05 * y)
        )
        plate = Material("plate", 70e9 * math.exp(0.05 * e), 0.33 + 0.03 * nu_plate, 276e6)
        logs.append(math.log(limit_of(Sphere(0.0287 * math.exp(0.02 * r)), body, plate)))
    told = doubted_limits(BALL, soft, ALUMINIUM)[0].sigma_ln
    drawn = float(np.std(logs))
    assert 0.9 * told < drawn < 1.03 * told


def test_a_body_of_which_little_is_known_may_yield_first() -> None:
    vague = replace(ALUMINIUM, yield_strength_pa=80e6, yield_strength_sigma_pa=24e6)
    sure = replace(ACETAL, yield_strength_sigma_pa=0.7e6)
    limits = doubted_limits(BALL, sure, vague)
    assert [limit.force_n for limit in limits] == sorted(limit.force_n for limit in limits)
    assert limits[1].lower_end(2.0) < limits[0].lower_end(2.0)
    assert doubted_limits(BALL, vague, sure)[0].force_n == limits[0].force_n


def test_where_theory_has_no_limit_there_is_no_uncertainty_of_it() -> None:
    assert doubted_limits(SharpCone(0.3), ACETAL, ALUMINIUM) == ()
    assert doubted_limits(BALL, replace(ACETAL, yield_strength_pa=None), ALUMINIUM) == ()
    assert len(doubted_limits(BALL, ACETAL, STEEL)) == 1
