"""Calibration records: the system stiffness of one rig, and when it may be used.

A small JSON file with units, written by `stepload calibrate` and read (as JSON or YAML) by a plan's
`rig.system_stiffness.record`.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.contact.lateral_checks import across_problem
from stepload.declaration.quantities import (
    EXACT,
    Angle,
    Axis,
    Calendar,
    Compliance,
    ComplianceError,
    Correlation,
    Damping,
    Degrees,
    Flag,
    Force,
    Length,
    LengthOrZero,
    Name,
    Offset,
    Remark,
    Stiffness,
    StiffnessError,
    Temperature,
    Version,
    number,
)
from stepload.declaration.sections import SECTION, adapter, key
from stepload.estimators.deflection_rows import table_problem, upper_stiffness_n_per_m
from stepload.plan.problems import Problem
from stepload.plan.reader import read_file
from stepload.plan.source import Source, read_source
from stepload.plan.whole_file import replace_file
from stepload.rig.samples import SixFloats
from stepload.units import format_quantity

_Part = Annotated[float, number(0.0, 1.0)]
_Ratio = Annotated[float, number(-2.0, 2.0)]
TEMPERATURE_BAND_K = 5.0
"""A record counts as made at another temperature when it is further away than this."""
TABLE_AGREES = 0.1
"""Largest relative difference between the table of the deflection and the stiffness beside it."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class CalibrationRecord:
    """System stiffness of one rig (26), as measured.

    What it has in common with `SystemStiffness`, by name, takes the place of a plan's own figures.
    """

    stepload_calibration: Annotated[Version, key("Version of the format.")]
    rig: Annotated[Name, key("Name of the rig.")]
    pose: Annotated[Remark, key("Pose it was measured in.")] = ""
    direction: Annotated[Axis, key("Force axis it was measured along.")]
    temperature_c: Annotated[Temperature | None, key("Temperature of the measurement.")] = None
    measured_on: Annotated[Calendar, key("Day of the measurement.")]
    valid_until: Annotated[Calendar, key("Last day on which it may be used.")]
    stiffness_n_per_m: Annotated[Stiffness, key("System stiffness K_s (26).")]
    sigma_n_per_m: Annotated[StiffnessError, key("Its standard uncertainty.")]
    msde_m: Annotated[LengthOrZero, key("Rms deformation misfit of the linear fit.")]
    smooth_error_m: Annotated[
        LengthOrZero | None, key("Smooth position error that leaves this misfit.")
    ] = None
    smooth_degrees: Annotated[Degrees | None, key("Degrees of freedom of its estimate.")] = None
    smooth_length_n: Annotated[
        Force | None,
        key("Its correlation length in force; none: the runs cannot tell it."),
    ] = None
    deflection_force_n: Annotated[
        tuple[Force, ...], key("Forces of the table of the system's deflection.")
    ] = ()
    deflection_m: Annotated[
        tuple[Length, ...], key("Deflection of the system at these forces, 0 at 0 N.")
    ] = ()
    deflection_sigma_m: Annotated[
        tuple[LengthOrZero, ...], key("Standard uncertainty of each deflection.")
    ] = ()
    deflection_common: Annotated[
        _Part, key("Relative standard uncertainty that all of them have in common.")
    ] = 0.0
    across_m_per_n: Annotated[
        tuple[Compliance, ...],
        key("Travel along the axis per newton across it, two numbers; none: not determined."),
    ] = ()
    across_sigma_m_per_n: Annotated[
        tuple[ComplianceError, ...], key("Standard uncertainty of each of the two.")
    ] = ()
    across_correlation: Annotated[Correlation, key("How the errors of the two correlate.")] = 0.0
    at_share: Annotated[
        tuple[_Ratio, ...],
        key(
            "Force across over force along the axis that K_s and its table belong to; their "
            "errors and those of `across` do not correlate there. None: not measured."
        ),
    ] = ()
    share_reach: Annotated[
        _Part,
        key("How far from it the shares went from which `across` was measured."),
    ] = 0.0
    across_told: Annotated[Remark, key("What the runs tell of the lateral force, in words.")] = ""
    damping_n_s_per_m: Annotated[Damping, key("Damping C_s, a lower bound.")] = 0.0
    force_from_n: Annotated[Force, key("Lowest force of the fit.")]
    force_to_n: Annotated[Force, key("Highest force of the fit.")]
    run: Annotated[Remark, key("Recording it was made from.")] = ""
    software: Annotated[Remark, key("Version of stepload that made it.")] = ""
    simulated: Annotated[Flag, key("Made in a dry run: good for dry runs only.")] = False
    joints_rad: Annotated[
        tuple[Angle, ...],
        key("Joints of the arm at the start pose, as the arm tells them."),
    ] = ()
    tcp_position_m: Annotated[
        tuple[Offset, ...], key("TCP from the flange, as the arm tells it: x, y, z.")
    ] = ()
    tcp_rotation_rad: Annotated[tuple[Angle, ...], key("Its rotation vector.")] = ()

    @property
    def tcp_offset(self) -> SixFloats | None:
        """The TCP from the flange, as in `ArmConfiguration`; None where it is not stated."""
        numbers = (*self.tcp_position_m, *self.tcp_rotation_rad)
        return numbers if len(numbers) == 6 else None


