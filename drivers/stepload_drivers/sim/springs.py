"""The equation of motion of a tip on its springs, and how a step solves it.

In the frame of the plate (axis 3 its normal), with mass matrix M, stiffness S = C⁻¹, damping β S
and the load f of the contact:

    M ẍ = S (d − x) + β S (ḋ − ẋ) − f
"""

from __future__ import annotations

import math

from stepload.rig.mount import Vector3
from stepload_drivers.sim.frames import solved
from stepload_drivers.sim.friction import Follow
from stepload_drivers.sim.tip_constraint import TipConstraint

Swing = tuple[Vector3, Vector3, Vector3]
"""How far the drive is ahead of the tip, speed of the tip, load of the contact."""


class Springs:
    """What holds the tip; without state."""

    def __init__(self, held: TipConstraint) -> None:
        self._mass, self._stiffness, self._damping_s = held.mass, held.stiffness, held.damping_s

    def unbalanced_n(self, tip: Swing) -> float:
        """Force that is left on the tip of a standing drive, without damping."""
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        (y1, y2, y3), _, (l1, l2, l3) = tip
        r1 = s11 * y1 + s12 * y2 + s13 * y3 - l1
        r2 = s12 * y1 + s22 * y2 + s23 * y3 - l2
        r3 = s13 * y1 + s23 * y2 + s33 * y3 - l3
        return math.sqrt(r1 * r1 + r2 * r2 + r3 * r3)

    def swinging(
        self, tip: Swing, moving: Vector3, nearer: float, follow: Follow
    ) -> tuple[float, float, float]:
        """How far the tip is from going quietly where springs and payload lead it.

        Unbalanced force, speed beside the quiet one, and what of the contact force swings with it.
        """
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        k11, k12, k22, k13, k23, kn = follow
        whole = (
            (s11 + k11, s12 + k12, s13 + k13),
            (s12 + k12, s22 + k22, s23 + k23),
            (s13, s23, s33 + kn),
        )
        (y1, y2, y3), (v1, v2, v3), (l1, l2, l3) = tip
        g1, g2, g3 = moving
        w1, w2, w3 = v1, v2, v3
        if g1 or g2 or g3 or nearer:
            f1 = s11 * g1 + s12 * g2 + s13 * g3 - k13 * nearer
            f2 = s12 * g1 + s22 * g2 + s23 * g3 - k23 * nearer
            f3 = s13 * g1 + s23 * g2 + s33 * g3 - kn * nearer
            q1, q2, q3 = solved(whole, (f1, f2, f3))
            w1, w2, w3 = v1 - q1, v2 - q2, v3 - q3
        beta = self._damping_s
        h1 = y1 + beta * (g1 - v1 + w1)
        h2 = y2 + beta * (g2 - v2 + w2)
        h3 = y3 + beta * (g3 - v3 + w3)
        r1 = s11 * h1 + s12 * h2 + s13 * h3 - l1
        r2 = s12 * h1 + s22 * h2 + s23 * h3 - l2
        r3 = s13 * h1 + s23 * h2 + s33 * h3 - l3
        u1, u2, u3 = solved(whole, (r1, r2, r3))
        b1, b2, b3 = k11 * u1 + k12 * u2 + k13 * u3, k12 * u1 + k22 * u2 + k23 * u3, kn * u3
        z1, z2, z3 = k11 * w1 + k12 * w2 + k13 * w3, k12 * w1 + k22 * w2 + k23 * w3, kn * w3
        slow2 = self._mass[2][2] / (s33 + kn)
        return (
            math.sqrt(r1 * r1 + r2 * r2 + r3 * r3),
            math.sqrt(w1 * w1 + w2 * w2 + w3 * w3),
            math.sqrt(b1 * b1 + b2 * b2 + b3 * b3 + (z1 * z1 + z2 * z2 + z3 * z3) * slow2),
        )

    def moved(
        self,
        tip: Swing,
        moving: Vector3,
        come: float,
        follow: Follow,
        dt: float,
        quiet: bool,
    ) -> tuple[Vector3, Vector3]:
        """Move over a sub-step and speed at its end; the plate has come nearer by `come`."""
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        (m11, m12, m13), (_, m22, m23), (_, _, m33) = self._mass
        k11, k12, k22, k13, k23, kn = follow
        (y1, y2, y3), (v1, v2, v3), (l1, l2, l3) = tip
        g1, g2, g3 = moving
        weight = 1.0 if quiet else 2.0  # backward Euler, or the trapezoidal rule
        per = weight / dt
        lead = dt + weight * self._damping_s
        inertia, spring, push = per * per, 1.0 + self._damping_s * per, weight * per
        h1, h2, h3 = (
            weight * y1 + g1 * lead,
            weight * y2 + g2 * lead,
            weight * y3 + g3 * lead,
        )
        f1 = push * (m11 * v1 + m12 * v2 + m13 * v3) + s11 * h1 + s12 * h2 + s13 * h3
        f2 = push * (m12 * v1 + m22 * v2 + m23 * v3) + s12 * h1 + s22 * h2 + s23 * h3
        f3 = push * (m13 * v1 + m23 * v2 + m33 * v3) + s13 * h1 + s23 * h2 + s33 * h3
        a12, a13, a23 = (
            inertia * m12 + spring * s12,
            inertia * m13 + spring * s13,
            inertia * m23 + spring * s23,
        )
        t1, t2, t3 = move = solved(
            (
                (inertia * m11 + spring * s11 + k11, a12 + k12, a13 + k13),
                (a12 + k12, inertia * m22 + spring * s22 + k22, a23 + k23),
                (a13, a23, inertia * m33 + spring * s33 + kn),
            ),
            (
                f1 - weight * l1 - k13 * come,
                f2 - weight * l2 - k23 * come,
                f3 - weight * l3 - kn * come,
            ),
        )
        if quiet:
            return move, (t1 * per, t2 * per, t3 * per)
        return move, (t1 * per - v1, t2 * per - v2, t3 * per - v3)
