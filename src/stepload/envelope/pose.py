"""Whether an open arm stands where its system stiffness was calibrated; a plan for where it is."""

from __future__ import annotations

from dataclasses import replace

from stepload.errors import RefusedError
from stepload.plan.model import Plan, Provenance, RecordPolicy
from stepload.rig.device import ArmConfiguration
from stepload.rig.pose import differences, stiffness_change


def plan_where_it_stands(plan: Plan, stands: ArmConfiguration | None) -> Plan:
    """The plan with a stiffness that is believed as far as the pose allows.

    Elsewhere than where it was calibrated the stiffness is a figure of this machine and no more:
    indicative, without its table, and as uncertain as the joints are off. An arm or a record that
    does not tell changes nothing; neither does a gauge across the contact, or a plan that is there
    to measure the stiffness.

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
