"""How well the deflection of the system is known: by a table of this pose, or by K_s alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from stepload.errors import RefusedError
from stepload.feasibility.reason import Reason, Severity
from stepload.identification.deflection import BEGINS, BEYOND, DeflectionTable
from stepload.identification.smooth import NORMAL_95
from stepload.plan.model import Plan, Provenance, RecordPolicy
from stepload.rig.device import ArmConfiguration
from stepload.rig.pose import differences, stiffness_change
from stepload.units import format_quantity, percent


@dataclass(frozen=True, slots=True)
class KnownStiffness:
    """The deflection that is subtracted, and how well it is known.

    Attributes:
        table: the table of this pose; None where K_s alone is known.
        sigma_n_per_m: standard uncertainty of K_s; with a table, the one common to its rows.
        why_no_table: why there is none; "" where there is one.
    """

    table: DeflectionTable | None
    sigma_n_per_m: float
    why_no_table: str


def known_stiffness(plan: Plan) -> KnownStiffness:
    """The table of the deflection where it holds, else K_s alone.

    A table holds in the pose it was made in, while its record is valid, if it begins low enough.
    Where the plan or the table does not name a pose and the other does, they are not the same.
    """
    stated, arm = plan.rig.system_stiffness, plan.rig.arm
    rows = stated.deflection_force_n, stated.deflection_m, stated.deflection_sigma_m
    if not any(rows):
        why = "there is none"
    elif stated.validity_problem:
        why = stated.validity_problem
    elif stated.pose != arm.pose:
        mine, theirs = arm.pose or "not stated", stated.pose or "not stated"
        why = f"it was made in pose {theirs!r}, this is {mine!r}"
    elif rows[0][0] > BEGINS * plan.procedure.top_force_n:
        first = format_quantity(rows[0][0], "N")
        why = f"its first row is at {first}, above {percent(BEGINS, 2)} of the top force"
    else:
        common = stated.deflection_common * stated.stiffness_n_per_m
        return KnownStiffness(DeflectionTable(*rows), common, "")
    return KnownStiffness(None, stated.sigma_n_per_m, why)


def stiffness_reasons(plan: Plan) -> Iterator[Reason]:
    """Reasons on the table of the deflection, where the result depends on K_s at all."""
    if plan.rig.displacement is not None or plan.identify.kind == "system":
        return
    known, top_n = known_stiffness(plan), plan.procedure.top_force_n
    stated = plan.rig.system_stiffness
    if known.table is None:
        relative = known.sigma_n_per_m / stated.stiffness_n_per_m
        yield Reason(
            "no_deflection_table", Severity.NOTE,
            f"No table of the system's deflection in this pose ({known.why_no_table}): K_s counts "
            f"as known to ±{100.0 * NORMAL_95 * relative:.2g} % (95 %).",
            "measure one in this pose: stepload calibrate PLAN --record FILE",
            relative, math.nan, "",
        )  # fmt: skip
        return
    last_n = known.table.force_n[-1]
    share = min(1.0, last_n / top_n)
    short = top_n > BEYOND * last_n
    yield Reason(
        "deflection_table", Severity.NOTE,
        f"The table of the system's deflection ends at {format_quantity(last_n, 'N')}, "
        f"{percent(share, 2)} of the top force.",
        f"stepload calibrate in this pose, up to {format_quantity(top_n, 'N')}" if short else "",
        last_n, top_n, "N",
    )  # fmt: skip


def plan_where_it_stands(plan: Plan, stands: ArmConfiguration | None) -> Plan:
    """The plan, with its system stiffness downgraded where the arm stands in another pose.

    In another pose than that of the calibration the stiffness is only indicative, loses its table,
    and is the more uncertain the more the joints differ. Nothing changes where the arm or the
    record states no pose, with a gauge across the contact, or in a plan that measures the
    stiffness.

    Raises:
        RefusedError: it stands elsewhere, and the policy of the record is to refuse.
    """
    stiffness = plan.rig.system_stiffness
    made = ArmConfiguration(stiffness.joints_rad or None, stiffness.tcp_offset)
    needed = plan.rig.displacement is None and plan.identify.kind != "system"
    found = differences(made, stands) if stands is not None and needed else []
    if not found:
        return plan
    problem = f"made in another pose than the arm stands in: {'; '.join(found)}"
    if stiffness.policy is RecordPolicy.REFUSE:
        raise RefusedError(
            f"system stiffness: {stiffness.record} was {problem}",
            hint="lead the arm to the pose of the calibration, calibrate in this one (stepload "
            "calibrate), or set rig.system_stiffness.policy: warn",
        )
    assert stands is not None
    share = stiffness_change(made, stands)
    changed = replace(
        stiffness,
        sigma_n_per_m=max(stiffness.sigma_n_per_m, share * stiffness.stiffness_n_per_m),
        provenance=Provenance.INDICATIVE,
        validity_problem="; ".join(filter(None, (stiffness.validity_problem, problem))),
    )
    return replace(plan, rig=replace(plan.rig, system_stiffness=changed))
