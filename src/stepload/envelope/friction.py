"""Preflight reasons on friction at the contact of a serial arm: how well K_s will hold."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from stepload.envelope.bounds import LEAST_CLASS_RATIO, largest_stiffness, stuck_ratio
from stepload.envelope.conditions import across_of, gauge_offset_of
from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import Theory
from stepload.evidence.askew import TURN_RAD_PER_N
from stepload.evidence.gates import FRICTION_HARMLESS, LATERAL_SHARE
from stepload.plan.model import Plan, Provenance, Structure
from stepload.units import format_quantity

TYPICAL_SHARE = 0.3
"""Lateral force over axial force of a contact that slides with a friction of 0.3."""

NO_ARM = "; only where this is no serial arm but a guided axis: rig.arm.structure: machine"


def friction_reasons(plan: Plan, theory: Theory) -> Iterator[Reason]:
    """Whether friction affects the result of an arm, and what would remove its effect."""
    stiffness, arm = plan.rig.system_stiffness, plan.rig.arm
    yield from _ratio_reasons(plan)
    yield from _gauge_reasons(plan, theory)
    if plan.rig.displacement is not None or plan.identify.kind == "system":
        return
    if arm.structure is not Structure.ARM:
        return
    known, k_s = across_of(stiffness), stiffness.stiffness_n_per_m
    if known.per_newton_m is not None:
        shares = [
            np.array(known.at_share or (0.0, 0.0))
            + TYPICAL_SHARE * np.array([np.cos(a), np.sin(a)])
            for a in np.linspace(0.0, math.pi, 13)
        ]
        doubts = [k_s * known.doubt_m_per_n(share, k_s) for share in shares]
        yield Reason(
            "across_known", Severity.NOTE,
            f"what the force across the axis does to the arm is taken out; at a share of "
            f"{TYPICAL_SHARE:.0%} from that of the calibration it leaves {min(doubts):.1%} to "
            f"{max(doubts):.1%} of the arm's deflection, by its direction (standard uncertainty)",
            "a force sensor with one axis tells nothing of it: the result is marginal then",
            max(doubts), math.nan, "",
        )  # fmt: skip
        return
    if known.at_share is not None:
        yield Reason(
            "one_friction", Severity.NOTE,
            "K_s is one number and holds where the force across the axis is within "
            f"{LATERAL_SHARE:.0%} of the share of the calibration; beyond, or with a force sensor "
            "of one axis, the result is marginal at best",
            "calibrate dry and greased in one go: stepload calibrate --from DRY GREASED",
            LATERAL_SHARE, math.nan, "",
        )  # fmt: skip
        return
    top_n = plan.procedure.top_force_n
    ratio, _ = stuck_ratio(plan.rig)
    worst = (1.0 - 1.0 / ratio) * theory.law.secant(top_n) / k_s
    serious = worst > FRICTION_HARMLESS
    yield Reason(
        "friction_unknown", Severity.WARN if serious else Severity.NOTE,
        "an arm gives way sideways, and friction that holds its tip makes it up to "
        f"{ratio:.3g} times as stiff; under which friction K_s was measured is not known. This may "
        f"change the deformation by up to {worst:.0%} (allowed {FRICTION_HARMLESS:.0%})"
        + (": the result will be marginal" if serious else ""),
        "calibrate with a six-axis force sensor, dry and greased (stepload calibrate), or measure "
        "with a gauge across the contact" + ("" if arm.kinematics else NO_ARM),
        worst, FRICTION_HARMLESS, "",
    )  # fmt: skip


def _ratio_reasons(plan: Plan) -> Iterator[Reason]:
    """Whether a stuck ratio of one pose is combined with a K_s that is a guess for all poses."""
    stiffness, arm = plan.rig.system_stiffness, plan.rig.arm
    ratio = stiffness.stuck_ratio
    if arm.structure is not Structure.ARM or stiffness.provenance is not Provenance.INDICATIVE:
        return
    if ratio is None or ratio >= LEAST_CLASS_RATIO:
        return
    most = format_quantity(largest_stiffness(plan.rig), "N/m")
    yield Reason(
        "stuck_ratio_of_a_guess", Severity.WARN,
        f"rig.system_stiffness.stuck_ratio = {ratio:.3g} is less than that of a class of arms "
        f"({LEAST_CLASS_RATIO:.3g} and more), and K_s beside it was not measured: a ratio of one "
        "pose multiplies the K_s of that pose only. A stiff pose may be three times as stiff as "
        f"the K_s of its class, and then the {most} that every bound of force goes by are too few",
        "calibrate in this pose first, and press only what you can lose until then; or leave "
        "stuck_ratio to the profile",
        ratio, LEAST_CLASS_RATIO, "",
    )  # fmt: skip


def _gauge_reasons(plan: Plan, theory: Theory) -> Iterator[Reason]:
    """Whether it is stated how far beside the contact a gauge on an arm measures: the arm turns."""
    gauge, offset_m = plan.rig.displacement, gauge_offset_of(plan.rig)
    if gauge is None or gauge.offset_m is not None or offset_m == 0.0:
        return
    harm = offset_m * TURN_RAD_PER_N * theory.law.secant(plan.procedure.top_force_n)
    yield Reason(
        "gauge_offset", Severity.NOTE,
        "an arm turns when it is pressed, and a gauge beside the contact reads that too; how far "
        f"beside it measures is not stated and counts as {format_quantity(offset_m, 'm')}, which "
        f"costs {harm:.1%} of the deformation (standard uncertainty)",
        "state rig.displacement.offset, or put two gauges on both sides of the contact",
        harm, math.nan, "",
    )  # fmt: skip
