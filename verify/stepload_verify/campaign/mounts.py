"""Random rigs with six axes: mounting of the tip, contact with the plate, and their plan.

A stance is drawn before the plan and does not fix the stiffness along the axis. A sound stance is
within the limits of the plan; `mounted` makes the truth of it, with deliberate anomalies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from random import Random

from stepload.feasibility.bounds import stuck_ratio
from stepload.feasibility.preflight import Preflight
from stepload.plan.model import Plan, Structure
from stepload.rig.mount import Matrix3, Matrix6, Mount, SensorMount
from stepload.rig.world import WorldSpec
from stepload_verify.campaign.plants import STVF_STIFFNESS_N_PER_M, log_uniform
from stepload_verify.campaign.truth import Anomaly

LARGEST_SHARE = 0.28
"""Largest lateral share of a sound rig; plans allow 30 %."""
LEVER_M = 0.12
CROSS_TALK = 0.01
"""Cross-talk among forces and among torques; forces appear in torques with 0.5 mm."""
TORQUE_ARM_M = 0.02
"""Noise of a torque over that of a force."""
STVF_LATERAL_N_PER_M = 2e6
STATED_SHARE = 0.6
"""Share of arms whose plan states the stiffness of a tip that sticks; others use the default."""
DRY_SHARE = 0.5
"""Share of arms whose K_s was measured on a block that held the tip sideways to some degree."""
STEEPEST_RAD = math.radians(7.0)
"""Largest tilt of the plate that some plans allow."""
LARGEST_STEEP_SHARE = 0.2
"""`LARGEST_SHARE` of a rig with such a plan: R12 includes the tilt."""
_ATTEMPTS = 1000


@dataclass(frozen=True, slots=True)
class Stance:
    """Mounting of a rig's tip.

    Attributes:
        ur: an arm, and not a guided axis.
        coupling: sideways over axial motion of a tip that slides freely, and its direction.
        lateral: compliance across the axis over that along it.
        stated_ratio: stiffness ratio of a sticking tip in the plan; None: not stated.
        dry_ratio: K_s of the block that the plan believes over that without friction.
        friction, kinetic_share: static friction, and kinetic friction over it.
        tilt_rad, turn_rad, off_m: size of the plate's tilt, of the sensor's mounting error, and of
            the contact's distance from the axis; each with a direction of its own in `directions`.
        tips_rad_per_n: rotation of the tool per newton.
        rating: torque rating over what a run within the plan can need; 0: none stated.
        stated_tilt_rad: largest tilt of the plate in the plan; None: not stated.
    """

    ur: bool
    coupling: float
    lateral: float
    stated_ratio: float | None
    dry_ratio: float
    friction: float
    kinetic_share: float
    tilt_rad: float
    turn_rad: float
    off_m: float
    tips_rad_per_n: float
    rating: float
    directions: tuple[float, float, float, float, float]
    stated_tilt_rad: float | None = None

    @property
    def stuck_ratio(self) -> float:
        """Stiffness of a tip that sticks over that of one that slides freely."""
        return 1.0 / (1.0 - self.coupling**2 / self.lateral)

    @property
    def share(self) -> float:
        """Upper bound of the lateral share, as the sensor shows it."""
        dragged = min(self.friction, self.coupling / self.lateral)
        return dragged + math.tan(self.tilt_rad) + math.tan(self.turn_rad) + CROSS_TALK

    @property
    def sound(self) -> bool:
        """Whether a plan would accept such a rig."""
        largest = LARGEST_SHARE if self.stated_tilt_rad is None else LARGEST_STEEP_SHARE
        return 0.2 < self.lateral < 5.0 and self.share < largest


def draw_stance(chance: Random, ur: bool, stated_tilt_rad: float | None = None) -> Stance:
    """A sound stance, whose lateral share is within the plan."""
    for _ in range(_ATTEMPTS):
        stance = replace(any_stance(chance, ur), stated_tilt_rad=stated_tilt_rad)
        if stance.sound:
            break
    return stance


def any_stance(chance: Random, ur: bool) -> Stance:
    """A stance that may be unsound; reads up to 19 numbers."""
    u = chance.uniform
    coupling = log_uniform(chance, 0.15, 1.3) if ur else u(0.02, 0.2)
    ratio = 1.0 + log_uniform(chance, 0.02, 2.3)
    lateral = STVF_STIFFNESS_N_PER_M / STVF_LATERAL_N_PER_M
    if ur:
        lateral = coupling**2 / (1.0 - 1.0 / ratio)
    stated = u(1.0, 1.3) * ratio if ur and chance.random() < STATED_SHARE else None
    sticks = min(1.0, u(0.1, 0.6) * lateral / coupling)
    dry = 1.0 / (1.0 - sticks * (1.0 - 1.0 / ratio)) if ur and chance.random() < DRY_SHARE else 1.0
    return Stance(
        ur=ur, coupling=coupling, lateral=lateral, stated_ratio=stated, dry_ratio=dry,
        friction=u(0.05, 0.6), kinetic_share=u(0.6, 1.0), tilt_rad=math.radians(u(0.0, 3.0)),
        turn_rad=math.radians(u(0.0, 2.0)), off_m=u(0.0, 3e-3),
        tips_rad_per_n=u(20e-6, 70e-6) if ur else u(0.0, 2e-6),
        rating=u(1.1, 3.0) if chance.random() < 0.5 else 0.0,
        directions=(u(0.0, 6.3), u(0.0, 6.3), u(0.0, 6.3), u(0.0, 6.3), u(0.0, 6.3)),
    )  # fmt: skip


def told(plan: Plan, stance: Stance) -> Plan:
    """The plan with the statements of its rig file about six axes."""
    rig, top_n = plan.rig, plan.procedure.top_force_n
    rated: tuple[float, ...] = ()
    if stance.rating:
        rated = (stance.rating * _needed_torque(plan, top_n),) * 3
    return replace(
        plan,
        rig=replace(
            rig,
            arm=replace(rig.arm, structure=Structure.ARM if stance.ur else Structure.MACHINE),
            force=replace(rig.force, lever_m=LEVER_M, rated_torque_n_m=rated),
            system_stiffness=replace(rig.system_stiffness, stuck_ratio=stance.stated_ratio),
            plate_tilt_rad=stance.stated_tilt_rad,
        ),
    )


def _needed_torque(plan: Plan, top_n: float) -> float:
    """Beyond R13's 80 %, the torque at the top force of the largest share and eccentricity."""
    return top_n * (plan.procedure.max_lateral_share * LEVER_M + 3e-3) / 0.8


