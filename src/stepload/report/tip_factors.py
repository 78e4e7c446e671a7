"""Curves with the factors of roughness (10) and yield (15) on their deformation (V-B, Fig. 13)."""

from __future__ import annotations

from dataclasses import replace

from stepload.contact.curve_factors import FACTORED, TipFactors
from stepload.contact.elastic import equivalent_radius
from stepload.contact.materials import Sphere
from stepload.errors import BadInputError
from stepload.feasibility.predicted import predict
from stepload.plan.model import Payload
from stepload.record.curves import Curve
from stepload.units import parse_named

SHAPES = (".yaml", ".yml")
"""Endings of a payload's file, which stands for the curve that `predict` gives."""


def tip_factors(
    payload: Payload | None,
    *,
    rough: bool,
    plastic: bool,
    surface: str | None = None,
    radius_m: float | None = None,
) -> TipFactors | None:
    """The factors that are requested, from a payload's materials, tip and surface; None: none is.

    Args:
        surface: σ_eq and micro-hardness in place of the payload's, "7.5 um, 0.7 GPa".
        radius_m: of the tip, in place of the payload's.

    Raises:
        BadInputError: a figure that a factor needs is missing.
    """
    if not (rough or plastic):
        if surface is not None or radius_m is not None:
            raise BadInputError(
                "--surface or --tip-radius without a factor", hint="add --rough or --plastic"
            )
        return None
    if payload is None:
        raise BadInputError("a factor needs materials and tip", hint="--payload payload.yaml")
    roughness_m, hardness_pa = payload.roughness_m, payload.micro_hardness_pa
    if surface is not None:
        first, comma, second = surface.partition(",")
        roughness_m = parse_named("--surface", first, "m")
        hardness_pa = parse_named("--surface", second, "Pa") if comma else hardness_pa
    if rough and roughness_m is None:
        raise BadInputError(
            f"the roughness of {payload.name!r} is not known", hint='--surface "7.5 um, 0.7 GPa"'
        )
    radius_m = radius_m or equivalent_radius(payload.geometry)
    if radius_m is None:
        raise BadInputError(f"{payload.name!r} has no tip radius", hint='--tip-radius "3.3 mm"')
    return TipFactors(
        radius_m, payload.material, payload.plate, roughness_m if rough else None, hardness_pa,
        plastic,
    )  # fmt: skip


def with_factors(curve: Curve, factors: TipFactors | None) -> Curve:
    """A curve of deformation from its zero, with the factors; points in contact only.

    Raises:
        BadInputError: the curve has them already.
    """
    if factors is None:
        return curve
    if told := next((note for note in curve.notes if note.startswith(FACTORED)), ""):
        raise BadInputError(f"the curve has a factor already: {told}", hint="leave the factor out")
    assert curve.displacement_m is not None  # see `deformation_curve`
    keep = curve.force_n > 0.0
    force_n = curve.force_n[keep]
    return replace(
        curve,
        time_s=None if curve.time_s is None else curve.time_s[keep],
        displacement_m=curve.displacement_m[keep] * factors.factor(force_n),
        force_n=force_n,
        notes=(*curve.notes, factors.note),
    )


def predicted_curve(payload: Payload, top_n: float) -> Curve:
    """The smooth elastic curve of a payload by theory or finite elements, at ten even forces.

    A whole sphere is not its half held at the equator, so it keeps Hertz.

    Raises:
        BadInputError, DomainError: as `predict`.
    """
    found = predict(payload, top_n, mesh=not isinstance(payload.geometry, Sphere))
    notes = (f"predicted by {found.theory}",)
    return Curve(None, None, found.deformation_m, found.force_n, notes=notes)
