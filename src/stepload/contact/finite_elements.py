"""Contact of a finite body with a plate, by finite elements: what V-B of the paper computes.

The body is meshed by gmsh; scikit-fem (quadratic elements) gives the compliance of its surface
under a unit pressure at each node that may touch, with the end away from the plate held. The plate
is a half-space in closed form. A contact at a force is then a small problem: pressures above 0
where the bodies touch, a gap above 0 elsewhere. Small strains, no friction.
"""

from __future__ import annotations

import importlib
import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.contact.checks import require_forces
from stepload.contact.elastic import equivalent_modulus, equivalent_radius, plane_compliance
from stepload.contact.half_space import Gap, gap_of, half_space, rings
from stepload.contact.materials import (
    Body,
    Geometry,
    Material,
    Profile,
    RoundedCone,
    RoundedPyramid,
    Sphere,
)
from stepload.errors import BadInputError, DomainError

FloatArray = NDArray[np.float64]
VERSION = 2
"""Of the method; a curve that another version computed is not used again."""
PER_RADIUS = 24
"""Elements per contact radius of a body of revolution."""
PER_RADIUS_3D = 5
"""Of a pyramid."""
_MARGIN = 1.6
"""Radius in which contact is looked for, over that on a half-space."""
_NEAR = 4.0
"""Distance from the tip in which the stress is looked at, over the contact radius."""


@dataclass(frozen=True, slots=True)
class MeshCurve:
    """A contact curve by finite elements.

    Attributes:
        force_n, deformation_m: F and δ.
        contact_radius_m: largest distance from the axis that is touched.
        mises_pa: largest von Mises stress in the body.
        nodes: of the mesh.
    """

    force_n: FloatArray
    deformation_m: FloatArray
    contact_radius_m: FloatArray
    mises_pa: FloatArray
    nodes: int


@dataclass(frozen=True, slots=True)
class Surface:
    """Where a meshed body may touch the plate, and how both give way there.

    Attributes:
        height_m: of the nodes, above the plate that touches the tip.
        radius_m: of the nodes, from the axis.
        area_m2: force of a unit pressure at each node, on this part of the body.
        compliance: deformation of body and plate at node i under a unit pressure at node j, m/Pa.
        mises: largest von Mises stress in Pa near the contact under pressures at the nodes.
        parts: how many parts such as this make the body.
        nodes: of the mesh.
    """

    height_m: FloatArray
    radius_m: FloatArray
    area_m2: FloatArray
    compliance: FloatArray
    mises: Callable[[FloatArray], float]
    parts: int
    nodes: int

    def pressed(self, force_n: float) -> tuple[float, FloatArray]:
        """Deformation in m and pressures at the nodes in Pa at a force in N.

        Raises:
            DomainError: the contact is larger than the surface that was meshed for it.
        """
        height, share_n = self.height_m, force_n / self.parts
        touching = self.radius_m <= 0.6 * self.radius_m.max()
        for _ in range(200):
            inner = self.compliance[np.ix_(touching, touching)]
            rigid, shape = np.linalg.solve(
                inner, np.column_stack([np.ones(len(inner)), -height[touching]])
            ).T
            area = self.area_m2[touching]
            deformation_m = float((share_n - area @ shape) / (area @ rigid))
            pressure = np.zeros_like(height)
            pressure[touching] = rigid * deformation_m + shape
            gap = height + self.compliance @ pressure - deformation_m
            then = np.where(touching, pressure > 0.0, gap < -1e-15)
            if np.array_equal(then, touching):
                break
            touching = then
        if self.radius_m[touching].max() >= 0.999 * self.radius_m.max():
            raise DomainError(
                f"the contact leaves the meshed surface below {force_n:.4g} N",
                hint="press less, or describe a larger body",
            )
        return deformation_m, pressure


