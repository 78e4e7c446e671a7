"""A small shake in free air, by whose inertia the force channels prove that they are alive.

The arm moves back from the plate and returns, x = x₀ − A (1 − cos ωt)/2. A channel with the mass m
on its measured side reads m ẍ then, in phase with the acceleration, and positive where pressing is.
Amplitude, frequency and number of cycles follow from what the arm and the limits of the run allow,
and from the noise of the channels: the shortest shake that measures the mass well enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from stepload.envelope.limits import RunLimits
from stepload.plan.model import ForceSpec, Plan, SecondForce, SecondForceSource

HALF_WIDTH = 0.2
"""Largest half width of the 99 % interval of the felt mass, as a share of the stated mass."""
PLANNED_HALF_WIDTH = 0.5 * HALF_WIDTH
"""A shake is planned for half of it: noise may be twice what the plan says."""
LEVEL = 0.995
SETTLING_CYCLES = 2
"""Cycles at the start that do not count: the arm's motion is not periodic yet."""
CYCLES = range(8, 61)
"""Cycles that count."""
LONGEST_S = 8.0
FORCE_SHARE = 0.25
"""Share of F_lim that the inertia, as predicted by R2, may reach."""
CROSS_SHARE = 0.5
"""Share of R5's tolerance that the inertia may reach: only one of the channels may feel it."""
TICKS_A_CYCLE = 20.0
BLURS = 5.0
"""Least ratio of the travel to the blur of the arm's positions."""
SLOWER, SLOWEST = 0.8, 16
QUANTA = 2.0
"""Least ratio of inertia to resolution for a channel whose noise is too small to dither it."""
STIRRED = 0.3
"""Ratio of noise to resolution above which a quantised swing has the right amplitude to 6 %."""
_RESONANCE_SHARE = 0.25
_QUANTUM_SIGMA = 1.0 / math.sqrt(12.0)


@dataclass(frozen=True, slots=True)
class ShakenChannel:
    """A force channel whose mass is stated; `key` is its section of the plan.

    `noise_n` holds the quantisation; `delay_s` is from force to sample on the host.
    """

    name: str
    key: str
    second: bool
    mass_kg: float
    noise_n: float
    resolution_n: float
    stirred: bool
    rate_hz: float
    delay_s: float


@dataclass(frozen=True, slots=True)
class Shake:
    """A shake forwards by `travel_m`, on a way that was backed off before, and back again.

    `follow` is the share of it that an arm with this lag still goes. `cycles` count, after
    `SETTLING_CYCLES`; `coverage` is the quantile of Student's distribution by which their scatter
    is widened to a 99 % interval. `half_widths` are the expected uncertainties of the measured
    masses as shares of the stated ones, one for each of `channels`. `untold` are the best shakes of
    channels that this one leaves out, since none measures their mass.
    """

    travel_m: float
    omega_rad_s: float
    follow: float
    cycles: int
    coverage: float
    channels: tuple[ShakenChannel, ...]
    half_widths: tuple[float, ...] = ()
    untold: tuple[Shake, ...] = ()

    @property
    def period_s(self) -> float:
        """Time of one cycle."""
        return 2.0 * math.pi / self.omega_rad_s

    @property
    def duration_s(self) -> float:
        """Time of all cycles."""
        return (SETTLING_CYCLES + self.cycles) * self.period_s

    @property
    def acceleration_m_s2(self) -> float:
        """Largest acceleration of an arm that follows with its lag."""
        return 0.5 * self.follow * self.travel_m * self.omega_rad_s**2

    @property
    def tells(self) -> bool:
        """Whether the mass of every channel will be measured precisely enough."""
        return all(self.visible(channel) for channel in self.channels) and all(
            half_width <= PLANNED_HALF_WIDTH for half_width in self.half_widths
        )

    def visible(self, channel: ShakenChannel) -> bool:
        """Whether the inertia is not lost in the channel's resolution."""
        inertia_n = channel.mass_kg * self.acceleration_m_s2
        return channel.stirred or inertia_n >= QUANTA * channel.resolution_n


def channels_of(plan: Plan) -> tuple[ShakenChannel, ...]:
    """The force channels of a plan whose mass is stated."""
    force, second, tick_hz = plan.rig.force, plan.rig.second_force, plan.rig.arm.rate_hz
    found = []
    if force.tool_mass_kg is not None:
        found.append(_channel(force, force.tool_mass_kg, force, tick_hz))
    if second.tool_mass_kg is not None and second.source is not SecondForceSource.NONE:
        found.append(_channel(second, second.tool_mass_kg, second.sensor, tick_hz))
    return tuple(found)


