"""The elastic limit: which body decides, and where theory has none."""

import pytest

from stepload.contact.elastic import law_for
from stepload.contact.limit import elastic_limit, no_limit_reason, softer_body
from stepload.contact.materials import (
    BluntTip,
    Geometry,
    Material,
    PowerProfile,
    Sphere,
)

PLASTIC = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium", 70e9, 0.33, 276e6)
STEEL = Material("steel", 200e9, 0.29)


def test_softer_body_decides_whichever_side_it_is_on() -> None:
    one = elastic_limit(Sphere(0.0287), PLASTIC, ALUMINIUM)
    other = elastic_limit(Sphere(0.0287), ALUMINIUM, PLASTIC)
    assert one is not None
    assert one == other


def test_plate_of_unknown_strength_counts_as_harder_only_if_stiffer() -> None:
    assert softer_body(PLASTIC, STEEL) is PLASTIC
    assert elastic_limit(Sphere(0.0287), PLASTIC, STEEL) is not None
    rubber = Material("rubber", 1e7, 0.49)
    assert elastic_limit(Sphere(0.0287), PLASTIC, rubber) is None
    assert "'rubber'" in no_limit_reason(Sphere(0.0287), PLASTIC, rubber)


def test_unknown_payload_strength_has_no_limit() -> None:
    assert elastic_limit(Sphere(0.0287), STEEL, ALUMINIUM) is None
    assert "'steel' is not known" in no_limit_reason(Sphere(0.0287), STEEL, ALUMINIUM)


@pytest.mark.parametrize(
    "geometry", [Sphere(0.02), Sphere(0.02, 0.05), BluntTip("cone", 0.003), PowerProfile(2.0, 25.0)]
)
def test_limit_lies_on_the_elastic_law(geometry: Geometry) -> None:
    limit = elastic_limit(geometry, PLASTIC, ALUMINIUM)
    assert limit is not None
    assert no_limit_reason(geometry, PLASTIC, ALUMINIUM) == ""
    law = law_for(geometry, PLASTIC, ALUMINIUM)
    assert law.force(limit.deformation_m) == pytest.approx(limit.force_n, rel=1e-12)


def test_limit_grows_with_radius_squared_and_strength_cubed() -> None:
    base = elastic_limit(Sphere(0.01), PLASTIC, ALUMINIUM)
    bigger = elastic_limit(Sphere(0.02), PLASTIC, ALUMINIUM)
    harder = elastic_limit(Sphere(0.01), Material("x", 2.75e9, 0.3, 140e6), ALUMINIUM)
    assert base is not None
    assert bigger is not None
    assert harder is not None
    assert bigger.force_n / base.force_n == pytest.approx(4.0)
    assert harder.force_n / base.force_n == pytest.approx(8.0)