def write_calibration(record: CalibrationRecord, path: Path) -> None:
    """Write `record` to `path`: the whole file or nothing.

    Raises:
        OSError: the directory cannot be written to.
    """
    content = adapter(CalibrationRecord).dump_python(
        record, mode="json", by_alias=True, context=EXACT
    )
    replace_file(path, (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode())


def read_calibration(path: Path) -> CalibrationRecord:
    """The calibration record in `path`.

    Raises:
        PlanError: not there, or not a calibration record; every problem with its place.
    """
    return parse_calibration(read_source(path))


def parse_calibration(source: Source) -> CalibrationRecord:
    """The calibration record in `source`; raises as `read_calibration`."""
    return read_file(CalibrationRecord, source, _impossible)


def _impossible(source: Source, record: CalibrationRecord) -> Iterator[Problem]:
    first, last = record.measured_on, record.valid_until
    if last < first:
        yield source.problem(1, 1, f"valid_until {last} is before measured_on {first}")
    if (len(record.tcp_position_m), len(record.tcp_rotation_rad)) not in ((0, 0), (3, 3)):
        yield source.problem(1, 1, "tcp_position and tcp_rotation: three numbers each, or none")
    if record.sigma_n_per_m >= record.stiffness_n_per_m:
        yield source.problem(1, 1, "sigma is not below the stiffness", "calibrate again")
    if record.force_to_n <= record.force_from_n:
        yield source.problem(1, 1, "force_to is not above force_from", "calibrate again")
    told = record.across_m_per_n, record.across_sigma_m_per_n, record.at_share
    if problem := across_problem(*told):
        yield source.problem(1, 1, f"lateral force: {problem}")
    rows = record.deflection_force_n, record.deflection_m, record.deflection_sigma_m
    if not any(rows):
        return
    stiffness = record.stiffness_n_per_m, record.sigma_n_per_m
    if problem := table_problem(*rows) or disagreement(*stiffness, rows[0], rows[1]):
        yield source.problem(1, 1, f"table of the deflection: {problem}")


def disagreement(
    stiffness_n_per_m: float,
    sigma_n_per_m: float,
    force_n: Sequence[float],
    deflection_m: Sequence[float],
) -> str:
    """Why the stated K_s does not belong to this table; "" where the two agree."""
    slope = upper_stiffness_n_per_m(force_n, deflection_m)
    allowed = max(TABLE_AGREES, 3.0 * sigma_n_per_m / stiffness_n_per_m)
    if abs(slope / stiffness_n_per_m - 1.0) <= allowed:
        return ""
    return (
        f"the table has a stiffness of {format_quantity(slope, 'N/m')} above 40 % of its forces, "
        f"value is {format_quantity(stiffness_n_per_m, 'N/m')}"
    )
