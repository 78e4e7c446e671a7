"""What goes unseen on a rig, from the numbers of its envelope alone: no run is needed for it.

A fault does nothing on a rig whose rules see it at once, however it is timed. Where it can do
something is a corner of the rigs, and one that a search by runs hardly finds: nearly all of them
look alike. But how long a rule may need, and what it lets pass, are numbers that are derived before
anything moves, a hundred times faster than a run. So rigs are chosen by them before runs are spent.
"""

from __future__ import annotations

from collections.abc import Sequence

from stepload.envelope.envelope import Envelope
from stepload.envelope.unseen import frozen_main_s, frozen_second_s
from stepload.plan.model import Plan
from stepload_verify.campaign.mishaps import SILENT
from stepload_verify.campaign.scenario import expected_times
from stepload_verify.falsify.scene import believed
from stepload_verify.falsify.strata import Stratum

NO_RIG = -1.0
"""Of a point at which there is no rig that can press, or none within the time."""


def weakness(template: Plan, stratum: Stratum, point: Sequence[float]) -> float:
    """How much of what goes wrong in a stratum the rules of the rig at a point leave unseen.

    The product over its kinds: of a channel that freezes the share of the loading that may pass
    before equal samples give it away; of one that lies the force that R5 lets pass over F_c. Other
    kinds count for nothing: 1 where there is no more than those.
    """
    envelope = believed(template, stratum, point)
    if envelope is None:
        return NO_RIG
    share = 1.0
    for kind in stratum.wrong:
        share *= _unseen(kind, envelope)
    return share


def _unseen(kind: str, envelope: Envelope) -> float:
    plan, limits = envelope.plan, envelope.run_limits
    channel, _, what = kind.rpartition("_")
    if channel not in ("force", "second", "arm_force"):
        channel, what = kind.split("_")[0], kind.partition("_")[2]
    if what == "freeze" and channel != "arm":
        times = expected_times(plan, limits, plan.procedure.surface_distance_m)
        found_s = frozen_main_s(plan, limits) if channel == "force" else frozen_second_s(plan, limits)
        return min(1.0, found_s / (times.end_s - times.touch_s))
    if what in SILENT:
        allowed_n = limits.cross_tolerance_n + limits.cross_relative * limits.top_force_n
        return allowed_n / limits.elastic_limit_n
    return 1.0
