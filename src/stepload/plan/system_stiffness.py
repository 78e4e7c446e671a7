"""The declaration of the system stiffness: a value with its error, or a record of a calibration."""

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Annotated

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from stepload.contact.checks import across_problem
from stepload.declaration import quantities as q
from stepload.declaration.sections import CHECKED, DERIVED, INTERNAL, SECTION, Contradiction, put
from stepload.identification.deflection import table_problem, upper_stiffness_n_per_m
from stepload.rig.samples import SixFloats
from stepload.units import format_quantity

_StuckRatio = Annotated[float, q.number(1.0, 100.0)]


class Provenance(StrEnum):
    """Where a rig's system stiffness comes from."""

    MEASURED = "measured"
    """From a calibration record of this rig."""
    DECLARED = "declared"
    """Written into the plan by a person who answers for it."""
    INDICATIVE = "indicative"
    """A figure for this class of machine; not good enough for a result."""


class RecordPolicy(StrEnum):
    """What to do when the calibration record is missing, expired or for another pose."""

    WARN = "warn"
    REFUSE = "refuse"


@dataclass(frozen=True, slots=True, config=SECTION)
class SystemStiffness:
    """System stiffness K_s of the whole load path (26): a value with its error, or a record.

    With a record, its values have replaced those of the plan, and `record` is the path of its file.
    `simulated` says whether it was made in a dry run, `joints_rad` and `tcp_offset` how the arm of
    the record stood (empty and None: not told), `validity_problem` why the stiffness may not
    be used as it stands ("" where it may).

    What is subtracted from the travel is the deflection at `at_share` and, where `across` is known,
    c·(F_across − at_share·F). With `at_share` of zero that is the plain c·F of three numbers.
    """

    stiffness_n_per_m: Annotated[q.Stiffness, Field(alias="value")] = DERIVED
    """K_s; with `sigma`."""
    sigma_n_per_m: q.StiffnessSigma = DERIVED
    """Standard uncertainty of `value`."""
    msde_m: q.LengthOrZero = 0.0
    """Rms deformation misfit of the linear fit (26)."""
    damping_n_s_per_m: q.Damping = 0.0
    """Damping C_s, a lower bound."""
    provenance: Provenance = Provenance.DECLARED
    """Origin of `value`; indicative: typical of this class of machine."""
    smooth_error_m: q.LengthOrZero | None = None
    """Smooth position error behind this misfit; none: `msde` is used."""
    smooth_degrees: q.Degrees | None = None
    """Degrees of freedom of `smooth_error`; none: it is exact."""
    smooth_length_n: q.Force | None = None
    """Correlation length of that error in force; none: the worst of many lengths counts."""
    deflection_force_n: tuple[q.Force, ...] = ()
    """Forces of a table of the deflection δ_s(F), rising; replaces F/K_s."""
    deflection_m: tuple[q.Length, ...] = ()
    """Deflection at each of these forces, rising, 0 at 0 N."""
    deflection_sigma_m: tuple[q.LengthOrZero, ...] = ()
    """Standard uncertainty of each deflection, correlated over `smooth_length`."""
    deflection_common: q.Share = 0.0
    """Relative standard uncertainty common to all rows of the table."""
    across_m_per_n: tuple[q.Compliance, ...] = ()
    """Axial travel per newton of lateral force, for the two other sensor axes."""
    across_sigma_m_per_n: tuple[q.ComplianceError, ...] = ()
    """Standard uncertainty of each of the two."""
    across_correlation: q.Correlation = 0.0
    """Correlation of their errors."""
    at_share: tuple[q.ShareAcross, ...] = ()
    """Lateral over axial force during the measurement of `value`, for the same two axes."""
    share_reach: q.Share = 0.0
    """Largest distance from `at_share` of the shares behind `across`."""
    stuck_ratio: _StuckRatio | None = None
    """Largest stiffness with a stuck contact over `value`; none: 3.8 (arm), 1 (machine)."""
    measured_on: q.Calendar | None = None
    """Day of the measurement."""
    valid_until: q.Calendar | None = None
    """Last day on which it may be used."""
    pose: q.Remark = ""
    """Pose of the measurement; empty: any."""
    direction: Annotated[str, q.Choice(("", "+fx", "-fx", "+fy", "-fy", "+fz", "-fz"))] = ""
    """Force axis of the measurement; empty: any."""
    temperature_c: q.Temperature | None = None
    """Temperature of the measurement."""
    record: q.FilePath | None = None
    """Record of `stepload calibrate`; its values replace those above."""
    policy: RecordPolicy = RecordPolicy.WARN
    """Reaction to a record that is missing, expired or for other conditions."""
    simulated: Annotated[bool, INTERNAL] = False
    joints_rad: Annotated[tuple[float, ...], INTERNAL] = ()
    tcp_offset: Annotated[SixFloats | None, INTERNAL] = None
    validity_problem: Annotated[str, INTERNAL] = ""

    @model_validator(mode="after")
    def _of_the_value(self) -> "SystemStiffness":
        """Make of a σ that is written as a share one in the unit of the value."""
        if isinstance(self.sigma_n_per_m, q.Relative):
            if self.stiffness_n_per_m is DERIVED:
                message = "`sigma` is a share of a value that is not stated"
                raise q.refused(message, "give `value`, or `sigma` in its unit")
            put(self, "sigma_n_per_m", self.stiffness_n_per_m * self.sigma_n_per_m)
        return self

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        value, sigma = self.stiffness_n_per_m, self.sigma_n_per_m
        first, last = self.measured_on, self.valid_until
        rows = self.deflection_force_n, self.deflection_m, self.deflection_sigma_m
        if value is DERIVED and self.record is None:
            hint = "give value and sigma, or the record of a calibration"
            yield "", "neither `value` nor `record`", hint
        elif (value is DERIVED) != (sigma is DERIVED):
            hint = "a stiffness without its uncertainty cannot be compensated"
            yield "", "`value` and `sigma` belong together", hint
        elif value is not DERIVED and sigma >= value:
            yield (
                "sigma",
                f"uncertainty {format_quantity(sigma, 'N/m')} is not below the stiffness "
                f"{format_quantity(value, 'N/m')}",
                "a stiffness known so badly is not known: calibrate it",
            )
        elif value is not DERIVED and (problem := disagreement(value, sigma, *rows)):
            hint = "look for a wrong prefix (µm, mm), or give the table that belongs to this value"
            yield "deflection", problem, hint
        if first and last and last < first:
            yield "valid_until", f"{last} is before measured_on {first}", "check the two dates"
        if any(rows) and (problem := table_problem(*rows)):
            yield (
                "deflection_force",
                f"table of the deflection: {problem}",
                "give deflection_force, deflection and deflection_sigma of every row, rising",
            )
        if problem := across_problem(self.across_m_per_n, self.across_sigma_m_per_n, self.at_share):
            yield (
                "across",
                f"lateral force: {problem}",
                "two numbers each, for the sensor's two other axes in the order x, y, z; `stepload "
                "calibrate` measures them",
            )


TABLE_AGREES = 0.1
"""Largest relative difference between the table of the deflection and the stiffness beside it."""
Numbers = Sequence[float]


def disagreement(
    stiffness_n_per_m: float, sigma_n_per_m: float, force_n: Numbers, deflection_m: Numbers,
    deflection_sigma_m: Numbers,
) -> str:  # fmt: skip
    """Why the stated K_s does not belong to this table, which must be sound; "" where it does."""
    if not any((force_n, deflection_m)) or table_problem(force_n, deflection_m, deflection_sigma_m):
        return ""
    slope = upper_stiffness_n_per_m(force_n, deflection_m)
    allowed = max(TABLE_AGREES, 3.0 * sigma_n_per_m / stiffness_n_per_m)
    if abs(slope / stiffness_n_per_m - 1.0) <= allowed:
        return ""
    return (
        f"the table has a stiffness of {format_quantity(slope, 'N/m')} above 40 % of its forces, "
        f"value is {format_quantity(stiffness_n_per_m, 'N/m')}"
    )
