"""Upper bounds that follow from a rig's data: largest stiffness, delays, ages, speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from stepload.feasibility.press import PressRig
from stepload.plan.model import (
    ArmSpec,
    ForceSpec,
    Procedure,
    Provenance,
    Rig,
    SecondForceSource,
    Structure,
    SystemStiffness,
)

CROSS_CHECK_FILTER_S = 0.005
"""Time constant of the filter on the difference of the two force channels."""
BOTH_SIGMAS = 3.0 / math.sqrt(2.0)
"""Standard uncertainties by which two independent gains may both be too low: together as unlikely
as one that is by three."""
LEAST_STIFFNESS_DOUBT = {
    Provenance.MEASURED: 0.0,
    Provenance.DECLARED: 0.1,
    Provenance.INDICATIVE: 0.3,
}
"""Least relative uncertainty of K_s by its provenance; 3 sigma where that is more."""
ARM_STUCK_RATIO = 3.8
"""[C^-1]_zz C_zz, the 90th percentile over the tool-down poses of a UR3e, the largest of four arms
(UR5e 2.4, UR10e 2.6, UR16e 2.7; medians 1.1 to 1.4), with assumed joint stiffnesses. A
calibration that stuck itself has the factor in K_s already, and it counts once more."""
LEAST_CLASS_RATIO = 2.4
"""The smallest of these four: a smaller ratio holds for one pose only."""
AGE_S = 0.012
"""Age at which data stop a run where the plan does not say."""
AGE_PERIODS = 4.0
FASTEST_RETRACT_M_S = 0.02
QUANTA = 8
"""Quanta of a coarse sensor that its noise reaches: 8 sigma at the least."""
LOAD_TIMEOUTS = 20.0
"""Settle timeouts after which a load step is given up."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What the run has measured of its force sensor: noise (sd), the drift of its zero, and whether
    only its component along the pressing axis ever changes; and the noise of the second channel."""

    noise_n: float
    drift_n_per_s: float
    one_axis: bool = False
    second_noise_n: float = 0.0


def largest_sliding_stiffness(system: SystemStiffness) -> float:
    """The largest K_s in N/m that is believed possible: K_s + 3 sigma, more where it is a guess."""
    doubt = LEAST_STIFFNESS_DOUBT[system.provenance] * system.stiffness_n_per_m
    return system.stiffness_n_per_m + max(3.0 * system.sigma_n_per_m, doubt)


def stuck_ratio(rig: Rig) -> tuple[float, str]:
    """The largest factor by which friction at the tip stiffens the load path, and its source."""
    stated = rig.system_stiffness.stuck_ratio
    if stated is not None:
        return stated, "rig: system_stiffness.stuck_ratio"
    if rig.arm.structure is Structure.MACHINE:
        return 1.0, "rig: arm.structure is machine"
    return ARM_STUCK_RATIO, "an arm, no stuck_ratio stated"


def largest_stiffness(rig: Rig) -> float:
    """The largest stiffness in N/m of the load path: K_s + 3 sigma with the tip held sideways."""
    return largest_sliding_stiffness(rig.system_stiffness) * stuck_ratio(rig)[0]


def age_limit_s(stream: ForceSpec | ArmSpec) -> float:
    """Age in s at which data of a stream stop the run (R3): the plan's, at least 4 periods."""
    return max(stream.max_age_s or AGE_S, AGE_PERIODS / stream.rate_hz)


def comparison_period_s(rig: Rig) -> float:
    """Time in s from one comparison of the force channels to the next: the slower one's period."""
    second = rig.second_force.sensor
    return max(1.0 / rig.force.rate_hz, 1.0 / (second.rate_hz if second else rig.arm.rate_hz))


def channel_skew_s(rig: Rig) -> float:
    """Upper bound in s on how much older one force channel's reading may be than the other's.

    When they are compared one of them may have waited for the other for up to a period.
    """
    second = rig.second_force.sensor
    delay_s = max(rig.force.delay_s, second.delay_s if second else 0.0)
    return delay_s + comparison_period_s(rig) + 2.0 / rig.arm.rate_hz


def common_error(rig: Rig) -> tuple[float, str]:
    """Share by which all force channels may read too little together, and where it is from.

    What they have in common; or what two sensors state of their gains, which may both be too low.
    """
    second = rig.second_force.sensor
    if second is not None:
        both = BOTH_SIGMAS * min(rig.force.gain_uncertainty, second.gain_uncertainty)
        if both > rig.common_force_error:
            return both, f"{BOTH_SIGMAS:.1f} times the smaller gain_uncertainty of both sensors"
    return rig.common_force_error, "rig.common_force_error"