def contact_curve(
    geometry: Geometry,
    material: Material,
    plate: Material,
    force_n: ArrayLike,
    *,
    per_radius: float | None = None,
) -> MeshCurve:
    """Deformation, contact radius and largest von Mises stress of a finite body at forces.

    Args:
        geometry: sphere (its half, held at the equator), rounded cone or pyramid, or a profile with
            a body.
        material: of the payload.
        plate: material of the counter body, a half-space.
        force_n: forces in N, above 0.
        per_radius: elements per contact radius at the highest force; None: `PER_RADIUS` (`_3D`).

    Raises:
        BadInputError: scikit-fem or gmsh is not installed.
        DomainError: a number outside the theory, or a body without a size.

    Notes:
        Verscheure et al., section V-B. A cap of radius 28.7 mm on a block of 0.1 m
        differs from Hertz (7) by 0.2 % in force.
    """
    forces = require_forces(force_n)
    surface = _surface(geometry, material, plate, float(forces.max()), per_radius)
    rows = []
    for force in forces.tolist():
        deformation_m, pressure = surface.pressed(force)
        touched_m = float(surface.radius_m[pressure > 0.0].max())
        rows.append((deformation_m, touched_m, surface.mises(pressure)))
    deformations, touched, stresses = np.array(rows).T
    return MeshCurve(forces, deformations, touched, stresses, surface.nodes)


def yield_force(
    geometry: Geometry,
    material: Material,
    plate: Material,
    *,
    near_n: float,
    per_radius: float | None = None,
) -> float | None:
    """Force in N at which von Mises in the payload reaches its yield strength.

    Args:
        geometry, material, plate, per_radius: as `contact_curve`.
        near_n: a guess in N; the mesh is made for 1.5 times that.

    Returns:
        None where no yield strength is known, or the force is not within 1/20 … 1.5 of the guess.

    Raises:
        BadInputError, DomainError: as `contact_curve`.
    """
    strength_pa = material.yield_strength_pa
    if strength_pa is None:
        return None
    high_n = 1.5 * near_n
    surface = _surface(geometry, material, plate, high_n, per_radius)

    def over_pa(force_n: float) -> float:
        return surface.mises(surface.pressed(force_n)[1]) - strength_pa

    low_n = high_n / 30.0
    if over_pa(high_n) < 0.0 or over_pa(low_n) > 0.0:
        return None
    while high_n > 1.002 * low_n:
        middle_n = math.sqrt(low_n * high_n)
        low_n, high_n = (low_n, middle_n) if over_pa(middle_n) > 0.0 else (middle_n, high_n)
    return math.sqrt(low_n * high_n)


def size_of(geometry: Geometry) -> Body:
    """The finite body that is meshed.

    Raises:
        DomainError: the shape has no size.
    """
    match geometry:
        case Sphere(radius_m=radius, counter_radius_m=None):
            return Body(radius, radius)
        case RoundedCone() | RoundedPyramid() | Profile() if geometry.body is not None:
            return geometry.body
        case RoundedCone():
            top_m = float(gap_of(geometry).z(np.array(geometry.base_radius_m)))
            return Body(top_m, geometry.base_radius_m)
        case RoundedPyramid(half_angle_rad=angle, base_half_width_m=width):
            return Body(width / math.tan(angle) - geometry.rounded_m, width)
        case _:
            raise DomainError(
                "this shape has no size, so nothing can be meshed",
                hint="give rounded_cone, rounded_pyramid, or a profile with its `body`",
            )


def _surface(
    geometry: Geometry, material: Material, plate: Material, to_n: float, per_radius: float | None
) -> Surface:
    body, modulus_pa = size_of(geometry), equivalent_modulus(material, plate)
    if isinstance(geometry, RoundedPyramid):
        from stepload.contact.finite_elements_3d import pyramid_surface

        radius_m = equivalent_radius(geometry)
        assert radius_m is not None
        reach_m = (0.75 * to_n * radius_m / modulus_pa) ** (1.0 / 3.0)
        return pyramid_surface(
            geometry, body, material, plate, reach_m, per_radius or PER_RADIUS_3D
        )
    reach_m = float(half_space(geometry, modulus_pa, to_n).contact_radius_m[0])
    gap = gap_of(geometry)
    return _turned_surface(gap, body, material, plate, reach_m, per_radius or PER_RADIUS)


