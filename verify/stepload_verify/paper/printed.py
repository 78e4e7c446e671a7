"""What the paper prints: payloads, rigs, tables and prose, as text, so that the digits are kept."""

from __future__ import annotations

from typing import NamedTuple

from stepload.contact.materials import BluntTip, Geometry, Material, Sphere

ACETAL = Material("acetal", 2.75e9, 0.3, 70e6)
ALUMINIUM = Material("aluminium 6061", 70e9, 0.33, 276e6)
STEEL = Material("steel", 200e9, 0.29)

ROUGHNESS_M = 7.5e-6
MICRO_HARDNESS_PA = 7.0e8
"""Not printed: chosen so that (10) comes near the row of the plastic sphere in Table II."""

SECANT_FORCE_N = 300.0
FORCE_GRID_N = tuple(30.0 * i for i in range(1, 11))


class Estimate(NamedTuple):
    """K̂ in N/m^n, n̂ and secant in N/m as printed."""

    k: str
    n: str
    secant: str


class Payload(NamedTuple):
    """A payload with its printed theory, its Table I, (test 1, test 2) of both estimators, and its
    Table II; the column "STVF, test 2" of that is `rs_btls[1]`."""

    name: str
    geometry: Geometry
    material: Material
    k: str
    force_c: str
    rs_btls: tuple[Estimate, Estimate]
    rs_rtls: tuple[Estimate, Estimate]
    instron: Estimate
    smooth: Estimate
    rough: Estimate


def _estimates(*texts: str) -> tuple[Estimate, ...]:
    return tuple(Estimate(*text.split()) for text in texts)


def _payload(
    name: str,
    geometry: Geometry,
    material: Material,
    theory: tuple[str, str],
    table_one: tuple[str, str, str, str],
    table_two: tuple[str, str, str],
) -> Payload:
    btls_1, rtls_1, btls_2, rtls_2 = _estimates(*table_one)
    return Payload(
        name, geometry, material, *theory, (btls_1, btls_2), (rtls_1, rtls_2),
        *_estimates(*table_two),
    )  # fmt: skip


SPHERE, CONE, PYRAMID, METAL = PAYLOADS = (
    _payload(
        "plastic sphere", Sphere(0.0287), ACETAL, ("6.57e8", "727"),
        ("2.36e9 1.64 4.80e6", "1.64e9 1.60 4.73e6", "3.92e9 1.70 4.67e6", "5.17e9 1.72 4.75e6"),
        ("3.85e10 1.94 4.61e6", "6.16e8 1.49 5.05e6", "1.82e10 1.85 4.81e6"),
    ),
    _payload(
        "plastic cone", BluntTip("cone", 0.0033), ACETAL, ("2.23e8", "9.6"),
        ("1.37e8 1.48 1.95e6", "1.18e8 1.47 1.93e6", "3.22e8 1.57 2.07e6", "3.24e8 1.57 2.04e6"),
        ("1.23e9 1.70 2.35e6", "1.49e8 1.46 2.36e6", "6.36e8 1.63 2.31e6"),
    ),
    _payload(
        "plastic pyramid", BluntTip("pyramid", 0.00115), ACETAL, ("1.32e8", "1.2"),
        ("1.03e7 1.27 1.09e6", "9.32e6 1.27 1.06e6", "4.97e7 1.43 1.38e6", "1.27e8 1.54 1.37e6"),
        ("8.41e7 1.47 1.50e6", "4.17e7 1.38 1.56e6", "9.64e7 1.48 1.54e6"),
    ),
    _payload(
        "aluminium sphere", Sphere(0.0287), ALUMINIUM, ("8.87e9", "261"),
        ("2.00e14 2.45 2.03e7", "3.51e10 1.68 1.86e7",
         "1.52e16 2.81 2.25e7", "6.06e13 2.33 2.33e7"),
        ("7.03e21 3.93 2.55e7", "1.00e10 1.51 2.88e7", "1.29e21 3.85 2.05e7"),
    ),
)  # fmt: skip

FLAT_FACE = "2e8"
"""Secant of the plastic cube and prism in N/m, about; they have no row in the tables."""
FACE_M = 0.06
"""Edge of their face: not printed, chosen for that secant."""
LOG_K_MAX = "6.9"
"""log10 of K_max of the STVF rig in N/m."""
K_S, C_S, MSDE_M = "3.49e6", "3.87e4", "5.42e-7"
"""System of the STVF: N/m, N·s/m, and the rms misfit of the line in m."""
INSTRON_K_S, INSTRON_MSDE_M = "1.62e7", "1.31e-6"
DEFORMATION_SNR, FORCE_SNR = "4e1", "2e2"
"""About 40 and about 200."""
OFF_HERTZ = {"spheres": "0.2", "plastic cone": "6", "plastic pyramid": "13"}
"""Largest force error of the finite elements against Hertz, in %; of the spheres below that."""
CHANGES = {"plastic cone": "6", "plastic pyramid": "27", "aluminium sphere": "11"}
"""Change of the RS-BTLS secant from test 1 to test 2, in % of test 1."""
OVERLOAD = "31"
"""300 N in F_c of the cone."""
ESTIMATORS_WITHIN, PLASTIC_WITHIN, METAL_WITHIN = "5", "10", "25"
"""In %: secants of both estimators ("a few per cent", read as five); of STVF, Instron and finite
elements for the plastic payloads ("typically within or close to"); for the aluminium sphere."""
