"""Whether an arm stands in the pose of its stiffness calibration; the plan adapted to its pose."""

from __future__ import annotations

from dataclasses import replace

from stepload.errors import RefusedError
from stepload.plan.model import Plan, Provenance, RecordPolicy
from stepload.rig.device import ArmConfiguration
from stepload.rig.pose import differences, stiffness_change


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