def libraries() -> tuple[Any, Any]:
    """scikit-fem and gmsh.

    Raises:
        BadInputError: one of them is not installed, or gmsh lacks a system library.
    """
    try:
        return importlib.import_module("skfem"), importlib.import_module("gmsh")
    except ImportError as error:
        raise BadInputError(
            f"finite elements need {error.name or 'scikit-fem'}, which is not installed",
            hint='pip install "stepload[fem]"',
        ) from error
    except OSError as error:
        raise BadInputError(
            f"gmsh cannot be loaded: {error}",
            hint="install the system's OpenGL utility library, on Debian: apt install libglu1-mesa",
        ) from error


@contextmanager
def meshing(gmsh: Any) -> Iterator[Any]:
    """A silent gmsh, left as it was found.

    gmsh lets a closed pipe end the process; Python's way, an error, is put back.
    """
    gmsh.initialize(interruptible=False)
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        yield gmsh.model
    finally:
        gmsh.finalize()


def made_mesh(gmsh: Any, kind: Any, dimension: int) -> Any:
    """The mesh that gmsh generates, as one of scikit-fem."""
    gmsh.model.mesh.generate(dimension)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    places = np.empty(int(tags.max()) + 1, dtype=np.int64)
    places[tags.astype(np.int64)] = np.arange(len(tags))
    _, _, joined = gmsh.model.mesh.getElements(dimension)
    corners = places[joined[0].astype(np.int64).reshape(-1, dimension + 1)]
    used, corners = np.unique(corners, return_inverse=True)
    points = xyz.reshape(-1, 3)[used, :dimension]
    return kind(points.T.copy(), corners.reshape(-1, dimension + 1).T.copy())


def lame(material: Material) -> tuple[float, float]:
    """λ and µ in Pa; an incompressible body is taken as nearly so."""
    modulus, ratio = material.youngs_modulus_pa, min(material.poisson_ratio, 0.499)
    return modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), 0.5 * modulus / (1.0 + ratio)


