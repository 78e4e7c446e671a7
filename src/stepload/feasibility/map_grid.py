"""A rig and its payloads for a map, read and derived in the same way as a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from stepload.errors import BadInputError, DomainError, RefusedError
from stepload.feasibility.conditions import conditions_of
from stepload.feasibility.draft_plan import plan_of
from stepload.feasibility.preflight import Preflight, derive
from stepload.identification.conditions import Conditions
from stepload.plan.model import Plan
from stepload.plan.shipped import payload_folder
from stepload.units import format_quantity

PAPERS_N = 300.0
"""The top force of the paper's maps."""
PROBE_N = 1e4
"""Top force in N of a plan that is only read to learn how hard a rig can push."""
OF_PUSH = 0.8
"""Share of a rig's largest push that is used where it cannot push that hard."""


@dataclass(frozen=True, slots=True)
class Specimen:
    """A payload, and how hard this rig may press it.

    Attributes:
        name: its name; `path` its file.
        top_n: the force it is pressed with here, 0 where it must not be pressed at all; `why` says
            what makes that less than the map's top force, and where the table of the rig's
            deflection does not cover it; "" where nothing does.
        at_top_n_per_m: its secant stiffness at the top force of the map, by theory.
        secant_n_per_m: the same at `top_n`.
        exponent: n.
        conditions: of its identification at `top_n`; None where it is not pressed.
        touch_n: force at which its touch is seen.
    """

    name: str
    path: Path
    top_n: float
    why: str
    at_top_n_per_m: float
    secant_n_per_m: float
    exponent: float
    conditions: Conditions | None
    touch_n: float


@dataclass(frozen=True, slots=True)
class Bench:
    """A rig as a map uses it.

    Attributes:
        name: of the rig.
        top_n: the top force of the map.
        conditions: of an identification of an unknown payload.
        touch_n: force at which a touch is detected.
        note: how well K_s is known, in words.
    """

    name: str
    top_n: float
    conditions: Conditions
    touch_n: float
    note: str


def bench(rig: str, top_n: float | None) -> Bench:
    """The rig of a name or a file.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        top_n: top force; None: the paper's 300 N, or 80 % of what the rig can push.

    Raises:
        BadInputError: no such rig, or it cannot press that hard.
        PlanError: what is wrong in a rig file.
    """
    name, most_n = most_push(rig)
    if top_n is None:
        top_n = min(PAPERS_N, OF_PUSH * most_n)
    if not 0.0 < top_n <= most_n:
        raise BadInputError(
            f"top force {top_n:.4g} N: rig {name} can press with {most_n:.4g} N at most",
            hint="--top-force between 0 and that",
        )
    plan = plan_of(rig, _flat(), top_n)
    told = conditions_of(plan, derive(plan).theory)
    known = told.sources
    if known.system_stiffness_n_per_m is None:
        note = "a gauge across the contact: K_s is not in the chain"
    else:
        by = "a table of the pose" if known.deflection_force_n else "no table of the pose"
        share = known.system_stiffness_sigma_n_per_m / known.system_stiffness_n_per_m
        stiffness = format_quantity(known.system_stiffness_n_per_m, "N/m")
        note = f"K_s = {stiffness}, known to {100.0 * share:.2g} % ({by})"
        doubts = (known.system_stiffness_note, *told.table_remarks(top_n))
        note = "; ".join(filter(None, (note, *doubts)))
    return Bench(
        name=name,
        top_n=top_n,
        conditions=replace(
            told, secant_force_n=top_n, elastic_limit_n=None, roughness_m=None,
            rough_length_m=None, theory_k=None, theory_n=None, modulus_pa=None,
        ),
        touch_n=plan.procedure.touch_force_n,
        note=note,
    )  # fmt: skip


def most_push(rig: str) -> tuple[str, float]:
    """Name of a rig, and what its arm and its force sensor can push, in N.

    Raises:
        BadInputError: no such rig.
        PlanError: what is wrong in a rig file.
    """
    own = plan_of(rig, _flat(), PROBE_N).rig
    return own.name, min(own.arm.max_push_n, own.force.range_n)


def specimen(rig: str, path: Path, top_n: float) -> Specimen:
    """A payload on a rig, pressed no harder than is safe there.

    Raises:
        PlanError: what is wrong in the payload's file.
    """
    plan = plan_of(rig, path, top_n)
    name = plan.payload.name
    try:
        found = derive(plan)
    except (RefusedError, DomainError) as error:
        return Specimen(name, path, 0.0, error.message, 0.0, 0.0, 0.0, None, 0.0)
    law = found.theory.stiffest
    safe_n = min(top_n, found.largest_safe_force_n)
    why = ""
    pressed: tuple[Plan, Preflight] | None = plan, found
    if safe_n < top_n:
        why = (
            f"pressed with {safe_n:.3g} N: its elastic limit is {found.theory.elastic_limit_n:.3g}"
            f" N; F_c used: {found.theory.counted.lower_n:.3g} N"
        )
        pressed = _softer(rig, path, safe_n)
    if pressed is None:
        why = (
            f"must not be pressed here: its elastic limit is {found.theory.elastic_limit_n:.3g} N, "
            f"and no top force that this rig resolves is safe"
        )
        secant = law.secant(top_n)
        return Specimen(name, path, 0.0, why, secant, secant, law.n, None, 0.0)
    own, preflight = pressed
    told = replace(conditions_of(own, preflight.theory), secant_force_n=safe_n)
    return Specimen(
        name, path, safe_n, why, law.secant(top_n), law.secant(safe_n), law.n, told,
        own.procedure.touch_force_n,
    )  # fmt: skip


def _softer(rig: str, path: Path, safe_n: float) -> tuple[Plan, Preflight] | None:
    """The plan of a lower top force; None where there is none."""
    if safe_n <= 0.0:
        return None
    try:
        plan = plan_of(rig, path, safe_n)
        return plan, derive(plan)
    except (BadInputError, RefusedError, DomainError):
        return None


def _flat() -> Path:
    """The file of a payload that bears any force, for what concerns the rig alone."""
    return payload_folder() / "stiff-flat.yaml"
