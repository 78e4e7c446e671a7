"""The curve of a payload before it is pressed: by finite elements, kept once computed, or theory.

Curves of finite elements are kept by content in the user's cache directory (`XDG_CACHE_HOME`, or
~/.cache), one JSON file each. A file that cannot be read or written is as one that is not there.
"""

from __future__ import annotations

import hashlib
import os
import time
from contextlib import suppress
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from stepload.contact.checks import require_positive
from stepload.contact.curve_factors import TipFactors
from stepload.contact.elastic import equivalent_modulus, equivalent_radius, law_for
from stepload.contact.finite_elements import (
    PER_RADIUS,
    PER_RADIUS_3D,
    VERSION,
    contact_curve,
    size_of,
    yield_force,
)
from stepload.contact.half_space import SHARES, half_space
from stepload.contact.limit import onset_in
from stepload.contact.material_range import is_range
from stepload.contact.materials import Body, Profile, RoundedCone, RoundedPyramid, Sphere
from stepload.contact.power_law import ContactLaw
from stepload.declaration.sections import adapter
from stepload.errors import DomainError
from stepload.identification.fit import Fit, FloatArray
from stepload.identification.ls import rs_btls
from stepload.plan.model import Payload
from stepload.plan.whole_file import replace_file

MESHED = "finite elements"
MOST_OFF = 5.0
"""Factor from the half-space in the secant beyond which a kept curve is not believed."""
MOST_COARSE = 0.25
"""Share by which the meshes of a kept curve differ at most."""
COARSER = 0.7
"""Elements per contact radius of the second mesh, over those of the first."""


@dataclass(frozen=True, slots=True)
class Meshed:
    """A curve by finite elements, on 10 … 100 % of a highest force.

    Attributes:
        force_n, deformation_m, contact_radius_m, mises_pa: as `MeshCurve`.
        coarse_deformation_m: of the second, coarser mesh.
        nodes, coarse_nodes: of both meshes.
        yield_force_n: where von Mises reaches Y; None where that is not known or not near.
        computed_s: time that it took.
    """

    force_n: tuple[float, ...]
    deformation_m: tuple[float, ...]
    contact_radius_m: tuple[float, ...]
    mises_pa: tuple[float, ...]
    coarse_deformation_m: tuple[float, ...]
    nodes: int
    coarse_nodes: int
    yield_force_n: float | None
    computed_s: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """F(δ) of a payload, and what the paper's estimator (25) makes of it.

    `fit` is that of the curve as asked for, `coarse` that of the smooth curve of the coarser mesh
    and `smooth` of the finer one; `hertz_share` is the largest difference of force from Hertz (7)
    at the tip, over the highest force. None where there is no mesh, or no tip radius.
    """

    theory: str
    force_n: FloatArray
    deformation_m: FloatArray
    fit: Fit
    smooth: Fit
    coarse: Fit | None
    hertz_share: float | None
    mesh: Meshed | None


def predict(
    payload: Payload, to_n: float, *, factors: TipFactors | None = None, mesh: bool = True
) -> Prediction:
    """The curve of a payload on 10 … 100 % of a force.

    Args:
        to_n: highest force in N.
        factors: of roughness (10) and yield (15), on the deformation.
        mesh: by finite elements where the shape has a size; else as on a half-space.

    Raises:
        BadInputError: scikit-fem or gmsh is not installed.
        DomainError: a number outside the domain of the theory.
    """
    require_positive(to_n, "highest force", "N")
    geometry, material, plate = bodies = (payload.geometry, payload.material, payload.plate)
    force_n, radius_m = to_n * np.array(SHARES), equivalent_radius(geometry)
    found = meshed(payload, to_n) if mesh and has_size(payload) else None
    if found is not None:
        smooth_m, theory = np.array(found.deformation_m), MESHED
    elif isinstance(geometry, RoundedCone | Profile):
        curve = half_space(geometry, equivalent_modulus(material, plate), force_n)
        smooth_m, theory = curve.deformation_m, "half-space"
    else:
        law = law_for(*bodies)
        smooth_m, theory = np.array([law.deformation(f) for f in force_n.tolist()]), law.equation
    hertz_share = None
    if radius_m is not None:
        hertz = law_for(Sphere(radius_m), material, plate)
        hertz_share = float(np.abs(force_n - hertz.k * smooth_m**hertz.n).max() / to_n)
    deformation_m = smooth_m if factors is None else smooth_m * factors.factor(force_n)
    return Prediction(
        theory, force_n, deformation_m,
        rs_btls(deformation_m, force_n, secant_force_n=to_n),
        rs_btls(smooth_m, force_n, secant_force_n=to_n),
        rs_btls(found.coarse_deformation_m, force_n, secant_force_n=to_n) if found else None,
        hertz_share, found,
    )  # fmt: skip


def has_size(payload: Payload) -> bool:
    """Whether the payload's shape is one that can be meshed."""
    with suppress(DomainError):
        size_of(payload.geometry)
        return True
    return False


