"""The truth of every world of the coverage bench, found a second time in another way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from stepload.contact.plastic import ElasticPlasticSphere
from stepload.contact.rough import RoughSphere
from stepload_verify.trials.honest import laws
from stepload_verify.trials.honest.worlds import KNOWN, make

TOP_N, TOP_M = 300.0, 59.3e-6
FORCES_N = (3.0, 30.0, 120.0, 300.0)


def solved(force_of, force_n, most_m=5 * TOP_M):
    """Deformation at which a law given as F(δ) has this force."""
    return brentq(lambda x: force_of(x) - force_n, 0.0, most_m, xtol=1e-16, rtol=1e-12)


@pytest.mark.parametrize("n", [1.0, 1.37, 1.5, 2.0])
def test_a_power_law_has_the_secant_of_28(n):
    law = laws.power(TOP_N, TOP_M, n)
    k = TOP_N / TOP_M**n
    for force in FORCES_N:
        secant = (force ** (n - 1.0) * k) ** (1.0 / n)
        assert law.secant(force) == pytest.approx(secant, rel=1e-5)
        assert law.tangent(force) == pytest.approx(n * secant, rel=2e-3)
    from_m, to_m = (30.0 / k) ** (1 / n), (300.0 / k) ** (1 / n)
    assert law.chord(30.0, 300.0) == pytest.approx(270.0 / (to_m - from_m), rel=1e-5)
    assert law.secant_from_plane(300.0) is None


@pytest.mark.parametrize("share", [0.01, 0.03, 0.076])
def test_a_rough_sphere_is_that_of_10_beside_the_blend(share):
    law = laws.rough(TOP_N, TOP_M, share * TOP_M)
    kappa = 40.0
    sphere = RoughSphere(TOP_N / TOP_M**1.5, share * TOP_M * kappa**0.16, kappa)
    touch_m = 1.5715 * share * TOP_M
    assert law.plane_m == pytest.approx(touch_m, rel=1e-3)
    compared = 0
    for force in np.geomspace(1e-4 * TOP_N, TOP_N, 60):
        if 0.39 < sphere.pressure_ratio(force) < 0.55:
            continue
        compared += 1
        from_plane = sphere.deformation(force)
        assert float(law.deformation(force)) == pytest.approx(from_plane - law.plane_m, rel=2e-4)
        assert law.secant_from_plane(force) == pytest.approx(force / from_plane, rel=2e-4)
    assert compared > 30


def test_a_pad_over_a_stiff_body():
    knee, ratio = 0.4, 5.0
    law = laws.bilinear(TOP_N, TOP_M, knee, ratio)
    soft = TOP_N / (TOP_M * (knee + ratio * (1.0 - knee)))
    at_knee = soft * knee * TOP_M
    for force in FORCES_N:
        beyond = max(force - at_knee, 0.0)
        path = min(force, at_knee) / soft + beyond / (ratio * soft)
        assert law.secant(force) == pytest.approx(force / path, rel=1e-4)
    assert law.tangent(300.0) == pytest.approx(ratio * soft, rel=1e-6)
    assert law.tangent(0.5 * at_knee) == pytest.approx(soft, rel=1e-6)


def test_a_sphere_that_meets_a_stop():
    law = laws.stiffening(TOP_N, TOP_M, 1.5, 0.5, 3.0)
    unit = TOP_N / (1.0 + 3.0 * 0.5**1.2)

    def force_of(path_m):
        x = path_m / TOP_M
        return unit * (x**1.5 + 3.0 * max(x - 0.5, 0.0) ** 1.2)

    for force in FORCES_N:
        assert float(law.deformation(force)) == pytest.approx(solved(force_of, force), rel=1e-4)
    step = 1e-4 * TOP_M
    slope = (force_of(TOP_M) - force_of(TOP_M - step)) / step
    assert law.tangent(TOP_N) == pytest.approx(slope, rel=2e-3)


@pytest.mark.parametrize("share", [0.01, 0.05, 0.2])
def test_adhesion_is_jkr_in_other_units(share):
    """JKR written with radius, modulus and work of adhesion; contact radius by root finding."""
    law = laws.adhesive(TOP_N, TOP_M, share * TOP_N)
    radius_m = 0.03
    pull_n = share * TOP_N
    work = pull_n / (1.5 * math.pi * radius_m)

    def state(a, modulus):
        force = 4 * modulus * a**3 / (3 * radius_m) - math.sqrt(8 * math.pi * work * modulus * a**3)
        return force, a**2 / radius_m - math.sqrt(2 * math.pi * work * a / modulus)

    def path(force, modulus):
        closed = (2 * math.pi * work * radius_m**2 / modulus) ** (1 / 3)
        a = brentq(lambda a: state(a, modulus)[0] - force, closed * (1 - 1e-9), 0.1, xtol=1e-15)
        return state(a, modulus)[1]

    modulus = math.exp(brentq(lambda e: path(TOP_N, math.exp(e)) - TOP_M, 17.0, 26.0))
    assert law.force_n[0] == pytest.approx(-8.0 / 9.0 * pull_n, rel=1e-3)
    assert law.deformation_m[0] == pytest.approx(0.0, abs=1e-12)
    from_zero_m = path(TOP_N, modulus) - path(0.0, modulus)
    assert law.secant(TOP_N) == pytest.approx(TOP_N / from_zero_m, rel=1e-3)
    for force in (0.0, *FORCES_N):
        assert float(law.deformation(force)) == pytest.approx(path(force, modulus), rel=1e-3)


@pytest.mark.parametrize("over", [1.3, 4.0, 7.0])
def test_a_sphere_that_yields_follows_14(over):
    limit_n, limit_m = TOP_N / over, TOP_M / over ** (2 / 3)
    law = laws.flowing(TOP_N, limit_n, limit_m)
    sphere = ElasticPlasticSphere(limit_n, limit_m)
    for force in FORCES_N:
        expected = sphere.deformation(force)
        assert float(law.deformation(force)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("name", KNOWN)
def test_chord_secant_and_tangent_of_every_world_follow_from_its_force(name):
    """The law inverted by root finding, so that only F(δ) is looked at."""
    case = make(KNOWN, name, 7)
    law, top_n = case.law, case.rig.top_n
    end_m = float(law.deformation_m[-1])

    def path(share):
        return brentq(lambda x: float(law.force(x)) - share * top_n, 0.0, end_m, xtol=1e-13 * end_m)

    at = {share: path(share) for share in (0.1, 0.999, 1.0)}
    assert law.chord(0.1 * top_n, top_n) == pytest.approx(0.9 * top_n / (at[1.0] - at[0.1]), 1e-6)
    at_zero = float(np.interp(0.0, law.force_n, law.deformation_m))
    assert law.secant(top_n) == pytest.approx(top_n / (at[1.0] - at_zero), 1e-6)
    assert law.tangent(top_n) == pytest.approx(1e-3 * top_n / (at[1.0] - at[0.999]), 1e-4)
    assert law.chord(0.1 * top_n, top_n) > 0.0
