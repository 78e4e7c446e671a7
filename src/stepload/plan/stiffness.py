"""Decides which system stiffness a plan uses, its record's or its own, and whether it is valid."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields
from datetime import date, timedelta
from pathlib import Path

from stepload.declaration.sections import UNKNOWN, UnknownError, put, written
from stepload.plan.calibration import TEMPERATURE_BAND_K, CalibrationRecord, parse_calibration
from stepload.plan.model import Plan, Provenance, RecordPolicy, SystemStiffness
from stepload.plan.problems import PlanError, Problem
from stepload.plan.shelf import Shelf
from stepload.plan.source import Source
from stepload.plan.tree import Place

_OTHER_ZONE = timedelta(days=1)
"""The local date may already be one day ahead where a record was made."""


def settle_stiffness(
    plan: Plan,
    at: Place,
    today: date,
    shelf: Shelf,
    sources: list[Source],
    problems: list[Problem],
) -> None:
    """Put the record's values, if there is one, into the draft of a plan, and `validity_problem`.

    `at` is the place of the record's path, or of the stiffness. A problem of validity is an error
    only where the policy is refuse; a file that is there and cannot be read always is.
    """
    stiffness = plan.rig.system_stiffness
    try:
        reasons = [*_go_by_record(plan, at, shelf, sources), *_doubts(plan, today)]
    except PlanError as error:
        problems.extend(p if p.line else at.problem(p.message, p.hint) for p in error.problems)
        return
    problem = "; ".join(reasons)
    put(stiffness, "validity_problem", problem)
    if problem and stiffness.policy is RecordPolicy.REFUSE:
        hint = "calibrate again (`stepload calibrate`), or set policy: warn"
        problems.append(at.problem(f"system stiffness: {problem}", hint))


def _go_by_record(plan: Plan, at: Place, shelf: Shelf, sources: list[Source]) -> Iterator[str]:
    """Put the values of the record into the draft; yields the doubts about using it.

    Raises:
        PlanError: it cannot be read, or is missing and the plan states no value instead.
    """
    stiffness = plan.rig.system_stiffness
    named = stiffness.record
    if named is None or named is UNKNOWN:
        return
    home = at.source.path
    path = (home.parent if home else Path()) / named
    put(stiffness, "record", path)
    if not shelf.has(path):
        if written(stiffness.stiffness_n_per_m) is None:
            hint = "run `stepload calibrate`, or give value and sigma to stand in"
            raise PlanError((at.problem(f"calibration record {named} does not exist", hint),))
        yield f"{named} does not exist"
        return
    source = shelf.file(path)
    sources.append(source)
    record = parse_calibration(source)
    for field in _names(CalibrationRecord) & _names(SystemStiffness):
        put(stiffness, field, getattr(record, field))
    put(stiffness, "tcp_offset", record.tcp_offset)
    put(stiffness, "provenance", Provenance.MEASURED)
    with suppress(UnknownError):
        if record.rig != plan.rig.name:
            yield f"made for the rig {record.rig!r}, this is {plan.rig.name!r}"


def _names(section: type[CalibrationRecord | SystemStiffness]) -> set[str]:
    return {field.name for field in fields(section)}


def _doubts(plan: Plan, today: date) -> Iterator[str]:
    """Why the stiffness may not hold in this plan; what is not known is not compared."""
    stiffness = plan.rig.system_stiffness
    with suppress(UnknownError):
        until = stiffness.valid_until
        if until is not None and until < today:
            yield f"expired on {until}"
    with suppress(UnknownError):
        on = stiffness.measured_on
        if on is not None and on - today > _OTHER_ZONE:
            yield f"measured on {on}, which is still to come"
    with suppress(UnknownError):
        yield from _other("pose", stiffness.pose, plan.rig.arm.pose)
    with suppress(UnknownError):
        yield from _other("direction", stiffness.direction, plan.rig.force.axis)
    with suppress(UnknownError):
        then, now = stiffness.temperature_c, plan.identify.temperature_c
        if then is not None and now is not None and abs(then - now) > TEMPERATURE_BAND_K:
            yield (
                f"measured at {then:g} °C, this is {now:g} °C (allowed {TEMPERATURE_BAND_K:g} K)"
            )


def _other(what: str, theirs: str, mine: str) -> Iterator[str]:
    if theirs and mine and theirs != mine:
        yield f"measured in {what} {theirs!r}, this is {mine!r}"