def meshed(payload: Payload, to_n: float) -> Meshed:
    """The curve by finite elements, computed and kept where it is not there yet.

    Raises:
        BadInputError: scikit-fem or gmsh is not installed.
        DomainError: a number outside the domain of the theory.
    """
    if (kept := _read(_file_of(payload, to_n))) is not None:
        return kept
    started_s = time.perf_counter()
    bodies = payload.geometry, payload.material, payload.plate
    force_n = to_n * np.array(SHARES)
    solid = isinstance(payload.geometry, RoundedPyramid)
    coarse = contact_curve(
        *bodies, force_n, per_radius=COARSER * (PER_RADIUS_3D if solid else PER_RADIUS)
    )
    fine = contact_curve(*bodies, force_n)
    onset_n = None
    with suppress(DomainError):  # beyond the profile that is known
        if (strength_pa := payload.material.yield_strength_pa) is not None:
            near = int(np.abs(fine.mises_pa - strength_pa).argmin())
            near_n = float(force_n[near] * (strength_pa / fine.mises_pa[near]) ** 3)
            tip = onset_in(payload.material, *bodies)
            if tip is not None and fine.mises_pa[0] > strength_pa:
                near_n = tip.force_n
            onset_n = yield_force(*bodies, near_n=near_n)
    found = Meshed(
        _listed(force_n), _listed(fine.deformation_m), _listed(fine.contact_radius_m),
        _listed(fine.mises_pa), _listed(coarse.deformation_m), fine.nodes, coarse.nodes, onset_n,
        time.perf_counter() - started_s,
    )  # fmt: skip
    _keep(_file_of(payload, to_n), found)
    return found


def _listed(numbers: FloatArray) -> tuple[float, ...]:
    return tuple(numbers.tolist())


def meshed_law(payload: Payload, to_n: float) -> ContactLaw | None:
    """The power law (25) of the curve that is kept for a payload up to a force; never meshes.

    None where there is none, one that is off the half-space by more than `MOST_OFF`, or a material
    is known as a range only. A whole sphere is not its half held at the equator, so it keeps Hertz.
    """
    if not can_be_meshed(payload) or (kept := _read(_file_of(payload, to_n))) is None:
        return None
    fit = rs_btls(kept.deformation_m, kept.force_n, secant_force_n=to_n)
    theory = law_for(payload.geometry, payload.material, payload.plate, to_n)
    off = fit.secant_n_per_m / theory.secant(to_n)
    return ContactLaw(fit.k, fit.n, MESHED) if 1.0 / MOST_OFF < off < MOST_OFF else None


def meshed_onset(payload: Payload) -> float | None:
    """The least force in N at which von Mises reaches Y, of all curves that are kept for a payload.

    None as of `meshed_law`, or where no curve has it.
    """
    if not can_be_meshed(payload):
        return None
    kept = map(_read, _file_of(payload, 1.0).parent.glob(f"{_name_of(payload)}-*.json"))
    return min(
        (found.yield_force_n for found in kept if found and found.yield_force_n), default=None
    )


def can_be_meshed(payload: Payload) -> bool:
    """Whether a mesh is of the payload as it is pressed."""
    ranges = is_range(payload.material) or is_range(payload.plate)
    return not isinstance(payload.geometry, Sphere) and has_size(payload) and not ranges


def body_left_out(payload: Payload, law: ContactLaw) -> Body | None:
    """The finite body of a payload that neither `law` nor F_c regards; None where there is none."""
    if law.equation == MESHED or not can_be_meshed(payload) or meshed_onset(payload) is not None:
        return None
    return size_of(payload.geometry)


def cache_directory() -> Path:
    """Where curves are kept."""
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "stepload" / "mesh"


def _name_of(payload: Payload) -> str:
    """Named by everything that the curves depend on but the highest force."""
    bodies = [
        (body.youngs_modulus_pa, body.poisson_ratio, body.yield_strength_pa)
        for body in (payload.material, payload.plate)
    ]
    shape = type(payload.geometry).__name__, astuple(payload.geometry)
    content = (VERSION, PER_RADIUS, PER_RADIUS_3D, shape, bodies)
    return hashlib.sha256(repr(content).encode()).hexdigest()[:32]


def _file_of(payload: Payload, to_n: float) -> Path:
    return cache_directory() / f"{_name_of(payload)}-{to_n:.9g}.json"


def _read(path: Path) -> Meshed | None:
    """The curve of a file; None where it is damaged, or is not on the forces of its name."""
    with suppress(OSError, ValueError):
        found = adapter(Meshed).validate_json(path.read_bytes())
        assert isinstance(found, Meshed)
        to_n = float(path.stem.partition("-")[2])
        curves = np.array([found.force_n, found.deformation_m, found.coarse_deformation_m,
                           found.contact_radius_m, found.mises_pa])  # fmt: skip
        on_forces = np.allclose(curves[0], to_n * np.array(SHARES), rtol=1e-6, atol=0.0)
        rises = bool(np.all(np.diff(curves[:3], prepend=0.0) > 0.0))
        if on_forces and rises and np.allclose(curves[1], curves[2], rtol=MOST_COARSE, atol=0.0):
            return found
    return None


def _keep(path: Path, found: Meshed) -> None:
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, adapter(Meshed).dump_json(found))
