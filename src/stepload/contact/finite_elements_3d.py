"""The rounded pyramid by finite elements: a quarter of the body, by its two planes of symmetry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepload.contact.elastic import plane_compliance
from stepload.contact.finite_elements import (
    _MARGIN,
    Surface,
    _mises,
    _near,
    compliances,
    lame,
    libraries,
    made_mesh,
    meshing,
)
from stepload.contact.materials import Body, Material, RoundedPyramid
from stepload.errors import DomainError

FloatArray = NDArray[np.float64]
_GROWTH = 0.35
"""Growth of the element size with the distance from the contact."""


def pyramid_gap(pyramid: RoundedPyramid, x: FloatArray, y: FloatArray) -> FloatArray:
    """Height in m of the rounded pyramid's surface above its tip: faces, edges and tip.

    The body is the sum (Minkowski) of a sharp pyramid and a ball.
    """
    radius, slope = pyramid.radius_m, 1.0 / math.tan(pyramid.half_angle_rad)
    x, y = np.maximum(x, y), np.minimum(x, y)
    face = radius + slope * x - radius / math.sin(pyramid.half_angle_rad)
    across2 = np.maximum(radius**2 - 0.5 * (x - y) ** 2, 0.0)
    along = 0.5 * (x + y)
    s = np.maximum(along - slope * np.sqrt(across2 / (4.0 + 2.0 * slope**2)), 0.0)
    edge = radius + slope * s - np.sqrt(np.maximum(across2 - 2.0 * (s - along) ** 2, 0.0))
    return np.where(x - radius * math.cos(pyramid.half_angle_rad) >= y, face, edge)


def pyramid_surface(
    pyramid: RoundedPyramid,
    body: Body,
    material: Material,
    plate: Material,
    reach_m: float,
    per_radius: float,
) -> Surface:
    """Where a pyramid may touch, meshed for a contact radius of about `reach_m`.

    Raises:
        BadInputError: scikit-fem or gmsh is not installed.
        DomainError: the contact is large against the pyramid.
    """
    skfem, gmsh = libraries()
    slope = 1.0 / math.tan(pyramid.half_angle_rad)
    rounded_m = pyramid.rounded_m
    top_m = body.height_m + rounded_m
    about_m = _MARGIN * reach_m * math.hypot(1.0, slope)
    if about_m > 0.9 * top_m:
        raise DomainError(
            f"the contact, some {reach_m * 1e3:.3g} mm, is large against the pyramid",
            hint="press less, or describe a larger body",
        )
    sharp = _sharp(skfem, gmsh, pyramid, body, top_m, reach_m / per_radius, about_m)
    points = sharp.p.copy()
    edge = slope * np.maximum(points[0], points[1])
    on_face = np.abs(points[2] - edge) < 1e-9 * top_m
    # The sharp tip is moved to the round one, what lies above it less and less, the top not at all.
    share = np.clip(1.0 - (points[2] - edge) / (6.0 * rounded_m), 0.0, 1.0)
    share *= np.clip((top_m - points[2]) / (top_m - about_m), 0.0, 1.0)
    points[2] += share * (pyramid_gap(pyramid, points[0], points[1]) + rounded_m - edge)
    mesh, tol = skfem.MeshTet(points, sharp.t), 1e-9 * top_m
    first, second = lame(material)

    def strains(u: Any) -> Any:
        return 0.5 * (u.grad + np.swapaxes(u.grad, 0, 1))

    def energy(u: Any, v: Any, w: Any) -> Any:
        e, f = strains(u), strains(v)
        trace = (e[0, 0] + e[1, 1] + e[2, 2]) * (f[0, 0] + f[1, 1] + f[2, 2])
        return first * trace + 2.0 * second * np.einsum("ij...,ij...", e, f)

    def pressing(h: Any, v: Any, w: Any) -> Any:
        return h * v[2] * np.abs(w.n[2])

    element = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(mesh, element, intorder=2)
    held = np.unique(
        np.concatenate(
            [
                basis.get_dofs(lambda at: np.abs(at[2] - top_m) < tol).all(),
                basis.get_dofs(lambda at: at[0] < tol).all(["u^1"]),
                basis.get_dofs(lambda at: at[1] < tol).all(["u^2"]),
            ]
        )
    )
    radius_m = np.hypot(points[0], points[1])
    outside = mesh.boundary_facets()
    touching = on_face & (radius_m < _MARGIN * reach_m)
    facets = outside[touching[mesh.facets[:, outside]].all(0)]
    nodes = np.unique(mesh.facets[:, facets])
    flat = skfem.FacetBasis(mesh, skfem.ElementTetP1(), facets=facets, intorder=4)
    curved = skfem.FacetBasis(mesh, element, facets=facets, intorder=4)
    load = skfem.BilinearForm(pressing).assemble(flat, curved)[:, flat.nodal_dofs[0, nodes]]
    moved = compliances(skfem.BilinearForm(energy).assemble(basis), load, held)
    upward = np.r_[basis.nodal_dofs[2], basis.edge_dofs[2]]
    area = np.asarray(load[upward].sum(0)).ravel()
    near_tip = _near(mesh, reach_m, rounded_m)
    inner = near_tip[~on_face[mesh.t[:, near_tip]].any(0)]
    near = skfem.Basis(mesh, element, intorder=2, elements=inner)

    def mises(pressure: FloatArray) -> float:
        e = strains(near.interpolate(moved @ pressure))
        trace = first * (e[0, 0] + e[1, 1] + e[2, 2])
        return _mises(
            (trace + 2.0 * second * e[i, i] for i in range(3)),
            [2.0 * second * e[i, j] for i, j in ((0, 1), (1, 2), (0, 2))],
        )

    x, y, z = points[:, nodes]
    own = moved[basis.nodal_dofs[2, nodes]]
    return Surface(
        z - rounded_m, radius_m[nodes], area,
        own + plane_compliance(plate) * _mirrored(x, y, area, tol), mises, 4, mesh.p.shape[1],
    )  # fmt: skip


def _sharp(
    skfem: Any, gmsh: Any, pyramid: RoundedPyramid, body: Body, top_m: float, finest_m: float,
    about_m: float,
) -> Any:  # fmt: skip
    """A quarter of the sharp pyramid, with the block that it stands on; its tip at 0."""
    width = pyramid.base_half_width_m
    base_m = width / math.tan(pyramid.half_angle_rad)
    with meshing(gmsh) as model:
        occ = model.occ
        corners = [(0.0, 0.0, 0.0), (width, 0.0, base_m), (width, width, base_m),
                   (0.0, width, base_m), (0.0, 0.0, base_m)]  # fmt: skip
        points = [occ.addPoint(*corner) for corner in corners]
        lines: dict[tuple[int, int], int] = {}

        def side(*ring: int) -> Any:
            loop = []
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                if (a, b) not in lines:
                    lines[a, b] = occ.addLine(points[a], points[b])
                    lines[b, a] = -lines[a, b]
                loop.append(lines[a, b])
            return occ.addPlaneSurface([occ.addCurveLoop(loop)])

        sides = [side(0, 1, 2), side(0, 2, 3), side(4, 1, 2, 3), side(0, 1, 4), side(0, 3, 4)]
        volume = occ.addVolume([occ.addSurfaceLoop(sides)])
        if top_m > base_m * (1.0 + 1e-9):
            wide = max(width, body.radius_m)
            block = occ.addBox(0.0, 0.0, base_m, wide, wide, top_m - base_m)
            occ.fuse([(3, volume)], [(3, block)])
        occ.synchronize()
        sizes = model.mesh.field.add("MathEval")
        away = f"(Sqrt(x*x+y*y+z*z)-{about_m!r})*{_GROWTH}"
        model.mesh.field.setString(sizes, "F", f"Max({finest_m!r},{finest_m!r}+{away})")
        model.mesh.field.setAsBackgroundMesh(sizes)
        for name in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{name}", 0)
        return made_mesh(gmsh, skfem.MeshTet, 3)


def _mirrored(x: FloatArray, y: FloatArray, area_m2: FloatArray, tol: float) -> FloatArray:
    """Deformation at each node of a half-space of E = 1 - ν² under a unit pressure at each.

    A node acts with its images in the two planes of symmetry: as a point load at others (1/r), at
    its own place as a disc of the same area.
    """
    found = np.zeros((len(x), len(x)))
    images = np.where(x < tol, 2.0, 1.0) * np.where(y < tol, 2.0, 1.0)
    at_itself = 2.0 * np.sqrt(area_m2 * images / math.pi) / images
    for sign_x in (1.0, -1.0):
        for sign_y in (1.0, -1.0):
            apart = np.hypot(x[:, None] - sign_x * x, y[:, None] - sign_y * y)
            alone = apart < 1e-12
            far = area_m2 / (math.pi * np.where(alone, 1.0, apart))
            found += np.where(alone, np.broadcast_to(at_itself, apart.shape), far)
    return found
