"""Rigs of four families, scaled to a peak force anywhere from 0.1 mN to 1 kN."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

LEAST_N, MOST_N = 1e-4, 1e3


@dataclass(frozen=True, slots=True)
class Rig:
    """A rig and how it sees a payload; SI, standard uncertainties relative where they are shares.

    Attributes:
        family: what kind of instrument it resembles.
        top_n: peak force.
        depth_m: the payload's deformation there, about.
        stiffness_n_per_m: K_s as declared; `stiffness_sigma` of it is its uncertainty.
        position_resolution_m, position_noise_m, force_resolution_n, force_noise_n: per sample.
        smooth_m: sd of the smooth error; `smooth_length_n` its correlation length.
        gain_sigma, lag_sigma_s: of force calibration and alignment.
        rate_hz: of the samples.
    """

    family: str
    top_n: float
    depth_m: float
    stiffness_n_per_m: float
    stiffness_sigma: float
    position_resolution_m: float
    position_noise_m: float
    force_resolution_n: float
    force_noise_n: float
    smooth_m: float
    smooth_length_n: float
    gain_sigma: float
    lag_sigma_s: float
    rate_hz: float

    @property
    def bend_m(self) -> float:
        """Deflection of the load path at the top."""
        return self.top_n / self.stiffness_n_per_m


@dataclass(frozen=True, slots=True)
class Family:
    """Ranges to draw from, log-uniform; those without a unit are shares of depth or top force.

    `compliance` is the load path's deflection over the payload's, `quanta` the depth in position
    quanta, `jitter` position noise in quanta.
    """

    name: str
    forces_n: tuple[float, float]
    depth_m: tuple[float, float]
    compliance: tuple[float, float]
    quanta: tuple[float, float]
    jitter: tuple[float, float]
    force_quantum: tuple[float, float]
    force_noise: tuple[float, float]
    smooth: tuple[float, float]
    stiffness_sigma: tuple[float, float]
    gain_sigma: tuple[float, float]


FAMILIES = (
    Family("afm", (1e-4, 5e-3), (2e-8, 2e-6), (0.1, 1.5), (200, 3000), (0.3, 1.0),
           (1e-5, 1e-4), (1e-3, 5e-3), (2e-3, 8e-3), (0.008, 0.02), (0.008, 0.02)),
    Family("indenter", (5e-3, 20.0), (1e-7, 3e-5), (0.05, 1.0), (500, 10000), (0.5, 2.0),
           (1e-5, 1e-4), (2e-4, 2e-3), (1e-3, 5e-3), (0.005, 0.02), (0.002, 0.005)),
    Family("stvf", (20.0, 1000.0), (3e-5, 1.5e-4), (0.5, 1.6), (30, 100), (0.05, 0.3),
           (2e-3, 6e-3), (1e-3, 3e-3), (3e-3, 9e-3), (0.007, 0.012), (0.003, 0.006)),
    Family("ur", (5.0, 150.0), (2e-4, 3e-3), (0.15, 1.2), (50, 300), (0.2, 1.0),
           (5e-4, 2e-3), (1e-3, 5e-3), (3e-3, 1e-2), (0.008, 0.02), (0.005, 0.01)),
)  # fmt: skip

RESOLVED = 1.3
"""Least factor by which an ideal payload is softer than K_max (34), with p = 2, s = 20, t = 5."""


def between(low: float, high: float, rng: np.random.Generator) -> float:
    """A log-uniform draw."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def draw_rig(rng: np.random.Generator) -> Rig:
    """A rig that can identify its payload where nothing else is wrong."""
    while True:
        top_n = between(LEAST_N, MOST_N, rng)
        fitting = [each for each in FAMILIES if each.forces_n[0] <= top_n <= each.forces_n[1]]
        rig = _draw(fitting[int(rng.integers(len(fitting)))], top_n, rng)
        resolution_m = max(rig.position_resolution_m, 2.0 * rig.position_noise_m)
        if rig.depth_m > RESOLVED * max(20.0 * resolution_m, 10.0 * resolution_m + rig.bend_m / 4):
            return rig


def _draw(family: Family, top_n: float, rng: np.random.Generator) -> Rig:
    depth_m = between(*family.depth_m, rng)
    quantum_m = depth_m / between(*family.quanta, rng)
    bend_m = depth_m * between(*family.compliance, rng)
    return Rig(
        family=family.name,
        top_n=top_n,
        depth_m=depth_m,
        stiffness_n_per_m=top_n / bend_m,
        stiffness_sigma=between(*family.stiffness_sigma, rng),
        position_resolution_m=quantum_m,
        position_noise_m=quantum_m * between(*family.jitter, rng),
        force_resolution_n=top_n * between(*family.force_quantum, rng),
        force_noise_n=top_n * between(*family.force_noise, rng),
        smooth_m=depth_m * between(*family.smooth, rng),
        smooth_length_n=top_n * between(1.0 / 12.0, 0.5, rng),
        gain_sigma=between(*family.gain_sigma, rng),
        lag_sigma_s=1e-3,
        rate_hz=float(rng.choice([100.0, 125.0, 200.0, 250.0])),
    )
