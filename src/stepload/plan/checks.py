"""Checks for contradictions between the sections of a plan, although each by itself is valid."""

from __future__ import annotations

import math
from collections.abc import Iterator

from stepload.contact.material_range import is_range
from stepload.declaration.quantities import metre, newton
from stepload.declaration.sections import Contradiction
from stepload.plan.derived import elastic_travel, follows
from stepload.plan.model import Plan
from stepload.plan.payload import BEYOND
from stepload.units import beside_limit, format_quantity

MAX_RUN_S = 86_400.0
"""Longest time, in s, that the holds of a run may add up to."""
LEAST_LEVELS = 3
"""A loading of fewer levels shows too little of its shape and of creep to be ended on purpose."""
LEAST_TARE_READINGS = 10.0
"""Fewer readings tell neither a zero nor its noise and drift."""
LEAST_TOUCH_SIGMAS = 4.0
"""A touch force below so many standard deviations of the force noise finds touches in the noise."""


def least_touch_force(noise_n: float) -> float:
    """The smallest force in N that counts as a touch over a force noise of `noise_n` (sd)."""
    return LEAST_TOUCH_SIGMAS * noise_n


def contradictions(plan: Plan) -> Iterator[Contradiction]:
    """What cannot be together in a plan whose sections are sound and whose values are derived."""
    procedure, identify, force = plan.procedure, plan.identify, plan.rig.force
    touch_n, noise_n, top_n = procedure.touch_force_n, force.noise_n, procedure.top_force_n
    first_n, fuse_n = procedure.levels_n[0], plan.rig.mechanical_fuse_n
    # Preflight refuses a plan where no touch force that would follow is low enough.
    if touch_n >= first_n and not follows(plan, "procedure", "touch_force_n"):
        yield (
            "procedure.touch_force",
            f"contact threshold {newton(touch_n)} is not below the first level {newton(first_n)}",
            "lower touch_force, or begin with a higher level",
        )
    if touch_n < least_touch_force(noise_n):
        yield (
            "procedure.touch_force",
            f"contact threshold {newton(touch_n)} is within {LEAST_TOUCH_SIGMAS:g} sigma of the "
            f"noise {newton(noise_n)}",
            f"use at least {newton(6.0 * noise_n)}",
        )
    readings = procedure.tare_s * force.rate_hz
    if readings < LEAST_TARE_READINGS:
        yield (
            "procedure.tare",
            f"a tare of {format_quantity(procedure.tare_s, 's')} holds {readings:.2g} readings of"
            f" the force sensor ({force.rate_hz:g} Hz)",
            f"use {format_quantity(LEAST_TARE_READINGS / force.rate_hz, 's')} at the very least, "
            f"for {LEAST_TARE_READINGS:g} readings",
        )
    travel_m = elastic_travel(plan)
    if not math.isfinite(travel_m):
        yield "payload.geometry", *BEYOND
    elif procedure.retract_m <= travel_m:
        yield (
            "procedure.retract",
            f"a retract of {metre(procedure.retract_m)} does not part the contact: arm and payload "
            f"give way by {metre(travel_m)} at the top force",
            f"retract at least {format_quantity(2.0 * travel_m, 'm', digits=2)}",
        )
    if fuse_n is not None and fuse_n <= top_n:
        yield (
            "procedure.top_force",
            f"the mechanical fuse opens at {newton(fuse_n)}, before the top force {newton(top_n)}",
            "lower top_force or use a stronger fuse",
        )
    if identify.secant_force_n > top_n:
        yield (
            "identify.secant_force",
            f"the secant at {newton(identify.secant_force_n)} is beyond the top force "
            f"{newton(top_n)}",
            "the law is not extrapolated: use a force the run reaches",
        )
    holds = len(procedure.levels_n) * procedure.cycles * (2 if procedure.unload else 1)
    if (held_s := holds * procedure.hold_s) > MAX_RUN_S:
        yield (
            "procedure.hold",
            f"{holds} holds of {procedure.hold_s:g} s last {held_s / 3600.0:.1f} h",
            f"a run lasts at most {MAX_RUN_S / 3600.0:g} h: shorten hold or cycles",
        )
    if ".." in plan.record.directory.parts:
        yield (
            "record.directory",
            "a directory with `..` in it",
            "name it from the working directory down, or absolutely",
        )
    for key, body in (("material", plan.payload.material), ("plate", plan.payload.plate)):
        if identify.kind == "system" and is_range(body):  # it subtracts the contact's deformation
            yield (
                f"payload.{key}",
                "a calibration against a material that is known as a range only",
                "press on something stiff that is known, a steel flat or ball for example",
            )
    if procedure.until is not None:
        for message, hint in _against_until(plan, procedure.until):
            yield "procedure.until", message, hint


def _against_until(plan: Plan, until: float) -> Iterator[tuple[str, str]]:
    """Why `until` is pointless in this plan, or could not be decided, and what to do."""
    levels, accuracy = len(plan.procedure.levels_n), 1.0 / plan.identify.accuracy_t
    if levels <= LEAST_LEVELS:
        yield (
            f"{levels} load levels: the loading ends after {LEAST_LEVELS} of them at the earliest, "
            "so nothing is left to decide",
            "plan more levels (a smaller step), or leave `until` out",
        )
    if plan.identify.kind == "system":
        yield (
            "a calibration of the system stiffness has no chord stiffness of a payload",
            "leave `until` out: a calibration needs its whole range of force",
        )
    if plan.procedure.cycles < 2 and not plan.procedure.unload:
        yield (
            "only a loading: no figure of such a run is identified, so no force is enough for it",
            "plan `unload: true` or `cycles: 2`",
        )
    if until > accuracy:
        wide, most = beside_limit(until, accuracy)
        yield (
            f"±{wide} is wider than the ±{most} that identify.t asks for (1/t): the run would end "
            "where its figure is not identified",
            f'write at most "±{most}", or lower identify.t',
        )
    if plan.rig.displacement is not None:
        yield (
            "the deformation comes from a gauge across the contact, which is read after the run: "
            "while it presses nobody knows whether it is enough",
            "leave `until` out, or measure with the travel of the arm",
        )


def can_be(plan: Plan) -> bool:
    """Whether a plan would be read without a contradiction."""
    procedure = plan.procedure
    return (
        procedure.surface_uncertainty_m <= procedure.surface_distance_m
        and procedure.search_distance_m >= 2.0 * procedure.surface_uncertainty_m
        and procedure.step_n <= procedure.top_force_n
        and next(contradictions(plan), None) is None
    )
