"""How hard an arm hits when it catches up: commands that were held back arrive all at once.

A link that stalls and then delivers its backlog moves the target by a step J. The arm covers it at
what its servo and its acceleration allow, whatever speed was commanded, and meets the surface
somewhere on the way.
"""

from __future__ import annotations

import math

from stepload.contact.press import PressRig, series_stiffness

CATCH_UP_FACTOR = 1.5
"""On v sqrt(m k_t), which is exact for a linear contact without damping."""
_HALVINGS = 60


def catch_up_speed(rig: PressRig, travel_m: float) -> float:
    """Largest speed in m/s on a step of the target by `travel_m`: sqrt(a J), J/lag if less."""
    speed_m_s = math.sqrt(rig.acceleration_m_s2 * travel_m)
    return min(speed_m_s, travel_m / rig.lag_s) if rig.lag_s > 0.0 else speed_m_s


def catch_up_force(rig: PressRig, travel_m: float, tangent_n_per_m: float) -> float:
    """Upper bound in N of the force when a surface is met on such a step: K_eff J + impact."""
    stiffness = series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    share = tangent_n_per_m / (rig.stiffness_n_per_m + tangent_n_per_m)
    impact = CATCH_UP_FACTOR * math.sqrt(rig.mass_kg * tangent_n_per_m * share)
    return stiffness * travel_m + impact * catch_up_speed(rig, travel_m)


def largest_catch_up(rig: PressRig, force_n: float, tangent_n_per_m: float) -> float:
    """The step in m at which `catch_up_force` comes to `force_n`."""
    low_m, high_m = 0.0, force_n / series_stiffness(rig.stiffness_n_per_m, tangent_n_per_m)
    for _ in range(_HALVINGS):
        middle_m = 0.5 * (low_m + high_m)
        if catch_up_force(rig, middle_m, tangent_n_per_m) > force_n:
            high_m = middle_m
        else:
            low_m = middle_m
    return low_m
