"""Every number of the paper that the contact theory gives, to all printed digits."""

import math

import numpy as np
import pytest

from stepload.contact.elastic import equivalent_modulus, law_for
from stepload.contact.limit import elastic_limit
from stepload.contact.materials import BluntTip, Geometry, Material, Sphere
from stepload.contact.power_law import secant_stiffness
from stepload.contact.rough import RoughSphere, roughness_number
from stepload.identification.ls import rs_btls

PLASTIC = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium 6061", 70e9, 0.33, 276e6)
SPHERE = Sphere(28.7e-3)
CONE = BluntTip("cone", 3.3e-3)
PYRAMID = BluntTip("pyramid", 1.15e-3)


@pytest.mark.parametrize(
    ("geometry", "material", "stiffness"),
    [
        (SPHERE, PLASTIC, "6.57e+08"),
        (SPHERE, ALUMINIUM, "8.87e+09"),
        (CONE, PLASTIC, "2.23e+08"),
        (PYRAMID, PLASTIC, "1.32e+08"),
    ],
)
def test_smooth_stiffness(geometry: Geometry, material: Material, stiffness: str) -> None:
    law = law_for(geometry, material, ALUMINIUM)
    assert f"{law.k:.2e}" == stiffness
    assert law.n == 1.5


@pytest.mark.parametrize(
    ("geometry", "material", "limit"),
    [
        (SPHERE, PLASTIC, "727"),
        (CONE, PLASTIC, "9.6"),
        (PYRAMID, PLASTIC, "1.2"),
        (SPHERE, ALUMINIUM, "261"),
    ],
)
def test_elastic_limit_of_table_iii(geometry: Geometry, material: Material, limit: str) -> None:
    found = elastic_limit(geometry, material, ALUMINIUM)
    assert found is not None
    decimals = len(limit.partition(".")[2])
    assert f"{found.force_n:.{decimals}f}" == limit


TABLE_I = [
    (2.36e9, 1.64, 4.80e6),
    (1.64e9, 1.60, 4.73e6),
    (3.92e9, 1.70, 4.67e6),
    (5.17e9, 1.72, 4.75e6),
    (1.37e8, 1.48, 1.95e6),
    (1.18e8, 1.47, 1.93e6),
    (3.22e8, 1.57, 2.07e6),
    (3.24e8, 1.57, 2.04e6),
    (1.03e7, 1.27, 1.09e6),
    (9.32e6, 1.27, 1.06e6),
    (4.97e7, 1.43, 1.38e6),
    (1.27e8, 1.54, 1.37e6),
    (2.00e14, 2.45, 2.03e7),
    (3.51e10, 1.68, 1.86e7),
    (1.52e16, 2.81, 2.25e7),
]


@pytest.mark.parametrize(("k", "n", "secant"), TABLE_I)
def test_secants_of_table_i(k: float, n: float, secant: float) -> None:
    assert secant_stiffness(k, n, 300.0) == pytest.approx(secant, rel=0.04)


def test_last_secant_of_table_i_is_a_probable_misprint() -> None:
    assert f"{secant_stiffness(6.06e13, 2.33, 300.0):.2e}" == "2.13e+07"


def test_rough_plastic_sphere_of_table_ii() -> None:
    modulus = equivalent_modulus(PLASTIC, ALUMINIUM)
    assert f"{math.sqrt(0.5 * math.pi) * 6.0:.1f}" == "7.5"  # σ_eq in µm of Ra = 6 µm on a flat
    kappa = roughness_number(modulus, 7.0e8, SPHERE.radius_m, 7.5e-6)
    contact = RoughSphere(law_for(SPHERE, PLASTIC, ALUMINIUM).k, 7.5e-6, kappa)
    force_n = np.arange(30.0, 301.0, 30.0)
    fit = rs_btls(np.array([contact.deformation(float(f)) for f in force_n]), force_n)
    assert f"{fit.k:.2e}" == "1.82e+10"
    assert f"{fit.n:.2f}" == "1.85"
    assert fit.secant_n_per_m == pytest.approx(4.81e6, rel=0.003)


def test_series_law_is_exact_at_the_elastic_limit() -> None:
    law = law_for(SPHERE, PLASTIC, ALUMINIUM)
    limit = elastic_limit(SPHERE, PLASTIC, ALUMINIUM)
    assert limit is not None
    assert math.isclose(law.force(limit.deformation_m), limit.force_n, rel_tol=1e-12)
