"""Which system stiffness a plan goes by, its record's or its own, and whether it may."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from pathlib import Path

from stepload.plan.calibration import TEMPERATURE_BAND_K, CalibrationRecord, parse_calibration
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Place
from stepload.plan.validate import Values


@dataclass(frozen=True, slots=True)
class Situation:
    """What the stiffness is wanted for; empty text, None: not known, not compared."""

    rig: str
    pose: str
    direction: str
    temperature_c: float | None
    today: date


def settle_stiffness(
    stiffness: Values, at: Place, wanted: Situation, sources: list[Source], problems: list[Problem]
) -> None:
    """Put the record's values, if there is one, into `stiffness`, and `validity_problem`.

    `at` is the place of the record's path, or of the stiffness. A problem of validity is an error
    only where the policy is refuse; a file that is there and cannot be read always is.
    """
    reasons = []
    name = stiffness.get("record")
    if name is not None:
        path = _beside(at, name)
        stiffness["record_path"] = path
        if not path.exists():
            reasons.append(f"{name} does not exist")
            if stiffness.get("value") is None:
                hint = "run `stepload calibrate`, or give value and sigma to stand in"
                problems.append(at.problem(f"calibration record {reasons[0]}", hint))
                return
        else:
            try:
                source = read_source(path)
                sources.append(source)
                record = parse_calibration(source)
            except PlanError as error:
                problems.extend(
                    p if p.line else at.problem(p.message, p.hint) for p in error.problems
                )
                return
            _adopt(stiffness, record)
            if record.rig != wanted.rig:
                reasons.append(f"made for the rig {record.rig!r}, this is {wanted.rig!r}")
    reasons += _invalid(stiffness, wanted)
    stiffness["validity_problem"] = "; ".join(reasons)
    if reasons and stiffness.get("policy") == "refuse":
        hint = "calibrate again (`stepload calibrate`), or set policy: warn"
        problems.append(at.problem(f"system stiffness: {stiffness['validity_problem']}", hint))


def _beside(at: Place, name: str) -> Path:
    home = at.source.path
    return (home.parent if home else Path()) / name


def _adopt(stiffness: Values, record: CalibrationRecord) -> None:
    stiffness.update(
        value=record.stiffness_n_per_m,
        sigma=record.sigma_n_per_m,
        damping=record.damping_n_s_per_m,
        msde=record.msde_m,
        smooth_error=record.smooth_error_m,
        smooth_degrees=record.smooth_degrees,
        provenance="measured",
        measured_on=record.measured_on,
        valid_until=record.valid_until,
        pose=record.pose,
        direction=record.direction,
        temperature=record.temperature_c,
        simulated=record.simulated,
    )


def _invalid(stiffness: Values, wanted: Situation) -> list[str]:
    reasons = []
    until = stiffness.get("valid_until")
    if until is not None and until < wanted.today:
        reasons.append(f"expired on {until}")
    for key, mine in (("pose", wanted.pose), ("direction", wanted.direction)):
        theirs = stiffness.get(key)
        if theirs and mine and theirs != mine:
            reasons.append(f"measured in {key} {theirs!r}, this is {mine!r}")
    temperature = stiffness.get("temperature")
    if temperature is not None and wanted.temperature_c is not None:
        difference = abs(temperature - wanted.temperature_c)
        if difference > TEMPERATURE_BAND_K:
            reasons.append(
                f"measured at {temperature:g} °C, this is {wanted.temperature_c:g} °C "
                f"(allowed {TEMPERATURE_BAND_K:g} K)"
            )
    return reasons
