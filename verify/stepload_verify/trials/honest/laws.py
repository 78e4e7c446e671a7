"""Loading laws δ(F) of the worlds, and what is true of each: chord, secants, tangent.

A law is a table of deformation over force, dense enough that linear interpolation is exact to
1e-6 of the deformation at the top, made from its own formula. δ counts from the first touch of the
world. An adhesive contact begins there with a pull and deforms before the force is positive; its
secant counts from the force of 0 N, as the program prints it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

POINTS = 4001
BEYOND = 1.3
"""Last force of a table over the top force: a sensor's gain error leads beyond the top."""
FIRST_SHARE = 1e-7
"""A smooth law's first tabulated force, as a share of the top."""
STEP = 1e-3
"""Relative step of the tangent, downwards: at a corner the loading side counts."""


@dataclass(frozen=True, slots=True)
class Law:
    """A virgin loading.

    Attributes:
        force_n, deformation_m: (M,) the table, both rising; deformation from the first touch on.
        plane_m: δ of the first touch counted from the mean plane; None where the contact has none.
        n: exponent that a power law of like curvature has; for loops and unloading only.
    """

    force_n: FloatArray
    deformation_m: FloatArray
    n: float
    plane_m: float | None = None

    def deformation(self, force_n: FloatArray | float) -> FloatArray:
        """Deformation (N,) in m since the first touch, loading."""
        return np.asarray(np.interp(force_n, self.force_n, self.deformation_m))

    def force(self, deformation_m: FloatArray | float) -> FloatArray:
        """Force (N,) in N at a deformation since the first touch, loading."""
        return np.asarray(np.interp(deformation_m, self.deformation_m, self.force_n))

    def chord(self, from_n: float, to_n: float) -> float:
        """(F2 − F1)/(δ(F2) − δ(F1)) in N/m."""
        path_m = float(self.deformation(to_n) - self.deformation(from_n))
        return (to_n - from_n) / path_m

    def secant(self, force_n: float) -> float:
        """F/δ (28) in N/m from the touch, which is where the force rises above 0 N."""
        return force_n / float(self.deformation(force_n) - self.deformation(0.0))

    def secant_from_plane(self, force_n: float) -> float | None:
        """F/δ in N/m from the mean plane of a rough surface; None where there is none."""
        if self.plane_m is None:
            return None
        return force_n / (float(self.deformation(force_n)) + self.plane_m)

    def tangent(self, force_n: float) -> float:
        """dF/dδ in N/m at a force, of the loading that leads there."""
        below_n = (1.0 - STEP) * force_n
        return self.chord(below_n, force_n)

    def compliance(self, force_n: FloatArray) -> FloatArray:
        """dδ/dF (N,) in m/N."""
        slope = np.gradient(self.deformation_m, self.force_n)
        return np.asarray(np.interp(force_n, self.force_n, slope))


def forces(top_n: float) -> FloatArray:
    """Forces (M,) of a table from 0 on, close together where laws bend."""
    spaced = np.geomspace(FIRST_SHARE, BEYOND, POINTS - 1)
    return np.asarray(top_n * np.concatenate(([0.0], spaced)))


def power(top_n: float, top_m: float, n: float) -> Law:
    """F = K δ^n (2) through (`top_m`, `top_n`)."""
    force = forces(top_n)
    return Law(force, top_m * (force / top_n) ** (1.0 / n), n)


def rough(top_n: float, smooth_top_m: float, scale_m: float) -> Law:
    """(10)–(12) over a smooth sphere with deformation `smooth_top_m` at the top force.

    The two branches of (12) do not meet at p0 = 0.47; they are blended over 0.40 … 0.54, which
    leaves the law monotone.

    Args:
        top_n: top force in N.
        smooth_top_m: Hertz deformation there in m.
        scale_m: σ κ^-0.16 in m.
    """
    force = forces(top_n)
    smooth_m = smooth_top_m * (force / top_n) ** (2.0 / 3.0)
    gap_m = 1.22 * scale_m
    p0 = smooth_m / (smooth_m + gap_m)
    edge = 8.0 / (math.pi**2 * (4.79 - 3.17 * p0**3.13))
    low = 0.5 * 1.605**2 * (smooth_m + gap_m) + edge * 1.605 * np.sqrt(p0) * smooth_m
    radius = 3.51 - 2.51 * p0
    high = 0.5 * radius**2 * smooth_m + edge * p0 * radius * smooth_m
    share = np.clip((p0 - 0.40) / 0.14, 0.0, 1.0)
    share = share**2 * (3.0 - 2.0 * share)
    from_plane = (1.0 - share) * low + share * high
    return Law(force, from_plane - from_plane[0], 1.5, plane_m=float(from_plane[0]))


def of_force(deformation_m: FloatArray, force_n: FloatArray, top_n: float, top_m: float,
             n: float) -> Law:  # fmt: skip
    """A law from F(δ) in any units, scaled so that it goes through (`top_m`, `top_n`) at δ = 1."""
    at_one = float(np.interp(1.0, deformation_m, force_n))
    table_n = forces(top_n)
    table_m = np.interp(table_n / top_n * at_one, force_n, deformation_m) * top_m
    return Law(table_n, np.asarray(table_m), n)


def _path() -> FloatArray:
    return np.concatenate(([0.0], np.geomspace(1e-7, 1.5, 20000)))


def bilinear(top_n: float, top_m: float, knee: float, ratio: float) -> Law:
    """A pad over a stiff body: linear, then `ratio` times stiffer from `knee` of the path on."""
    x = _path()
    y = np.where(x < knee, x, knee + ratio * (x - knee))
    return of_force(x, y, top_n, top_m, 1.0)


def stiffening(top_n: float, top_m: float, n: float, stop: float, ratio: float) -> Law:
    """A power law that meets a second spring from `stop` of the path on: a stop that closes."""
    x = _path()
    y = x**n + ratio * np.maximum(x - stop, 0.0) ** 1.2
    return of_force(x, y, top_n, top_m, n)


def adhesive(top_n: float, top_m: float, pull_n: float) -> Law:
    """JKR: jump into contact at δ = 0 with 8/9 of the pull-off force, then loading.

    In Maugis' units F = A³ − A √(6A), δ = A² − (2/3) √(6A); pull-off is 1.5.
    """
    unit_n = pull_n / 1.5
    radius = np.geomspace((8.0 / 3.0) ** (1.0 / 3.0), 1e4, 40000)
    force = radius**3 - radius * np.sqrt(6.0 * radius)
    path = radius**2 - 2.0 / 3.0 * np.sqrt(6.0 * radius)
    path[0] = 0.0
    unit_m = top_m / float(np.interp(top_n / unit_n, force, path))
    table_n = np.concatenate(
        (np.linspace(force[0] * unit_n, 0.0, 400, endpoint=False), forces(top_n))
    )
    table_m = np.interp(table_n / unit_n, force, path) * unit_m
    return Law(table_n, np.asarray(table_m), 1.5)


def flowing(top_n: float, limit_n: float, limit_m: float) -> Law:
    """The first loading of an elastic–plastic sphere (14), branches switched where they meet."""
    x = np.concatenate(([0.0], np.geomspace(1e-6, 110.0, 60000)))
    y = np.where(x < 1.483, x**1.5, 1.03 * x**1.425)
    y = np.where(x < 6.649, y, 1.40 * x**1.263)
    y = np.maximum.accumulate(y)
    force = forces(top_n)
    return Law(force, np.asarray(np.interp(force / limit_n, y, x)) * limit_m, 1.5)
