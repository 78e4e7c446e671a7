"""Friction of a pressed contact: it clings like a spring until it slides (Mindlin, Coulomb).

While it clings, friction grows by k_t du, k_t in proportion to the normal stiffness. Where the
normal stiffness falls, friction falls with it, as the stretched spring becomes softer: held at its
value instead, a cycle of loading would give energy away (D. Elata, J. G. Berryman, Mech. Mater. 24
(1996) 229). It slides beyond μ_s N and goes on sliding at μ_k N until it would be less.
"""

from __future__ import annotations

import math
from typing import NamedTuple


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
