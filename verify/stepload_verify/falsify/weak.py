"""How much can go undetected on a rig, from its envelope alone, without a run.

A fault has no effect on a rig whose rules detect it at once, whatever its time. Rigs on which it
has one may be a corner case that a search by runs hardly finds, since all other rigs give the same
score. But the tolerance of a rule is a number of the envelope, which is derived a thousand times
faster than a run is done. So rigs are chosen by it before runs are spent on them.
"""

from __future__ import annotations

from collections.abc import Sequence

from stepload.envelope.unseen import unseen

from stepload.plan.model import Plan
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.scenario import expected_times
from stepload_verify.falsify.scene import believed
from stepload_verify.falsify.strata import Stratum

NO_RIG = -1.0
"""Of a point at which there is no rig that can press, or none within the time."""
SECOND_FREEZES = ("second_freeze", "arm_force_freeze", "arm_freeze")
FREEZES = ("force_freeze", *SECOND_FREEZES)


def weakness(
    template: Plan, ablation: Ablation | None, stratum: Stratum, point: Sequence[float]
) -> float:
    """How weak the rig at a point is where a channel is frozen, by what preflight bounds.

    The share of the loading for which equal samples do not tell, and the force over F_c that builds
    up beside a frozen channel, for the least gain: the time alone is a slope where the force is
    none yet, and the largest gains come near F_c on every rig that is pressed near it. 0 in strata
    without such a fault: there is none that tells.
    """
    envelope = believed(template, stratum, point)
    if envelope is None:
        return NO_RIG
    if not any(kind in FREEZES for kind in stratum.wrong):
        return 0.0
    limits = ablation.limits(envelope.run_limits) if ablation else envelope.run_limits
    found = unseen(envelope.plan, limits)
    if found is None:
        return 0.0
    times = expected_times(envelope.plan, limits, envelope.plan.procedure.surface_distance_m)
    main_only = not any(kind in SECOND_FREEZES for kind in stratum.wrong)
    frozen_s = found.main_s if main_only else found.second_s
    unseen_share = min(1.0, frozen_s / (times.end_s - times.touch_s))
    return unseen_share + found.forces_n[0] / limits.elastic_limit_n
