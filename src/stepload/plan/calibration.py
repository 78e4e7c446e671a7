"""Calibration records: the system stiffness of one rig, and when it may be used.

A small JSON file with units, written by `stepload calibrate` and read (as JSON or YAML) by a plan's
`rig.system_stiffness.record`.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Literal

from pydantic import Field

from stepload.plan.fields import (
    Calendar,
    Damping,
    Flag,
    Force,
    LengthOrZero,
    Name,
    Remark,
    Stiffness,
    StiffnessError,
    Temperature,
)
from stepload.plan.payload_section import Section
from stepload.plan.problems import PlanError, Problem
from stepload.plan.rig_section import Axis, Degrees
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Place, parse_tree
from stepload.plan.validate import read_section

TEMPERATURE_BAND_K = 5.0
"""A record counts as made at another temperature when it is further away than this."""


@dataclass(frozen=True, slots=True)
class CalibrationRecord:
    """System stiffness of one rig (26), as measured.

    `sigma_n_per_m` is its standard uncertainty, `msde_m` the rms deformation misfit,
    `smooth_error_m` the smooth position error behind it with the degrees of freedom of its
    estimate (None: not in the record), `force_from_n` … `force_to_n` the range of the fit,
    `direction` the force axis ("+fz"), `run` the recordings it comes from. `valid_until` is the
    last day on which it may be used. A `simulated` record, from a dry run, is good for dry runs.
    """

    rig: str
    pose: str
    direction: str
    temperature_c: float | None
    measured_on: date
    valid_until: date
    stiffness_n_per_m: float
    sigma_n_per_m: float
    msde_m: float
    damping_n_s_per_m: float
    force_from_n: float
    force_to_n: float
    run: str
    software: str
    smooth_error_m: float | None = None
    smooth_degrees: float | None = None
    simulated: bool = False


class RecordFileSection(Section):
    """The keys of a calibration record."""

    stepload_calibration: Literal[1] = Field(description="Version of the format.")
    rig: Name = Field(description="Name of the rig.")
    pose: Remark = Field(default="", description="Pose it was measured in.")
    direction: Axis = Field(description="Force axis it was measured along.")
    temperature: Temperature | None = Field(
        default=None, description="Temperature of the measurement."
    )
    measured_on: Calendar = Field(description="Day of the measurement.")
    valid_until: Calendar = Field(description="Last day on which it may be used.")
    stiffness: Stiffness = Field(description="System stiffness K_s (26).")
    sigma: StiffnessError = Field(description="Its standard uncertainty.")
    msde: LengthOrZero = Field(description="Rms deformation misfit of the linear fit.")
    smooth_error: LengthOrZero | None = Field(
        default=None, description="Smooth position error that leaves this misfit."
    )
    smooth_degrees: Degrees | None = Field(
        default=None, description="Degrees of freedom of its estimate."
    )
    damping: Damping = Field(default=0.0, description="Damping C_s, a lower bound.")
    force_from: Force = Field(description="Lowest force of the fit.")
    force_to: Force = Field(description="Highest force of the fit.")
    run: Remark = Field(default="", description="Recording it was made from.")
    software: Remark = Field(default="", description="Version of stepload that made it.")
    simulated: Flag = Field(default=False, description="Made in a dry run: good for dry runs only.")


def write_calibration(record: CalibrationRecord, path: Path) -> None:
    """Write `record` to `path`: the whole file or nothing.

    Raises:
        OSError: the directory cannot be written to.
    """
    temperature = record.temperature_c
    content = {
        "stepload_calibration": 1,
        "rig": record.rig,
        "pose": record.pose,
        "direction": record.direction,
        "temperature": None if temperature is None else f"{temperature!r} degC",
        "measured_on": record.measured_on.isoformat(),
        "valid_until": record.valid_until.isoformat(),
        "stiffness": f"{record.stiffness_n_per_m!r} N/m",
        "sigma": f"{record.sigma_n_per_m!r} N/m",
        "msde": f"{record.msde_m!r} m",
        "smooth_error": None if record.smooth_error_m is None else f"{record.smooth_error_m!r} m",
        "smooth_degrees": record.smooth_degrees,
        "damping": f"{record.damping_n_s_per_m!r} N s/m",
        "force_from": f"{record.force_from_n!r} N",
        "force_to": f"{record.force_to_n!r} N",
        "run": record.run,
        "software": record.software,
        "simulated": record.simulated,
    }
    partial = path.with_name(path.name + ".part")
    with open(partial, "w", encoding="utf-8") as file:
        json.dump(content, file, indent=2, ensure_ascii=False)
        file.write("\n")
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)


def read_calibration(path: Path) -> CalibrationRecord:
    """The calibration record in `path`.

    Raises:
        PlanError: not there, or not a calibration record; every problem with its place.
    """
    return parse_calibration(read_source(path))


def parse_calibration(source: Source) -> CalibrationRecord:
    """The calibration record in `source`; raises as `read_calibration`."""
    root, problems = parse_tree(source)
    values = read_section(RecordFileSection, root, Place(source, 1, 1), problems)
    problems += _impossible(source, values.get("measured_on"), values.get("valid_until"))
    if problems:
        raise PlanError(tuple(problems))
    return CalibrationRecord(
        rig=values["rig"],
        pose=values["pose"],
        direction=values["direction"],
        temperature_c=values["temperature"],
        measured_on=values["measured_on"],
        valid_until=values["valid_until"],
        stiffness_n_per_m=values["stiffness"],
        sigma_n_per_m=values["sigma"],
        msde_m=values["msde"],
        damping_n_s_per_m=values["damping"],
        force_from_n=values["force_from"],
        force_to_n=values["force_to"],
        run=values["run"],
        software=values["software"],
        smooth_error_m=values["smooth_error"],
        smooth_degrees=values["smooth_degrees"],
        simulated=values["simulated"],
    )


def _impossible(source: Source, first: date | None, last: date | None) -> list[Problem]:
    if first is None or last is None or last >= first:
        return []
    return [source.problem(1, 1, f"valid_until {last} is before measured_on {first}")]
