"""Checks for contradictions between the sections of a plan, although each by itself is valid."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.contact.material_range import is_range
from stepload.plan.derived import elastic_travel, follows
from stepload.plan.impossible import Check, Impossibility, metre, newton, run_checks
from stepload.plan.model import Plan
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


def impossibilities_between(plan: Plan) -> Iterator[Impossibility]:
    """Contradictions between the sections of a plan whose derived values are filled in."""
    return run_checks(PLAN_CHECKS, plan)


def _touch_below_level(plan: Plan) -> Iterator[Impossibility]:
    """Of a touch force that the user wrote; preflight refuses a plan where none is low enough."""
    touch, levels = plan.procedure.touch_force_n, plan.procedure.levels_n
    if levels and touch >= levels[0] and not follows(plan, "procedure", "touch_force_n"):
        yield Impossibility(
            ("procedure", "touch_force"),
            f"contact threshold {newton(touch)} is not below the first level {newton(levels[0])}",
            "lower touch_force, or begin with a higher level",
        )


def _touch_above_noise(plan: Plan) -> Iterator[Impossibility]:
    touch, noise = plan.procedure.touch_force_n, plan.rig.force.noise_n
    if touch < least_touch_force(noise):
        yield Impossibility(
            ("procedure", "touch_force"),
            f"contact threshold {newton(touch)} is within {LEAST_TOUCH_SIGMAS:g} sigma of the "
            f"noise {newton(noise)}",
            f"use at least {newton(6.0 * noise)}",
        )


def _tare(plan: Plan) -> Iterator[Impossibility]:
    tare_s, rate_hz = plan.procedure.tare_s, plan.rig.force.rate_hz
    readings = tare_s * rate_hz
    if readings < LEAST_TARE_READINGS:
        yield Impossibility(
            ("procedure", "tare"),
            f"a tare of {format_quantity(tare_s, 's')} holds {readings:.2g} readings of the force"
            f" sensor ({rate_hz:g} Hz)",
            f"use {format_quantity(LEAST_TARE_READINGS / rate_hz, 's')} at the very least, for"
            f" {LEAST_TARE_READINGS:g} readings",
        )


def _retract(plan: Plan) -> Iterator[Impossibility]:
    retract, travel = plan.procedure.retract_m, elastic_travel(plan)
    if retract <= travel:
        yield Impossibility(
            ("procedure", "retract"),
            f"a retract of {metre(retract)} does not part the contact: arm and payload give way "
            f"by {metre(travel)} at the top force",
            f"retract at least {format_quantity(2.0 * travel, 'm', digits=2)}",
        )


def _fuse(plan: Plan) -> Iterator[Impossibility]:
    fuse, top = plan.rig.mechanical_fuse_n, plan.procedure.top_force_n
    if fuse is not None and fuse <= top:
        yield Impossibility(
            ("procedure", "top_force"),
            f"the mechanical fuse opens at {newton(fuse)}, before the top force {newton(top)}",
            "lower top_force or use a stronger fuse",
        )


def _known_body(plan: Plan) -> Iterator[Impossibility]:
    """A calibration subtracts the contact's deformation, so both bodies must be known."""
    if plan.identify.kind == "system":
        for key, body in (("material", plan.payload.material), ("plate", plan.payload.plate)):
            if is_range(body):
                yield Impossibility(
                    ("payload", key),
                    "a calibration against a material that is known as a range only",
                    "press on something stiff that is known, a steel flat or ball for example",
                )


def _secant(plan: Plan) -> Iterator[Impossibility]:
    secant, top = plan.identify.secant_force_n, plan.procedure.top_force_n
    if secant > top:
        yield Impossibility(
            ("identify", "secant_force"),
            f"the secant at {newton(secant)} is beyond the top force {newton(top)}",
            "the law is not extrapolated: use a force the run reaches",
        )


def _duration(plan: Plan) -> Iterator[Impossibility]:
    procedure = plan.procedure
    sweeps = 2 if procedure.unload is True else 1
    holds, hold = len(procedure.levels_n) * procedure.cycles * sweeps, procedure.hold_s
    if holds * hold > MAX_RUN_S:
        yield Impossibility(
            ("procedure", "hold"),
            f"{holds} holds of {hold:g} s last {holds * hold / 3600.0:.1f} h",
            f"a run lasts at most {MAX_RUN_S / 3600.0:g} h: shorten hold or cycles",
        )


def _until(plan: Plan) -> Iterator[Impossibility]:
    """Whether `until` is pointless in this plan, or could not be decided."""
    procedure, path = plan.procedure, ("procedure", "until")
    until = procedure.until
    if until is None:
        return
    levels = len(procedure.levels_n)
    if levels <= LEAST_LEVELS:
        yield Impossibility(
            path,
            f"{levels} load levels: the loading ends after {LEAST_LEVELS} of them at the earliest, "
            "so nothing is left to decide",
            "plan more levels (a smaller step), or leave `until` out",
        )
    if plan.identify.kind == "system":
        yield Impossibility(
            path,
            "a calibration of the system stiffness has no chord stiffness of a payload",
            "leave `until` out: a calibration needs its whole range of force",
        )
    if procedure.cycles < 2 and not procedure.unload:
        yield Impossibility(
            path,
            "only a loading: no figure of such a run is identified, so no force is enough for it",
            "plan `unload: true` or `cycles: 2`",
        )
    accuracy = 1.0 / plan.identify.accuracy_t
    if until > accuracy:
        wide, most = beside_limit(until, accuracy)
        yield Impossibility(
            path,
            f"±{wide} is wider than the ±{most} that identify.t asks for (1/t): the run would end "
            "where its figure is not identified",
            f'write at most "±{most}", or lower identify.t',
        )
    if plan.rig.displacement is not None:
        yield Impossibility(
            path,
            "the deformation comes from a gauge across the contact, which is read after the run: "
            "while it presses nobody knows whether it is enough",
            "leave `until` out, or measure with the travel of the arm",
        )


def _directory(plan: Plan) -> Iterator[Impossibility]:
    if ".." in plan.record.directory.parts:
        yield Impossibility(
            ("record", "directory"),
            "a directory with `..` in it",
            "name it from the working directory down, or absolutely",
        )


PLAN_CHECKS: tuple[Check, ...] = (
    _touch_below_level, _touch_above_noise, _tare, _retract, _fuse, _secant, _duration, _directory,
    _known_body, _until,
)  # fmt: skip
