"""What a lateral force leaves of F_c, against an integration over the contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from long_ones import long

from stepload.contact.lateral import POISSON_RATIOS, left_of_limit


def mises(stress: np.ndarray) -> np.ndarray:
    """Of (M, 4) stresses σx, σy, σz, τxz."""
    x, y, z, shear = stress.T
    return np.sqrt(0.5 * ((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) + 3.0 * shear**2)


def below(nu: float, points: list[tuple[float, float]], tangential: float) -> np.ndarray:
    """Stresses (M, 4) under Hertz's pressure of peak 1 on the unit disc, with a traction along x of
    `tangential` times it, at points (x, 0, z): the point loads of Boussinesq and Cerruti summed."""
    nodes, weights = np.polynomial.legendre.leggauss(100)
    angle = (nodes + 1.0) * math.pi / 4.0
    radius, pressure = np.sin(angle), np.cos(angle)
    area = weights * math.pi / 4.0 * np.cos(angle) * radius * 2.0 * math.pi / 120
    turn = (np.arange(120) + 0.5) * 2.0 * math.pi / 120
    px, py = (np.multiply.outer(radius, f(turn)).ravel() for f in (np.cos, np.sin))
    load = np.repeat(pressure * area, 120) / (2.0 * math.pi)
    drag, k = tangential * load, 1.0 - 2.0 * nu
    found = []
    for at, z in points:
        x, y = at - px, -py
        flat = x * x + y * y
        r = np.sqrt(flat + z * z)
        s = r + z
        turned = k / flat * (1.0 - z / r) * (x * x - y * y) / flat
        sx = load * (turned + k * z * y * y / (flat * r**3) - 3.0 * z * x * x / r**5)
        sy = load * (-turned + k * z * x * x / (flat * r**3) - 3.0 * z * y * y / r**5)
        first, second = 1.0 / r**3, 1.0 / (r * s * s)
        third, fourth = 1.0 / (r**3 * s * s), 2.0 / (r * r * s**3)
        sx += drag * x * (-3.0 * x * x / r**5
                          + k * (first - 3.0 * second + x * x * (third + fourth)))  # fmt: skip
        sy += drag * x * (-3.0 * y * y / r**5
                          + k * (first - second + y * y * (third + fourth)))  # fmt: skip
        sz = -3.0 * (load * z**3 + drag * x * z * z) / r**5
        shear = -3.0 * (load * x * z * z + drag * x * x * z) / r**5
        found.append([sx.sum(), sy.sum(), sz.sum(), shear.sum()])
    return np.array(found)


def at_surface(nu: float, share: float) -> float:
    """Largest von Mises stress on the surface within the contact (Hamilton and Goodman)."""
    x = np.linspace(-1.0, 1.0, 400)
    pressure, square = np.sqrt(1.0 - x * x), np.maximum(x * x, 1e-12)
    ring = (1.0 - 2.0 * nu) / 3.0 / square * (1.0 - pressure**3)
    sx = ring - pressure - share * math.pi * x * (4.0 + nu) / 8.0
    sy = -ring - 2.0 * nu * pressure - share * 3.0 * math.pi * nu * x / 8.0
    return float(mises(np.stack([sx, sy, -pressure, -share * pressure], axis=1)).max())


GRID = [(float(x), z) for x in np.linspace(-0.1, 0.6, 15) for z in (0.38, 0.42, 0.46, 0.5)]


@pytest.mark.parametrize("row", [0, *long([2, 4])])
def test_the_table_is_that_of_an_integration_of_the_stresses(row: int) -> None:
    nu = POISSON_RATIOS[row]
    alone = mises(below(nu, GRID, 0.0)).max()
    assert alone == pytest.approx((0.0, 0.667, 0.620, 0.575)[1 + row // 2], abs=0.002)
    for share in (0.1, 0.2, 0.3, 0.6):
        largest = max(mises(below(nu, GRID, share)).max(), at_surface(nu, share))
        left = (alone / largest) ** 3
        assert left_of_limit(nu, share) == pytest.approx(left, abs=0.015), share


def test_the_stress_that_begins_yield_is_that_of_the_elastic_limit() -> None:
    # (13) is the force at which p_0 = P H, with P = 0.454 + 0.41 ν and H = 2.8 Y.
    nu = 0.3
    of_limit = 1.0 / (2.8 * (0.454 + 0.41 * nu))
    assert mises(below(nu, GRID, 0.0)).max() == pytest.approx(of_limit, rel=0.01)


@pytest.mark.parametrize("nu", [0.3, *long([0.2, 0.4])])
@pytest.mark.parametrize("share", [0.275, 0.45, 0.55])
def test_between_two_columns_no_more_is_left_than_the_stresses_leave(
    nu: float, share: float
) -> None:
    alone = mises(below(nu, GRID, 0.0)).max()
    largest = max(mises(below(nu, GRID, share)).max(), at_surface(nu, share))
    assert left_of_limit(nu, share) <= 1.005 * (alone / largest) ** 3


def test_between_two_ratios_the_smaller_counts() -> None:
    assert left_of_limit(0.27, 0.3) == left_of_limit(0.25, 0.3)
    assert left_of_limit(0.33, 0.3) == left_of_limit(0.35, 0.3)
    assert left_of_limit(-0.5, 0.3) == left_of_limit(0.2, 0.3)
