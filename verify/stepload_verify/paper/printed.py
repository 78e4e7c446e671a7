"""What the paper prints: payloads, rigs and tables, as text, so that the digits are kept."""

from __future__ import annotations

from typing import NamedTuple

from stepload.contact.materials import BluntTip, Geometry, Material, Sphere

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium 6061", 70e9, 0.33, 276e6)
STEEL = Material("steel", 200e9, 0.29)

ROUGHNESS_M = 7.5e-6
MICRO_HARDNESS_PA = 7.0e8
"""Not printed: chosen so that (10) comes near the finite-element row of Table II."""

SECANT_FORCE_N = 300.0
FORCE_GRID_N = tuple(30.0 * i for i in range(1, 11))


class Estimate(NamedTuple):
    """K̂ in N/m^n, n̂ and secant in N/m as printed."""

    k: str
    n: str
    secant: str


class Payload(NamedTuple):
    """A payload with its printed theory and its Table I: (test 1, test 2) of both estimators."""

    name: str
    geometry: Geometry
    material: Material
    k: str
    force_c: str
    rs_btls: tuple[Estimate, Estimate]
    rs_rtls: tuple[Estimate, Estimate]


PAYLOADS = (
    Payload(
        "plastic sphere",
        Sphere(0.0287),
        ACETAL,
        "6.57e8",
        "727",
        (Estimate("2.36e9", "1.64", "4.80e6"), Estimate("3.92e9", "1.70", "4.67e6")),
        (Estimate("1.64e9", "1.60", "4.73e6"), Estimate("5.17e9", "1.72", "4.75e6")),
    ),
    Payload(
        "plastic cone",
        BluntTip("cone", 0.0033),
        ACETAL,
        "2.23e8",
        "9.6",
        (Estimate("1.37e8", "1.48", "1.95e6"), Estimate("3.22e8", "1.57", "2.07e6")),
        (Estimate("1.18e8", "1.47", "1.93e6"), Estimate("3.24e8", "1.57", "2.04e6")),
    ),
    Payload(
        "plastic pyramid",
        BluntTip("pyramid", 0.00115),
        ACETAL,
        "1.32e8",
        "1.2",
        (Estimate("1.03e7", "1.27", "1.09e6"), Estimate("4.97e7", "1.43", "1.38e6")),
        (Estimate("9.32e6", "1.27", "1.06e6"), Estimate("1.27e8", "1.54", "1.37e6")),
    ),
    Payload(
        "aluminium sphere",
        Sphere(0.0287),
        ALUMINIUM,
        "8.87e9",
        "261",
        (Estimate("2.00e14", "2.45", "2.03e7"), Estimate("1.52e16", "2.81", "2.25e7")),
        (Estimate("3.51e10", "1.68", "1.86e7"), Estimate("6.06e13", "2.33", "2.33e7")),
    ),
)

FINITE_ELEMENTS = Estimate("1.82e10", "1.85", "4.81e6")
"""Table II, plastic sphere, σ_eq = 7.5 µm."""

FLAT_FACE = "2e8"
"""Secant stiffness of the aluminium cube and prism in N/m, about; they have no row in Table I."""

LOG_K_MAX = "6.9"
"""log10 of K_max of the STVF rig in N/m."""