def fits(preflight: Preflight, stance: Stance) -> bool:
    """Whether R12 allows the top force of the plan at the lateral share of this stance.

    Preflight does not check that: F_allowed is that of a load along the axis.
    """
    limits, top_n = preflight.run_limits, preflight.plan.procedure.top_force_n
    worse = stance.share * (stance.share + 2.0 * limits.lateral_askew)
    left = 1.0 - limits.lateral_weakening * worse
    noise_n = 8.0 * preflight.plan.rig.force.noise_n + 0.5
    return 1.03 * top_n * math.hypot(1.0, stance.share) + noise_n < left * limits.allowed_n


def mounted(
    truth: WorldSpec, preflight: Preflight, stance: Stance, anomalies: tuple[Anomaly, ...]
) -> WorldSpec:
    """The truth with six axes; `anomalies` of `SIX_MISTAKES` change the stance."""
    plan = preflight.plan
    values = {anomaly.kind: anomaly.value for anomaly in anomalies}
    expected, _ = stuck_ratio(plan.rig)
    stance = _changed(stance, values, expected)
    k_s = truth.system_stiffness_n_per_m / stance.dry_ratio
    return replace(
        truth,
        system_stiffness_n_per_m=k_s,
        payload=replace(truth.payload, poisson_ratio=plan.payload.material.poisson_ratio),
        mount=_mount(stance, plan, 1.0 / k_s, LEVER_M + values.get("wrong_lever", 0.0)),
    )


def _changed(stance: Stance, values: dict[str, float], believed_ratio: float) -> Stance:
    """The deliberate anomaly."""
    if "stuck_stiffer" in values:
        ratio = believed_ratio * values["stuck_stiffer"]
        coupling = max(stance.coupling, 0.8)
        stance = replace(
            stance, coupling=coupling, lateral=coupling**2 / (1.0 - 1.0 / ratio),
            friction=max(stance.friction, 0.5), dry_ratio=1.0,
        )  # fmt: skip
    if "dragged_aside" in values:
        share = values["dragged_aside"]
        coupling = min(stance.coupling, 0.9 / share)
        stance = replace(stance, coupling=coupling, lateral=coupling / share, friction=share)
    if "plate_tilted" in values:
        stance = replace(stance, tilt_rad=values["plate_tilted"])
    if "off_centre" in values:
        stance = replace(stance, off_m=values["off_centre"])
    return stance


def _mount(stance: Stance, plan: Plan, along: float, lever_m: float) -> Mount:
    aside, tilted, turned, off, tips = stance.directions
    x, y = stance.coupling * along * math.cos(aside), stance.coupling * along * math.sin(aside)
    across = stance.lateral * along
    compliance: Matrix3 = (across, 0.0, x), (0.0, across, y), (x, y, along)
    by = stance.tips_rad_per_n
    force = plan.rig.force
    torque_nm = math.inf
    if force.rated_torque_n_m:
        torque_nm = force.rated_torque_n_m[0]
    sensor = SensorMount(
        rotation_rad=(
            stance.turn_rad * math.cos(turned), stance.turn_rad * math.sin(turned), 0.0,
        ),
        lever_m=(stance.off_m * math.cos(off), stance.off_m * math.sin(off), lever_m),
        cross_talk=_cross_talk(stance.directions),
        torque_noise_nm=TORQUE_ARM_M * force.noise_n,
        torque_quantum_nm=TORQUE_ARM_M * force.resolution_n,
        torque_range_nm=torque_nm,
    )  # fmt: skip
    return Mount(
        compliance_m_per_n=compliance,
        turn_rad_per_n=(
            (0.0, 0.0, by * math.cos(tips)), (0.0, 0.0, by * math.sin(tips)), (0.0, 0.0, 0.0),
        ),
        friction_static=stance.friction,
        friction_kinetic=stance.kinetic_share * stance.friction,
        plate_tilt_rad=(
            stance.tilt_rad * math.cos(tilted), stance.tilt_rad * math.sin(tilted),
        ),
        gauge_offset_m=(2e-3 * math.cos(off), 2e-3 * math.sin(off)),
        sensor=sensor,
        second_sensor=replace(sensor, rotation_rad=(0.0, 0.0, 0.0), cross_talk=None),
    )  # fmt: skip


def _cross_talk(directions: tuple[float, ...]) -> Matrix6:
    """Up to 1 % of every force in the other forces, of every torque in the other torques."""

    def row(i: int) -> tuple[float, float, float, float, float, float]:
        a, b, c, d, e, f = (
            CROSS_TALK * math.sin((i + 1) * directions[j % 5] + j)
            if i // 3 == j // 3 and i != j
            else (5e-4 * math.sin(i + directions[j]) if i > 2 > j else 0.0)
            for j in range(6)
        )
        return a, b, c, d, e, f

    return tuple(row(i) for i in range(6))