def _channel(
    channel: ForceSpec | SecondForce, mass_kg: float, sensor: ForceSpec | None, tick_hz: float
) -> ShakenChannel:
    second, noise_n = isinstance(channel, SecondForce), channel.noise_n
    resolution_n = sensor.resolution_n if sensor else 0.0
    return ShakenChannel(
        name="second force channel" if second else "force sensor",
        key="rig.second_force" if second else "rig.force",
        second=second,
        mass_kg=mass_kg,
        noise_n=math.hypot(noise_n, _QUANTUM_SIGMA * resolution_n),
        resolution_n=resolution_n,
        stirred=noise_n >= STIRRED * resolution_n,
        rate_hz=min(sensor.rate_hz, tick_hz) if sensor else tick_hz,
        delay_s=sensor.delay_s if sensor else 0.0,
    )


def shake_for(plan: Plan, limits: RunLimits) -> Shake | None:
    """The shortest shake that measures the stated masses, else the one that comes nearest to it.

    A mass that no shake can measure is left out where another one can be measured, the main
    sensor's first. None where no mass is stated. The caller must check whether it `tells`.
    """
    channels = channels_of(plan)
    if not channels:
        return None
    shake = _best(plan, limits, channels)
    if shake.tells or len(channels) == 1:
        return shake
    alone = [_best(plan, limits, (channel,)) for channel in channels]
    for each in alone:
        if each.tells:
            return replace(each, untold=tuple(other for other in alone if other is not each))
    return shake


def _best(plan: Plan, limits: RunLimits, channels: tuple[ShakenChannel, ...]) -> Shake:
    fastest = _fastest(plan, channels)
    shakes = [
        _with_cycles(plan, _largest(plan, limits, fastest * SLOWER**slower, channels))
        for slower in range(SLOWEST)
    ]
    telling = [shake for shake in shakes if shake.tells]
    if telling:
        return min(telling, key=lambda shake: shake.duration_s)
    return min(shakes, key=lambda shake: max(shake.half_widths))


def _fastest(plan: Plan, channels: tuple[ShakenChannel, ...]) -> float:
    """ω in rad/s that arm, structure and sensors still follow well."""
    arm, stiffness = plan.rig.arm, plan.rig.system_stiffness.stiffness_n_per_m
    rate_hz = min(arm.rate_hz, *(channel.rate_hz for channel in channels))
    slowest_s = max(arm.lag_s, *(channel.delay_s for channel in channels))
    return min(
        2.0 * math.pi * rate_hz / TICKS_A_CYCLE,
        _RESONANCE_SHARE * math.sqrt(stiffness / arm.effective_mass_kg),
        1.0 / slowest_s if slowest_s > 0.0 else math.inf,
    )


def _largest(
    plan: Plan, limits: RunLimits, omega: float, channels: tuple[ShakenChannel, ...]
) -> Shake:
    """The largest shake of this frequency that arm, room and limits of the run allow."""
    allowed_n = FORCE_SHARE * limits.force_limit_n / (1.0 + omega * limits.reaction_s)
    if limits.cross_check:
        allowed_n = min(allowed_n, CROSS_SHARE * limits.cross_tolerance_n)
    procedure = plan.procedure
    free_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
    acceleration = min(
        limits.acceleration_m_s2,
        omega * limits.retract_speed_m_s,
        0.5 * omega**2 * min(procedure.retract_m, free_m),
        allowed_n / max(channel.mass_kg for channel in channels),
    )
    follow = 1.0 / math.hypot(1.0, omega * plan.rig.arm.lag_s)
    return Shake(2.0 * acceleration / omega**2, omega, follow, CYCLES[0], math.nan, channels)


def _with_cycles(plan: Plan, shake: Shake) -> Shake:
    """The shake with as many cycles as are needed, within `LONGEST_S`."""
    from scipy.special import stdtrit

    arm, channels = plan.rig.arm, shake.channels
    blur_m = arm.position_resolution_m + arm.position_noise_m + arm.lost_motion_m
    noise_m = math.hypot(arm.position_noise_m, _QUANTUM_SIGMA * arm.position_resolution_m)
    moved_m = 0.5 * shake.follow * shake.travel_m
    blurred = 2.0 * moved_m < BLURS * blur_m
    sigmas = [  # of one cycle, as a share of the mass
        math.hypot(
            channel.noise_n / channel.mass_kg / shake.acceleration_m_s2
            * math.sqrt(2.0 / (shake.period_s * channel.rate_hz)),
            noise_m / moved_m * math.sqrt(2.0 / (shake.period_s * arm.rate_hz)),
        )
        for channel in channels
    ]  # fmt: skip
    for cycles in CYCLES:
        coverage = float(stdtrit(cycles - 1, LEVEL))
        half_widths = [
            math.inf if blurred else coverage * sigma / math.sqrt(cycles) for sigma in sigmas
        ]
        found = replace(shake, cycles=cycles, coverage=coverage, half_widths=tuple(half_widths))
        longer_s = found.duration_s + found.period_s
        if found.tells or longer_s > LONGEST_S:
            break
    return found
