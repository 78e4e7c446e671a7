"""Calibration records: the system stiffness of one rig, and when it may be used.

A small JSON file with units, written by `stepload calibrate` and read (as JSON or YAML) by a plan's
`rig.system_stiffness.record`.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic.dataclasses import dataclass

from stepload.contact.checks import across_problem
from stepload.declaration import quantities as q
from stepload.declaration.sections import CHECKED, SECTION, Contradiction, adapter
from stepload.identification.deflection import table_problem
from stepload.plan.reader import read_file
from stepload.plan.source import Source, read_source
from stepload.plan.system_stiffness import disagreement
from stepload.plan.whole_file import replace_file
from stepload.rig.samples import SixFloats

_Part = Annotated[float, q.number(0.0, 1.0)]
_Ratio = Annotated[float, q.number(-2.0, 2.0)]
TEMPERATURE_BAND_K = 5.0
"""A record counts as made at another temperature when it is further away than this."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class CalibrationRecord:
    """System stiffness of one rig (26), as measured.

    What it has in common with `SystemStiffness`, by name, takes the place of a plan's own figures.
    """

    stepload_calibration: q.Version
    """Version of the format."""
    rig: q.Name
    """Name of the rig."""
    pose: q.Remark = ""
    """Pose it was measured in."""
    direction: q.Axis
    """Force axis it was measured along."""
    temperature_c: q.Temperature | None = None
    """Temperature of the measurement."""
    measured_on: q.Calendar
    """Day of the measurement."""
    valid_until: q.Calendar
    """Last day on which it may be used."""
    stiffness_n_per_m: q.Stiffness
    """System stiffness K_s (26)."""
    sigma_n_per_m: q.StiffnessError
    """Its standard uncertainty."""
    msde_m: q.LengthOrZero
    """Rms deformation misfit of the linear fit."""
    smooth_error_m: q.LengthOrZero | None = None
    """Smooth position error that leaves this misfit."""
    smooth_degrees: q.Degrees | None = None
    """Degrees of freedom of its estimate."""
    smooth_length_n: q.Force | None = None
    """Its correlation length in force; none: the runs cannot tell it."""
    deflection_force_n: tuple[q.Force, ...] = ()
    """Forces of the table of the system's deflection."""
    deflection_m: tuple[q.Length, ...] = ()
    """Deflection of the system at these forces, 0 at 0 N."""
    deflection_sigma_m: tuple[q.LengthOrZero, ...] = ()
    """Standard uncertainty of each deflection."""
    deflection_common: _Part = 0.0
    """Relative standard uncertainty that all of them have in common."""
    across_m_per_n: tuple[q.Compliance, ...] = ()
    """Travel along the axis per newton across it, two numbers; none: not determined."""
    across_sigma_m_per_n: tuple[q.ComplianceError, ...] = ()
    """Standard uncertainty of each of the two."""
    across_correlation: q.Correlation = 0.0
    """How the errors of the two correlate."""
    at_share: tuple[_Ratio, ...] = ()
    """Force across over force along the axis that K_s and its table belong to; their errors and
    those of `across` do not correlate there. None: not measured.
    """
    share_reach: _Part = 0.0
    """How far from it the shares went from which `across` was measured."""
    across_told: q.Remark = ""
    """What the runs tell of the lateral force, in words."""
    damping_n_s_per_m: q.Damping = 0.0
    """Damping C_s, a lower bound."""
    force_from_n: q.Force
    """Lowest force of the fit."""
    force_to_n: q.Force
    """Highest force of the fit."""
    run: q.Remark = ""
    """Recording it was made from."""
    software: q.Remark = ""
    """Version of stepload that made it."""
    simulated: q.Flag = False
    """Made in a dry run: good for dry runs only."""
    joints_rad: tuple[q.Angle, ...] = ()
    """Joints of the arm at the start pose, as the arm tells them."""
    tcp_position_m: tuple[q.Offset, ...] = ()
    """TCP from the flange, as the arm tells it: x, y, z."""
    tcp_rotation_rad: tuple[q.Angle, ...] = ()
    """Its rotation vector."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        first, last = self.measured_on, self.valid_until
        if last < first:
            yield "valid_until", f"valid_until {last} is before measured_on {first}", ""
        if (len(self.tcp_position_m), len(self.tcp_rotation_rad)) not in ((0, 0), (3, 3)):
            yield "", "tcp_position and tcp_rotation: three numbers each, or none", ""
        if self.sigma_n_per_m >= self.stiffness_n_per_m:
            yield "sigma", "sigma is not below the stiffness", "calibrate again"
        if self.force_to_n <= self.force_from_n:
            yield "force_to", "force_to is not above force_from", "calibrate again"
        if problem := across_problem(self.across_m_per_n, self.across_sigma_m_per_n, self.at_share):
            yield "across", f"lateral force: {problem}", ""
        rows = self.deflection_force_n, self.deflection_m, self.deflection_sigma_m
        problem = table_problem(*rows) if any(rows) else ""
        stiffness = self.stiffness_n_per_m, self.sigma_n_per_m
        if problem := problem or disagreement(*stiffness, *rows):
            yield "deflection_force", f"table of the deflection: {problem}", ""

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
        record, mode="json", by_alias=True, context=q.EXACT
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
    return read_file(CalibrationRecord, source)
