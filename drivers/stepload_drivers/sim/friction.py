"""Lateral load on a pressed contact: how much is left of its limit, and friction.

Friction clings like a spring until it slides (Mindlin, Coulomb).

While it clings, friction grows by k_t du, k_t in proportion to the normal stiffness. Where the
normal stiffness falls, friction falls with it, as the stretched spring becomes softer: held at its
value instead, a cycle of loading would give energy away (D. Elata, J. G. Berryman, Mech. Mater. 24
(1996) 229). It slides beyond μ_s N and goes on sliding at μ_k N until it would be less.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from stepload.contact.lateral import left_of_limit


class Rubbing(NamedTuple):
    """Friction after a small move.

    `x`, `y` in N. `sliding`: whether it slid. `toward_x`, `toward_y`: unit vector of the friction
    that clinging would have given. `clinging`: friction over that, 1 while it clings, 0 where it
    slides freely. `slid_m`: way of sliding.
    """

    x: float
    y: float
    sliding: bool
    toward_x: float
    toward_y: float
    clinging: float
    slid_m: float


CLEAN = Rubbing(0.0, 0.0, False, 0.0, 0.0, 1.0, 0.0)
"""A contact that has just met, or has parted."""
Follow = tuple[float, float, float, float, float, float]
"""a, b, c, d, e, k of dq = [[a, b], [b, c]] du + (d, e) dδ and dN = k dδ."""
_new = tuple.__new__
_STEP = 0.01
"""Step of the lateral shares in the table kept here, fine enough for linear interpolation."""
_LAST_SHARE = 0.6


def rub(
    before: Rubbing,
    move_x: float,
    move_y: float,
    stiffness: tuple[float, float],
    largest_n: float,
) -> Rubbing:
    """Friction after the tip has moved by `move_x`, `move_y` in m over the plate.

    Args:
        before: friction before the move.
        stiffness: tangential, before the move and after it, N/m.
        largest_n: friction that the contact can have, of the friction that `before` says.
    """
    old, new = stiffness
    left = new / old if new < old else 1.0
    mean = 0.5 * (old + new)
    x = before[0] * left + mean * move_x
    y = before[1] * left + mean * move_y
    size = math.sqrt(x * x + y * y)
    if size <= largest_n:
        return _new(Rubbing, (x, y, False, 0.0, 0.0, 1.0, 0.0))
    share = largest_n / size
    slid_m = (size - largest_n) / mean if mean > 0.0 else 0.0
    return _new(Rubbing, (x * share, y * share, True, x / size, y / size, share, slid_m))


def following(rubbing: Rubbing, tangential: float, normal: float, kinetic: float) -> Follow:
    """How the contact follows a small move, at the stiffnesses that it has now.

    Args:
        tangential, normal: stiffness of the contact, N/m.
        kinetic: friction while it slides.
    """
    if not rubbing[2]:
        return tangential, 0.0, tangential, 0.0, 0.0, normal
    x, y = rubbing[3], rubbing[4]
    across, along = tangential * rubbing[5], kinetic * normal
    return (
        across * (1.0 - x * x),
        -across * x * y,
        across * (1.0 - y * y),
        along * x,
        along * y,
        normal,
    )


def lateral_derating(poisson_ratio: float) -> Callable[[float], float]:
    """g of the lateral share t, F_c(t)/F_c(0), for a body of this Poisson's ratio.

    Beyond the table yield begins at the surface, where the lateral stress alone decides: F_c
    decreases as 1/t³, and is never zero.
    """
    count = round(_LAST_SHARE / _STEP)
    table = [left_of_limit(poisson_ratio, min(i * _STEP, _LAST_SHARE)) for i in range(count + 1)]

    def left(lateral_share: float) -> float:
        if lateral_share >= _LAST_SHARE:
            return float(table[count] * (_LAST_SHARE / lateral_share) ** 3)
        place = lateral_share / _STEP
        i = int(place)
        return table[i] + (table[min(i + 1, count)] - table[i]) * (place - i)

    return left