def compliances(stiffness: Any, load: Any, held: Any) -> FloatArray:
    """Displacements of all degrees of freedom under each load, with the `held` ones at 0."""
    from scipy.sparse.linalg import splu

    free = np.setdiff1d(np.arange(stiffness.shape[0]), held)
    factors = splu(
        stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    moved = np.zeros(load.shape)
    moved[free] = factors.solve(load[free].toarray())
    return moved


def _turned_surface(
    gap: Gap, body: Body, material: Material, plate: Material, reach_m: float, per_radius: float
) -> Surface:
    """Of a body of revolution: a mesh of its half section."""
    skfem, gmsh = libraries()
    mesh = _section(skfem, gmsh, gap, body, reach_m, per_radius)
    (x, z), tol = mesh.p, 1e-9 * body.height_m
    first, second = lame(material)

    def strains(u: Any, r: Any) -> tuple[Any, Any, Any, Any]:
        slopes = u.grad
        around = u[0] / np.maximum(r, 1e-300)
        return slopes[0, 0], slopes[1, 1], around, slopes[0, 1] + slopes[1, 0]

    def energy(u: Any, v: Any, w: Any) -> Any:
        a, b, c, shear = strains(u, w.x[0])
        d, e, f, other = strains(v, w.x[0])
        twice = first * (a + b + c) * (d + e + f) + 2.0 * second * (a * d + b * e + c * f)
        return 2.0 * math.pi * w.x[0] * (twice + second * shear * other)

    def pressing(h: Any, v: Any, w: Any) -> Any:
        return 2.0 * math.pi * w.x[0] * h * v[1] * np.abs(w.n[1])

    element = skfem.ElementVector(skfem.ElementTriP2())
    basis = skfem.Basis(mesh, element, intorder=4)
    outside = mesh.boundary_facets()
    on_gap = (np.abs(z - gap.z(x)) < 1e-7 * body.height_m) & (x <= 1.0001 * _MARGIN * reach_m)
    facets = outside[on_gap[mesh.facets[:, outside]].all(0)]
    nodes = np.unique(mesh.facets[:, facets])
    nodes = nodes[np.argsort(x[nodes])]
    flat = skfem.FacetBasis(mesh, skfem.ElementTriP1(), facets=facets, intorder=4)
    curved = skfem.FacetBasis(mesh, element, facets=facets, intorder=4)
    load = skfem.BilinearForm(pressing).assemble(flat, curved)[:, flat.nodal_dofs[0, nodes]]
    held = np.union1d(
        basis.get_dofs(lambda at: np.abs(at[1] - body.height_m) < tol).all(),
        basis.get_dofs(lambda at: at[0] < tol).all(["u^1"]),
    )
    moved = compliances(skfem.BilinearForm(energy).assemble(basis), load, held)
    upward = np.r_[basis.nodal_dofs[1], basis.facet_dofs[1]]
    near = skfem.Basis(mesh, element, intorder=4, elements=_near(mesh, reach_m))
    radii = near.global_coordinates()[0]

    def mises(pressure: FloatArray) -> float:
        a, b, c, shear = strains(near.interpolate(moved @ pressure), radii)
        trace = first * (a + b + c)
        return _mises((trace + 2.0 * second * each for each in (a, b, c)), [second * shear])

    own = moved[basis.nodal_dofs[1, nodes]]
    return Surface(
        z[nodes], x[nodes], np.asarray(load[upward].sum(0)).ravel(),
        own + plane_compliance(plate) * rings(x[nodes]), mises, 1, mesh.p.shape[1],
    )  # fmt: skip


def _section(skfem: Any, gmsh: Any, gap: Gap, body: Body, reach_m: float, per_radius: float) -> Any:
    """Half section of the body: one element along each piece of the profile that may touch."""
    end_m = min(gap.end_m, body.radius_m)
    radii, finest_m = [0.0], reach_m / per_radius
    while radii[-1] < end_m:
        last = radii[-1]
        inside = last < _MARGIN * reach_m
        step_m = max(finest_m, last / per_radius) if inside else 1.25 * (last - radii[-2])
        radii.append(last + step_m)
    radii[-1] = end_m
    if len(radii) > 3 and radii[-1] - radii[-2] < 0.3 * (radii[-2] - radii[-3]):
        del radii[-2]
    r = np.array(radii)
    heights = gap.z(r)
    sizes = np.append(np.diff(r), r[-1] - r[-2])
    if heights[-1] > body.height_m * (1.0 + 1e-9):
        raise DomainError(
            f"the profile rises to {heights[-1] * 1e3:.4g} mm, above the height of the body,"
            f" {body.height_m * 1e3:.4g} mm",
            hint="give the body's height from the tip",
        )
    corners = list(zip(r.tolist(), heights.tolist(), sizes.tolist(), strict=True))
    coarse_m = max(sizes[-1], body.height_m / 6.0)
    if body.radius_m > end_m * (1.0 + 1e-9):
        corners.append((body.radius_m, heights[-1], coarse_m))
    if heights[-1] < body.height_m * (1.0 - 1e-9):
        corners.append((max(body.radius_m, end_m), body.height_m, coarse_m))
    corners.append((0.0, body.height_m, coarse_m))
    with meshing(gmsh) as model:
        points = [model.geo.addPoint(x, z, 0.0, size) for x, z, size in corners]
        lines = [
            model.geo.addLine(*ends) for ends in zip(points, points[1:] + points[:1], strict=True)
        ]
        model.geo.addPlaneSurface([model.geo.addCurveLoop(lines)])
        model.geo.synchronize()
        for line in lines[: len(r) - 1]:
            model.mesh.setTransfiniteCurve(line, 2)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMax", body.height_m / 6.0)
        return made_mesh(gmsh, skfem.MeshTri, 2)


def _near(mesh: Any, reach_m: float, tip_m: float = 0.0) -> Any:
    """Elements about the tip, which is at this height of the axis."""
    middles = mesh.p[:, mesh.t].mean(1)
    middles[-1] -= tip_m
    return np.flatnonzero((middles**2).sum(0) < (_NEAR * reach_m) ** 2)


def _mises(normal: Any, shear: Any) -> float:
    """Largest von Mises stress of normal and shear stresses."""
    x, y, z = normal
    squares = 0.5 * ((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2)
    return float(np.sqrt(squares + 3.0 * sum(each**2 for each in shear)).max())
