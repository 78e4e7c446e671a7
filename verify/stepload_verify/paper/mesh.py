"""The paper's payloads by finite elements. What they give is kept beside this module.

The command `python -m stepload_verify.paper.mesh` writes it anew; it needs `stepload[fem]`.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np

from stepload.contact.materials import Body, Geometry, Profile, RoundedCone, RoundedPyramid
from stepload.identification.ls import rs_btls
from stepload_verify.paper.printed import (
    ALUMINIUM,
    CONE,
    FORCE_GRID_N,
    METAL,
    PAYLOADS,
    PYRAMID,
    SECANT_FORCE_N,
    SPHERE,
    Payload,
)
from stepload_verify.paper.step_load import FloatArray

CURVES, MESHES = (Path(__file__).with_name(f"{name}.csv") for name in ("curves", "meshes"))
FORCES_N = (3.0, 10.0, *FORCE_GRID_N)
CONE_HALF_ANGLE, PYRAMID_HALF_ANGLE, BASE_M = math.radians(36.0), math.radians(34.0), 0.025
"""Not printed. The base is chosen, the half-angles then for the printed secants."""
BALL_HELD = 1.75
"""Height over radius where the spheres are held, on a cylinder below their equator: not printed,
chosen for Hertz within 0.2 %."""


def _ball(radius_m: float) -> Profile:
    reach_m = 0.98 * radius_m
    radii_m = (0.0, *np.geomspace(1e-3 * radius_m, reach_m, 250).tolist())
    table_m = tuple((r, radius_m - math.sqrt(radius_m**2 - r**2)) for r in radii_m)
    return Profile(table_m=table_m, body=Body(BALL_HELD * radius_m, reach_m))


BODIES: dict[str, Geometry] = {
    SPHERE.name: _ball(0.0287),
    CONE.name: RoundedCone(0.0033, CONE_HALF_ANGLE, BASE_M),
    PYRAMID.name: RoundedPyramid(0.00115, PYRAMID_HALF_ANGLE, BASE_M),
    METAL.name: _ball(0.0287),
}
FINENESS = {PYRAMID.name: (3.0, 4.0, 5.0)}
"""Elements per contact radius that are tried; the last gives the curve. Others: `_FINENESS`."""
_FINENESS = (6.0, 12.0, 24.0)


@cache
def kept() -> dict[str, tuple[FloatArray, FloatArray]]:
    """Force in N and deformation in m (N,) of each payload on the aluminium plate."""
    found: dict[str, list[tuple[float, float]]] = {}
    for row in _rows(CURVES):
        pair = float(row["force_n"]), float(row["deformation_m"])
        found.setdefault(row["payload"], []).append(pair)
    return {name: (np.array(pairs)[:, 0], np.array(pairs)[:, 1]) for name, pairs in found.items()}


def meshes() -> list[dict[str, str]]:
    """Every mesh that was tried: payload, per_radius, nodes, seconds, k, n, secant, yield_n."""
    return _rows(MESHES)


def computed(payload: Payload, per_radius: float) -> tuple[FloatArray, FloatArray, int]:
    """Deformation in m (N,) at `FORCES_N`, largest von Mises stress in Pa (N,), and nodes."""
    from stepload.contact.finite_elements import contact_curve

    body = BODIES[payload.name]
    curve = contact_curve(body, payload.material, ALUMINIUM, FORCES_N, per_radius=per_radius)
    return curve.deformation_m, curve.mises_pa, curve.nodes


def main() -> None:
    """Mesh all payloads, and write both files."""
    from stepload.contact.finite_elements import yield_force

    curves, tried = [], list[list[object]]()
    for payload in PAYLOADS:
        for per_radius in FINENESS.get(payload.name, _FINENESS):
            began = time.perf_counter()
            deformation, _, nodes = computed(payload, per_radius)
            seconds = time.perf_counter() - began
            fit = rs_btls(deformation[2:], np.array(FORCE_GRID_N), secant_force_n=SECANT_FORCE_N)
            tried.append([payload.name, f"{per_radius:g}", nodes, f"{seconds:.1f}", f"{fit.k:.4g}",
                          f"{fit.n:.4g}", f"{fit.secant_n_per_m:.4g}"])  # fmt: skip
        onset = None
        if payload is not PYRAMID:  # at 1.2 N its mesh would take gigabytes
            near_n = float(payload.force_c)
            onset = yield_force(BODIES[payload.name], payload.material, ALUMINIUM, near_n=near_n)
        tried[-1].append(f"{onset:.3g}" if onset else "")
        curves += [(payload.name, f"{f:g}", f"{d:.6e}")
                   for f, d in zip(FORCES_N, deformation, strict=True)]  # fmt: skip
    _write(CURVES, ("payload", "force_n", "deformation_m"), curves)
    _write(MESHES, ("payload", "per_radius", "nodes", "seconds", "k", "n", "secant", "yield_n"),
           tried)  # fmt: skip


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file, restval=""))


def _write(path: Path, head: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    with path.open("w", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])


if __name__ == "__main__":
    main()