def cross_blind_n(rig: Rig, noise_n: float, second_noise_n: float = 0.0) -> float:
    """How far in N beyond the tolerance of R5 noise may hide a difference of the channels.

    R5 compares the ranges of filtered readings over the skew, less a standard deviation of their
    noise (`engine.cross_check`). N readings of a standard deviation σ reach σ·sqrt(2 ln N) from
    their middle at the most, on average; what of that is not taken off widens the ranges.

    Args:
        rig: with a second force channel.
        noise_n, second_noise_n: standard deviation of a reading of the main and of the second
            channel, where it is worse than stated.
    """
    second = rig.second_force
    noises_n = (rig.force.noise_n, noise_n), (second.noise_n, second_noise_n)
    second_hz = second.sensor.rate_hz if second.sensor else rig.arm.rate_hz
    tick_s, skew_s = 1.0 / rig.arm.rate_hz, channel_skew_s(rig)
    blind_n = 0.0
    taken_off = _filtered(min(1.0, tick_s / CROSS_CHECK_FILTER_S))
    for (stated_n, found_n), rate_hz in zip(noises_n, (rig.force.rate_hz, second_hz), strict=True):
        period_s = max(tick_s, 1.0 / rate_hz)
        readings = 1 + math.ceil(skew_s / period_s - 1e-9)
        left = _filtered(-math.expm1(-period_s / CROSS_CHECK_FILTER_S))
        reach = math.sqrt(2.0 * math.log(readings))
        blind_n += max(0.0, reach * left * max(stated_n, found_n) - taken_off * stated_n)
    return blind_n


def _filtered(alpha: float) -> float:
    """Share of white noise that a filter leaves which takes this share of each reading."""
    return math.sqrt(alpha / (2.0 - alpha))


def follow_travel(arm: ArmSpec) -> float:
    """Travel in m that an arm must be given before it can be seen whether it follows."""
    return 2.0 * arm.position_resolution_m + 4.0 * arm.position_noise_m + arm.lost_motion_m


def step_rate_per_s(loop_s: float) -> float:
    """λ = 0.25/T of the step controller, from the loop delay T in s."""
    return 0.25 / loop_s


def shown_noise_n(noise_n: float, resolution_n: float) -> float:
    """Largest standard deviation in N that readings of this noise and resolution can show.

    On average over the position of the force within a quantum q it is sqrt(σ² + q²/12). A force at
    the edge of a quantum flips between two values half a quantum away, which is what a coarse
    sensor may show.
    """
    if resolution_n <= noise_n:
        return math.hypot(noise_n, resolution_n / math.sqrt(12.0))
    below = [math.erf(j * resolution_n / (noise_n * math.sqrt(2.0))) for j in range(QUANTA + 1)]
    odds = [above - less for less, above in pairwise(below)]
    return resolution_n * math.sqrt(sum(p * (j + 0.5) ** 2 for j, p in enumerate(odds)))


def step_band_n(noise_n: float) -> float:
    """How near in N a load step comes to its level: 0.25 N, or two sigma of noise."""
    return max(0.25, 2.0 * noise_n)


def retract_speed_m_s(rig: Rig) -> float:
    """Half the arm's largest speed, at most 20 mm/s."""
    return min(0.5 * rig.arm.max_speed_m_s, FASTEST_RETRACT_M_S)


def step_patience_s(procedure: Procedure) -> float:
    """Time in s after which a load step that does not reach its level is given up."""
    return LOAD_TIMEOUTS * procedure.settle_timeout_s


def press_rig(rig: Rig, noise_n: float) -> PressRig:
    """Upper bounds of a rig's stiffness, delays and inertia, from the plan."""
    arm, force = rig.arm, rig.force
    tick_s = 1.0 / arm.rate_hz
    parts_s = (
        force.delay_s,
        1.0 / force.rate_hz,
        tick_s,
        tick_s,  # computing and jitter
        arm.command_delay_s,
        arm.lag_s,
    )
    total_s = sum(parts_s)
    loop_s = rig.loop_delay_s if rig.loop_delay_s is not None else total_s
    second = rig.second_force
    has_second = second.source is not SecondForceSource.NONE
    return PressRig(
        stiffness_n_per_m=largest_stiffness(rig),
        damping_n_s_per_m=rig.system_stiffness.damping_n_s_per_m,
        mass_kg=arm.effective_mass_kg,
        acceleration_m_s2=arm.max_acceleration_m_s2,
        lag_s=arm.lag_s,
        noise_n=noise_n,
        reaction_s=max(total_s, loop_s),
        loop_s=loop_s,
        cross_check_s=(
            second.time_s + CROSS_CHECK_FILTER_S + channel_skew_s(rig) + comparison_period_s(rig)
            if has_second
            else 0.0
        ),
    )
