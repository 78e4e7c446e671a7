"""A tip on an arm of compliance C presses on a plate that may be tilted; friction sticks or slides.

Quasi-static, three directions. The tip is where the arm is commanded to, less what it gives way,
x = s z − C f. At the plate it is pushed back along the normal by the payload's law, and across it
by Mindlin's tangential stiffness of 0.8 of the normal one, as far as Coulomb's friction holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MINDLIN = 0.8
_STEPS = 160
_ROUNDS = 60


@dataclass(frozen=True, slots=True)
class Contact:
    """F = k δ^n along the normal, friction `mu`, the plate's normal (3,) towards the arm's +z."""

    k: float
    n: float
    mu: float
    normal: FloatArray


@dataclass(frozen=True, slots=True)
class Branches:
    """Commanded travel (M,) and force on the sensor (M, 3) of one loading and one unloading."""

    up_m: FloatArray
    up_n: FloatArray
    down_m: FloatArray
    down_n: FloatArray


def rotation(about: float, angle_rad: float) -> FloatArray:
    """Rotation (3, 3) by an angle about an axis across z; `about` says which, in rad."""
    x, y = np.cos(about), np.sin(about)
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross
    )


def press(compliance: FloatArray, contact: Contact, top_n: float) -> Branches:
    """One loading to `top_n` along z, and the way back."""
    along, normal = np.array([0.0, 0.0, 1.0]), contact.normal
    flat = np.eye(3) - np.outer(normal, normal)
    deep_m = (top_n / contact.k) ** (1.0 / contact.n) + 1.4 * top_n * float(compliance[2, 2])
    force, tip, grip = np.zeros(3), np.zeros(3), np.zeros(3)
    travel, forces = [0.0], [force]
    step_m, sign, s = deep_m / _STEPS, 1.0, 0.0
    turned = 0
    while sign > 0.0 or s > 0.0:
        s = max(s + sign * step_m, 0.0)
        force, tip, grip = _solve(compliance, contact, along * s, flat, force, tip, grip)
        travel.append(s)
        forces.append(force)
        if sign > 0.0 and force[2] >= 1.02 * top_n:
            sign, turned = -1.0, len(travel)
        if sign < 0.0 and force[2] <= 0.0:
            break
    pushed = np.array(forces)
    return Branches(
        np.array(travel[:turned]), pushed[:turned], np.array(travel[turned - 1 :]),
        pushed[turned - 1 :],
    )  # fmt: skip


def _solve(
    compliance: FloatArray,
    contact: Contact,
    command: FloatArray,
    flat: FloatArray,
    force: FloatArray,
    tip: FloatArray,
    grip: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Force (3,), tip (3,) and friction (3,) at a commanded place, from those before; Newton."""
    normal, before = contact.normal, tip

    def pushed(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        depth = max(float(x @ normal), 0.0)
        normal_n = contact.k * depth**contact.n
        stiff = MINDLIN * contact.k * contact.n * max(depth, 1e-9) ** (contact.n - 1.0)
        held = grip + stiff * (flat @ (x - before))
        most = contact.mu * normal_n
        size = float(np.linalg.norm(held))
        held = held * (most / size) if size > most else held
        return normal * normal_n + held, held

    x, small = tip, 1e-10
    for _ in range(_ROUNDS):
        here, _ = pushed(x)
        left = x - command + compliance @ here
        if float(np.abs(left).max()) < 1e-11:
            break
        slope = np.stack([(pushed(x + small * e)[0] - here) / small for e in np.eye(3)], axis=1)
        x = x - np.linalg.solve(np.eye(3) + compliance @ slope, left)
    found, held = pushed(x)
    return found, x, held
