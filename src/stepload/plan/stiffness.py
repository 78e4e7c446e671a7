"""Decides which system stiffness a plan uses, its record's or its own, and whether it is valid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from datetime import date, timedelta

from stepload.declaration.sections import DERIVED, put
from stepload.plan.calibration import TEMPERATURE_BAND_K, parse_calibration
from stepload.plan.model import Plan, Provenance, RecordPolicy
from stepload.plan.problems import PlanError
from stepload.plan.references import References
from stepload.plan.tree import Place

_OTHER_ZONE = timedelta(days=1)
"""The local date may already be one day ahead where a record was made."""


def settle_stiffness(plan: Plan, at: Place, today: date, files: References) -> None:
    """Put the record's values, if there is one, into a plan that is read, and `validity_problem`.

    `at` is the place of the record's path, or of the stiffness. A problem of validity is an error
    only where the policy is refuse; a file that is there and cannot be read always is.
    """
    stiffness = plan.rig.system_stiffness
    try:
        reasons = [*_go_by_record(plan, at, files), *_doubts(plan, today)]
    except PlanError as error:
        files.problems.extend(
            p if p.line else at.problem(p.message, p.hint) for p in error.problems
        )
        return
    problem = "; ".join(reasons)
    put(stiffness, "validity_problem", problem)
    if problem and stiffness.policy is RecordPolicy.REFUSE:
        hint = "calibrate again (`stepload calibrate`), or set policy: warn"
        files.problems.append(at.problem(f"system stiffness: {problem}", hint))


def _go_by_record(plan: Plan, at: Place, files: References) -> Iterator[str]:
    """Put the values of the record into the plan; yields the doubts about using it.

    Raises:
        PlanError: it cannot be read, or is missing and the plan states no value instead.
    """
    stiffness = plan.rig.system_stiffness
    named = stiffness.record
    if named is None:
        return
    path = at.source.beside(named)
    put(stiffness, "record", path)
    if not files.shelf.has(path):
        if stiffness.stiffness_n_per_m is DERIVED:
            hint = "run `stepload calibrate`, or give value and sigma to stand in"
            raise PlanError((at.problem(f"calibration record {named} does not exist", hint),))
        yield f"{named} does not exist"
        return
    source = files.shelf.file(path)
    files.sources.append(source)
    record = parse_calibration(source)
    for field in {each.name for each in fields(record)} & {each.name for each in fields(stiffness)}:
        put(stiffness, field, getattr(record, field))
    put(stiffness, "tcp_offset", record.tcp_offset)
    put(stiffness, "provenance", Provenance.MEASURED)
    if record.rig != plan.rig.name:
        yield f"made for the rig {record.rig!r}, this is {plan.rig.name!r}"


def _doubts(plan: Plan, today: date) -> Iterator[str]:
    """Why the stiffness may not hold in this plan."""
    stiffness = plan.rig.system_stiffness
    on, until = stiffness.measured_on, stiffness.valid_until
    if until is not None and until < today:
        yield f"expired on {until}"
    if on is not None and on - today > _OTHER_ZONE:
        yield f"measured on {on}, which is still to come"
    for what, theirs, mine in (
        ("pose", stiffness.pose, plan.rig.arm.pose),
        ("direction", stiffness.direction, plan.rig.force.axis),
    ):
        if theirs and mine and theirs != mine:
            yield f"measured in {what} {theirs!r}, this is {mine!r}"
    then, now = stiffness.temperature_c, plan.identify.temperature_c
    if then is not None and now is not None and abs(then - now) > TEMPERATURE_BAND_K:
        yield f"measured at {then:g} °C, this is {now:g} °C (allowed {TEMPERATURE_BAND_K:g} K)"
