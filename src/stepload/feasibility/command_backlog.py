"""How hard an arm hits when it catches up: commands that were held back arrive all at once.

A link that stalls and then delivers its backlog moves the target by a step J. The arm covers it at
what its servo and its acceleration allow, whatever speed was commanded, and meets the surface
somewhere on the way.
"""

from __future__ import annotations

import math

from stepload.feasibility.press import IMPACT_FACTOR, PressRig, series_stiffness

STEP_OVERSHOOT = 2.0
"""Peak of a mass between springs over the static answer to the same push, for any single push."""
_HALVINGS = 60


def catch_up_speed(rig: PressRig, travel_m: float) -> float:
    """Largest speed in m/s on a step of the target by `travel_m`: sqrt(a J), J/lag if less."""
    speed_m_s = math.sqrt(rig.acceleration_m_s2 * travel_m)
    return min(speed_m_s, travel_m / rig.lag_s) if rig.lag_s > 0.0 else speed_m_s


def catch_up_force(rig: PressRig, travel_m: float, tangent_n_per_m: float) -> float:
    """Upper bound in N of the force when a surface is met on such a step.

    K_eff J + C_s v + 3 v sqrt(m k_t) sqrt(k_t/(K_s+k_t)), v = `catch_up_speed`: an arm with a lag
    starts with a jerk and rings at up to 2 v, and it may hit, bounce and hit again on its way.
    """
    stiffness = series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    share = tangent_n_per_m / (rig.stiffness_n_per_m + tangent_n_per_m)
    impact = IMPACT_FACTOR * math.sqrt(rig.mass_kg * tangent_n_per_m * share)
    speed_m_s = catch_up_speed(rig, travel_m)
    return stiffness * travel_m + (rig.damping_n_s_per_m + impact) * speed_m_s


def largest_catch_up(rig: PressRig, force_n: float, tangent_n_per_m: float) -> float:
    """The step in m at which `catch_up_force` reaches `force_n`."""
    low_m, high_m = 0.0, force_n / series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    for _ in range(_HALVINGS):
        middle_m = 0.5 * (low_m + high_m)
        if catch_up_force(rig, middle_m, tangent_n_per_m) > force_n:
            high_m = middle_m
        else:
            low_m = middle_m
    return low_m


def sudden_step(
    force_n: float,
    stiffness_n_per_m: float,
    damping_n_s_per_m: float,
    acceleration_m_s2: float,
    lag_s: float,
) -> float:
    """The step in m that adds `force_n` at the most to a contact that is closed already.

    Whatever the payload, 2 (K_s J + C_s v) bounds what is added, v = `catch_up_speed`: the push of
    the step on the mass never exceeds K_s J + C_s v.
    """
    if force_n <= 0.0:
        return 0.0
    push_n = force_n / STEP_OVERSHOOT
    jerk = damping_n_s_per_m * math.sqrt(acceleration_m_s2)
    root = 2.0 * push_n / (math.sqrt(jerk * jerk + 4.0 * stiffness_n_per_m * push_n) + jerk)
    step_m = root * root
    if lag_s > 0.0:
        step_m = max(step_m, push_n / (stiffness_n_per_m + damping_n_s_per_m / lag_s))
    return step_m
