"""Where the contact theory ends: each doubt where it holds and nowhere else, with its figures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from stepload.contact.elastic import law_for
from stepload.contact.limit import elastic_limit
from stepload.contact.materials import (
    BluntTip,
    Body,
    FlatPunch,
    Geometry,
    Material,
    SharpCone,
    Sphere,
)
from stepload.contact.validity import DomainDoubt, Pressed, domain_doubts

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium", 70e9, 0.33, 276e6)
RUBBER = Material("rubber", 3e6, 0.49, None)
SMOOTH = Pressed(Sphere(0.0287), ACETAL, ALUMINIUM, 30.0, 300.0)


def found(pressed: Pressed = SMOOTH, **changes: Any) -> dict[str, DomainDoubt]:
    doubts = domain_doubts(replace(pressed, **changes))
    assert len({doubt.code for doubt in doubts}) == len(doubts)
    return {doubt.code: doubt for doubt in doubts}


def at_depth(depth: float, geometry: Geometry, radius_m: float) -> Pressed:
    """A rubber pressed to this share of its radius."""
    force_n = law_for(geometry, RUBBER, ALUMINIUM).force(depth * radius_m)
    return Pressed(geometry, RUBBER, ALUMINIUM, 0.1 * force_n, force_n)


@pytest.mark.parametrize("depth", [0.101, 0.42, 0.99, 1.01])
def test_a_sphere_pressed_deep_is_doubted(depth: float) -> None:
    doubt = found(at_depth(depth, Sphere(0.02), 0.02))["deep_contact"]
    assert (doubt.value, doubt.limit) == (pytest.approx(depth), 0.1)
    assert doubt.impossible == (depth > 1.0)
    assert f"{depth:.2g} of the radius" in doubt.message
    assert "stay below" in doubt.remedy
    force_n = float(doubt.remedy.split()[2])
    assert found(at_depth(depth, Sphere(0.02), 0.02), to_n=0.98 * force_n, from_n=0.1) == {}


def test_a_sphere_pressed_less_deep_is_not_doubted() -> None:
    assert found(at_depth(0.0999, Sphere(0.02), 0.02)) == {}
    assert found(at_depth(0.0999, Sphere(0.04, 0.04), 0.02)) == {}
    assert set(found(at_depth(0.101, Sphere(0.04, 0.04), 0.02))) == {"deep_contact"}


@pytest.mark.parametrize(("depth", "impossible"), [(0.15, False), (0.99, False), (10.0, True)])
def test_a_tip_is_left_for_the_flank(depth: float, impossible: bool) -> None:
    doubt = found(at_depth(depth, BluntTip("cone", 0.003), 0.003))["tip_exceeded"]
    assert doubt.impossible is impossible
    assert doubt.value == pytest.approx(depth)
    assert found(at_depth(0.09, BluntTip("cone", 0.003), 0.003)) == {}


@pytest.mark.parametrize(
    ("geometry", "doubted"),
    [
        (SharpCone(math.radians(17.0)), False),
        (SharpCone(math.radians(18.0)), True),
        (FlatPunch(0.01), False),
    ],
)
def test_steep_gaps_are_doubted(geometry: Geometry, doubted: bool) -> None:
    doubts = found(Pressed(geometry, RUBBER, ALUMINIUM, 1.0, 10.0))
    assert ("steep_contact" in doubts) == doubted
    assert len(doubts) == doubted


def test_roughness_is_doubted_at_the_lowest_force() -> None:
    lowest_m = law_for(SMOOTH.geometry, ACETAL, ALUMINIUM).deformation(30.0)
    assert found(roughness_m=0.0499 * lowest_m) == {}
    doubt = found(roughness_m=0.0501 * lowest_m)["rough_contact"]
    assert (doubt.value, doubt.limit) == (pytest.approx(0.0501), 0.05)
    assert doubt.harmless


def test_roughness_beyond_the_model_is_no_note() -> None:
    doubt = found(roughness_m=7.5e-6, micro_hardness_pa=7e8, from_n=1e-4)["rough_beyond_model"]
    assert (doubt.value < doubt.limit, doubt.limit, doubt.harmless) == (True, 0.01, False)
    bare = replace(ACETAL, yield_strength_pa=None)
    doubt = found(roughness_m=7.5e-6, material=bare)["rough_contact"]
    assert not doubt.harmless
    assert "micro_hardness" in doubt.remedy
    cone = found(roughness_m=7.5e-6, geometry=FlatPunch(0.01), micro_hardness_pa=7e8)
    assert not cone["rough_contact"].harmless


def test_a_thin_payload_is_doubted() -> None:
    radius_m = math.sqrt(0.0287 * law_for(SMOOTH.geometry, ACETAL, ALUMINIUM).deformation(300.0))
    assert found(height_m=10.01 * radius_m) == {}
    doubt = found(height_m=9.99 * radius_m)["thin_payload"]
    assert (doubt.value, doubt.limit) == (pytest.approx(0.1001, abs=1e-5), 0.1)
    assert not doubt.impossible
    assert found(height_m=5e-5)["thin_payload"].impossible


def test_a_narrow_body_is_no_half_space() -> None:
    radius_m = math.sqrt(0.0287 * law_for(SMOOTH.geometry, ACETAL, ALUMINIUM).deformation(300.0))
    assert found(body=Body(0.02, 4.01 * radius_m)) == {}
    doubt = found(body=Body(0.02, 3.99 * radius_m))["narrow_body"]
    assert (doubt.value, doubt.limit) == (pytest.approx(0.2506, abs=1e-4), 0.25)
    assert doubt.impossible
    wide = Body(0.02, 4.5 * radius_m)  # a run may load up to the F_c that is used
    assert "narrow_body" in found(body=wide, used_limit_n=500.0)


def test_yield_by_how_far_it_goes() -> None:
    onset = elastic_limit(SMOOTH.geometry, ACETAL, ALUMINIUM)
    assert onset is not None
    limit_n = onset.force_n
    assert set(found(to_n=0.99 * limit_n)) == set()
    assert set(found(to_n=1.01 * limit_n)) == {"above_elastic_limit"}
    assert set(found(to_n=500.0, used_limit_n=492.0)) == {"within_doubt_of_limit"}
    assert found(to_n=490.0, used_limit_n=492.0) == {}
