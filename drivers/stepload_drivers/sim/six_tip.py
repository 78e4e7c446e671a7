"""The tip of a rig with six axes on its springs, pressed onto the plate with friction.

In the frame of the plate (axis 3 its normal), with mass matrix M, stiffness S = C⁻¹, damping β S,
the normal force N(δ) of the contact law and the friction q of `friction`:

    M ẍ = S (d − x) + β S (ḋ − ẋ) − (q₁, q₂, N)

In free air a step is exact. In contact each sub-step solves the equation linearised at the present
state: by the trapezoidal rule while anything swings, by backward Euler where all is quiet. A
sub-step whose end does not confirm the linearisation is divided.
"""

from __future__ import annotations

import math

from stepload.rig.mount import Mount, Vector3
from stepload_drivers.sim.friction import CLEAN, rub
from stepload_drivers.sim.held import Held
from stepload_drivers.sim.laws import ContactLaw
from stepload_drivers.sim.limit_left import limit_left

SWING_RAD = 0.3
"""Largest phase of the fastest oscillation in one sub-step while it rings."""
QUIET_N, QUIET_SHARE = 0.01, 2e-4
"""Oscillation below this force (absolute + share of the force) is stepped over."""
ERROR_N, ERROR_SHARE = 0.01, 5e-4
"""Largest departure of the force from its linearisation in one sub-step."""
AT_REST_N = 1e-4
"""Unbalanced force below which a contact on standing drives is left alone."""
_SHORTEST_S = 1e-8
_STILL_M, _STILL_M_S = 1e-18, 1e-15
_ZERO: Vector3 = (0.0, 0.0, 0.0)


class SixTip:
    """State of the tip, frame of the plate; advanced by base steps of `step_s`.

    Args:
        law: of the normal force.
        surface_m: coordinate along the normal at which the virgin payload touches.
        swing_rad, error_factor: refine the sub-stepping (tests of convergence).
    """

    __slots__ = (
        "_damping_s",
        "_error_factor",
        "_evaluate",
        "_free",
        "_heaviest",
        "_kinetic",
        "_law",
        "_lightest",
        "_mass",
        "_quiet_soft",
        "_ratio",
        "_soft_rate",
        "_static",
        "_step_s",
        "_stiffest",
        "_stiffness",
        "_sub_s",
        "_swing",
        "_tangent",
        "at",
        "normal_n",
        "peak_equivalent_n",
        "peak_n",
        "resting",
        "rubbing",
        "slid_m",
        "speed",
        "sub_steps",
        "surface_m",
    )

    def __init__(
        self,
        held: Held,
        mount: Mount,
        law: ContactLaw,
        surface_m: float,
        *,
        step_s: float,
        swing_rad: float = SWING_RAD,
        error_factor: float = 1.0,
    ) -> None:
        self.at = self.speed = _ZERO
        self.rubbing = CLEAN
        self.normal_n = self._tangent = 0.0
        self.peak_n = self.peak_equivalent_n = self.slid_m = 0.0
        self.surface_m = surface_m
        self.resting = False
        self.sub_steps = 0
        self._law, self._evaluate = law, law.evaluate
        self._static, self._kinetic = mount.friction_static, mount.friction_kinetic
        self._ratio = mount.tangential_ratio
        self._mass, self._stiffness, self._damping_s = held.mass, held.stiffness, held.damping_s
        self._stiffest, self._lightest, self._heaviest = (
            held.stiffest,
            held.lightest,
            held.heaviest,
        )
        self._free = held.apart
        self._step_s = self._sub_s = step_s
        self._swing, self._error_factor = swing_rad, error_factor
        omega2 = held.stiffest / held.lightest
        self._soft_rate = math.sqrt(omega2) + 0.5 * held.damping_s * omega2
        self._quiet_soft = math.sqrt(held.stiffest * held.heaviest)

    @property
    def depth_m(self) -> float:
        """Approach along the normal; negative apart."""
        return self.at[2] - self.surface_m

    @property
    def touching_m(self) -> float:
        """Depth at which the payload touches as it is now."""
        return self._law.residual_m

    def put(self, at: Vector3) -> None:
        """Stand at `at`, pressing without friction."""
        self.at = at
        self.normal_n, self._tangent = self._evaluate(self.depth_m)
        self._law.remember(self.depth_m)
        self._note(self.normal_n, 0.0)

    def yielded(self) -> None:
        """The law has changed by itself: the force is another one at the same place."""
        if self.normal_n != 0.0:
            self.normal_n, self._tangent = self._evaluate(self.depth_m)
            self._note(self.normal_n, math.hypot(self.rubbing.x, self.rubbing.y))
            self.resting = False

    def step(self, drive: Vector3, moving: Vector3, nearer_m_s: float) -> bool:
        """One base step from `drive` on, at the speed `moving`; returns whether anything moves.

        The plate comes nearer by `nearer_m_s`.
        """
        still = moving == _ZERO and nearer_m_s == 0.0
        if self.normal_n == 0.0:
            if still and self.at == drive and self.speed == _ZERO:
                return False
            self._fly(drive, moving, nearer_m_s)
        elif still and self.resting:
            return False
        else:
            self._press(drive, moving, nearer_m_s)
        return True

    def _fly(self, drive: Vector3, moving: Vector3, nearer_m_s: float) -> None:
        """Apart at the beginning: exactly to the end of the step, unless the tip touches."""
        h = self._step_s
        d1, d2, d3 = drive
        g1, g2, g3 = moving
        x1, x2, x3 = self.at
        v1, v2, v3 = self.speed
        surface = self.surface_m - nearer_m_s * h
        contact = surface + self._law.residual_m
        if self.at == drive and self.speed == moving:
            at, speed = (d1 + g1 * h, d2 + g2 * h, d3 + g3 * h), moving
        else:
            u1, u2, u3, w1, w2, w3 = x1 - d1, x2 - d2, x3 - d3, v1 - g1, v2 - g2, v3 - g3
            (a, b, c, d) = self._free
            moved = []
            for one, other in ((a, b), (c, d)):
                for (p, q, r), (s, t, u) in zip(one, other, strict=True):
                    moved.append(p * u1 + q * u2 + r * u3 + s * w1 + t * w2 + u * w3)
            u1, u2, u3, w1, w2, w3 = moved
            if max(map(abs, moved[:3])) < _STILL_M and max(map(abs, moved[3:])) < _STILL_M_S:
                u1 = u2 = u3 = w1 = w2 = w3 = 0.0
            at = (d1 + g1 * h + u1, d2 + g2 * h + u2, d3 + g3 * h + u3)
            speed = (g1 + w1, g2 + w2, g3 + w3)
        if at[2] > contact or _turns_inside(
            x3 - contact, v3 + nearer_m_s, speed[2] + nearer_m_s, h
        ):
            self._press(drive, moving, nearer_m_s)
        else:
            self.at, self.speed, self.surface_m = at, speed, surface

    def _press(self, drive: Vector3, moving: Vector3, nearer: float) -> None:
        """In contact, or coming into it, over one base step in as many sub-steps as needed."""
        evaluate, remember = self._evaluate, self._law.remember
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        (m11, m12, m13), (_, m22, m23), (_, _, m33) = self._mass
        beta, ratio, swing = self._damping_s, self._ratio, self._swing
        static, kinetic = self._static, self._kinetic
        g1, g2, g3 = moving
        d1, d2, d3 = drive
        x1, x2, x3 = self.at
        v1, v2, v3 = self.speed
        normal, kn, rubbing = self.normal_n, self._tangent, self.rubbing
        surface = self.surface_m
        standing = moving == _ZERO and nearer == 0.0
        left, dt = self._step_s, 2.0 * self._sub_s
        self.resting = False
        while left > 0.0:
            q1, q2, sliding, e1, e2, clinging, _ = rubbing
            kt = ratio * kn
            # how friction and normal force follow a small move of the tip
            if sliding:
                k11, k12, k22 = (
                    kt * clinging * (1.0 - e1 * e1),
                    -kt * clinging * e1 * e2,
                    kt * clinging * (1.0 - e2 * e2),
                )
                k13, k23 = kinetic * kn * e1, kinetic * kn * e2
            else:
                k11 = k22 = kt
                k12 = k13 = k23 = 0.0
            a11, a12, a13 = s11 + k11, s12 + k12, s13 + k13
            a21, a22, a23 = a12, s22 + k22, s23 + k23
            a31, a32, a33 = s13, s23, s33 + kn
            # inverse of the whole stiffness: where and how fast the tip would be without swinging
            c11, c12, c13 = a22 * a33 - a23 * a32, a13 * a32 - a12 * a33, a12 * a23 - a13 * a22
            c21, c22, c23 = a23 * a31 - a21 * a33, a11 * a33 - a13 * a31, a13 * a21 - a11 * a23
            c31, c32, c33 = a21 * a32 - a22 * a31, a12 * a31 - a11 * a32, a11 * a22 - a12 * a21
            scale = 1.0 / (a11 * c11 + a12 * c21 + a13 * c31)
            if standing:
                w1, w2, w3 = v1, v2, v3
            else:
                f1 = s11 * g1 + s12 * g2 + s13 * g3 - k13 * nearer
                f2 = s12 * g1 + s22 * g2 + s23 * g3 - k23 * nearer
                f3 = s13 * g1 + s23 * g2 + s33 * g3 - kn * nearer
                w1 = v1 - scale * (c11 * f1 + c12 * f2 + c13 * f3)
                w2 = v2 - scale * (c21 * f1 + c22 * f2 + c23 * f3)
                w3 = v3 - scale * (c31 * f1 + c32 * f2 + c33 * f3)
            y1, y2, y3 = d1 - x1, d2 - x2, d3 - x3
            h1, h2, h3 = (
                y1 + beta * (g1 - v1 + w1),
                y2 + beta * (g2 - v2 + w2),
                y3 + beta * (g3 - v3 + w3),
            )
            r1 = s11 * h1 + s12 * h2 + s13 * h3 - q1
            r2 = s12 * h1 + s22 * h2 + s23 * h3 - q2
            r3 = s13 * h1 + s23 * h2 + s33 * h3 - normal
            u1 = scale * (c11 * r1 + c12 * r2 + c13 * r3)
            u2 = scale * (c21 * r1 + c22 * r2 + c23 * r3)
            u3 = scale * (c31 * r1 + c32 * r2 + c33 * r3)
            unbalanced = math.sqrt(r1 * r1 + r2 * r2 + r3 * r3)
            fast = math.sqrt(w1 * w1 + w2 * w2 + w3 * w3)
            stiffest = self._stiffest + kn * (1.0 + kinetic)
            if (
                standing
                and unbalanced < AT_REST_N
                and math.sqrt(stiffest * self._heaviest) * fast < AT_REST_N
            ):
                v1 = v2 = v3 = 0.0
                self.resting = normal > 0.0
                break
            b1, b2, b3 = k11 * u1 + k12 * u2 + k13 * u3, k12 * u1 + k22 * u2 + k23 * u3, kn * u3
            z1, z2, z3 = k11 * w1 + k12 * w2 + k13 * w3, k12 * w1 + k22 * w2 + k23 * w3, kn * w3
            ringing = math.sqrt(
                b1 * b1 + b2 * b2 + b3 * b3 + (z1 * z1 + z2 * z2 + z3 * z3) * m33 / (s33 + kn)
            )
            size = normal if normal > 0.0 else -normal
            small = QUIET_N + QUIET_SHARE * size
            quiet = ringing < small and unbalanced + self._quiet_soft * fast < small
            if dt > left:
                dt = left
            if not quiet:
                rate = self._soft_rate
                if ringing >= small:
                    omega2 = stiffest / self._lightest
                    rate = math.sqrt(omega2) + 0.5 * beta * self._stiffest / self._lightest
                if rate * dt > swing:
                    dt = swing / rate
            while True:
                if quiet:
                    per = 1.0 / dt
                    inertia, spring, twice = per * per, 1.0 + beta * per, 1.0
                    i1, i2, i3 = v1 * per, v2 * per, v3 * per
                    h1, h2, h3 = y1 + g1 * (dt + beta), y2 + g2 * (dt + beta), y3 + g3 * (dt + beta)
                else:
                    per = 2.0 / dt
                    inertia, spring, twice = per * per, 1.0 + beta * per, 2.0
                    i1, i2, i3 = 2.0 * v1 * per, 2.0 * v2 * per, 2.0 * v3 * per
                    both = dt + 2.0 * beta
                    h1, h2, h3 = 2.0 * y1 + g1 * both, 2.0 * y2 + g2 * both, 2.0 * y3 + g3 * both
                come = nearer * dt
                f1 = (
                    m11 * i1
                    + m12 * i2
                    + m13 * i3
                    + s11 * h1
                    + s12 * h2
                    + s13 * h3
                    - twice * q1
                    - k13 * come
                )
                f2 = (
                    m12 * i1
                    + m22 * i2
                    + m23 * i3
                    + s12 * h1
                    + s22 * h2
                    + s23 * h3
                    - twice * q2
                    - k23 * come
                )
                f3 = (
                    m13 * i1
                    + m23 * i2
                    + m33 * i3
                    + s13 * h1
                    + s23 * h2
                    + s33 * h3
                    - twice * normal
                    - kn * come
                )
                base12 = inertia * m12 + spring * s12 + k12
                a11, a12 = inertia * m11 + spring * s11 + k11, base12
                a31 = inertia * m13 + spring * s13
                a13 = a31 + k13
                a22, a32 = inertia * m22 + spring * s22 + k22, inertia * m23 + spring * s23
                a23 = a32 + k23
                a33 = inertia * m33 + spring * s33 + kn
                c11, c12, c13 = a22 * a33 - a23 * a32, a13 * a32 - a12 * a33, a12 * a23 - a13 * a22
                c21, c22, c23 = a23 * a31 - a12 * a33, a11 * a33 - a13 * a31, a13 * a12 - a11 * a23
                c31, c32, c33 = a12 * a32 - a22 * a31, a12 * a31 - a11 * a32, a11 * a22 - a12 * a12
                scale = 1.0 / (a11 * c11 + a12 * c21 + a13 * c31)
                t1 = scale * (c11 * f1 + c12 * f2 + c13 * f3)
                t2 = scale * (c21 * f1 + c22 * f2 + c23 * f3)
                t3 = scale * (c31 * f1 + c32 * f2 + c33 * f3)
                if quiet:
                    n1, n2, n3 = t1 * per, t2 * per, t3 * per
                else:
                    n1, n2, n3 = t1 * per - v1, t2 * per - v2, t3 * per - v3
                depth = x3 + t3 - surface + come
                normal1, kn1 = evaluate(depth)
                if normal1 > 0.0:
                    cap = (kinetic if sliding else static) * normal1
                    rubbing1 = rub(rubbing, t1, t2, (kt, ratio * kn1), cap)
                    size = normal1
                else:
                    rubbing1 = CLEAN
                    size = -normal1
                deeper = t3 + come
                error1 = rubbing1[0] - q1 - k11 * t1 - k12 * t2 - k13 * deeper
                error2 = rubbing1[1] - q2 - k12 * t1 - k22 * t2 - k23 * deeper
                error3 = normal1 - normal - kn * deeper
                allowed = self._error_factor * (ERROR_N + ERROR_SHARE * size)
                if dt <= _SHORTEST_S:
                    break
                if error1 * error1 + error2 * error2 + error3 * error3 <= allowed * allowed and (
                    normal1 != 0.0
                    or normal != 0.0
                    or not _turns_inside(
                        x3 - surface - self._law.residual_m, v3 + nearer, n3 + nearer, dt
                    )
                ):
                    break
                dt *= 0.5
            friction = math.sqrt(rubbing1[0] * rubbing1[0] + rubbing1[1] * rubbing1[1])
            if normal1 > 0.0:
                most = normal1
                if v3 + nearer > 0.0 > n3 + nearer:
                    before = x3 - surface
                    speed, slower = v3 + nearer, n3 + nearer
                    most = max(
                        most, evaluate(before + 0.5 * dt * speed * speed / (speed - slower))[0]
                    )
                self._note(most + ringing if quiet and ringing > 0.0 else most, friction)
            remember(depth)
            surface -= come
            x1, x2, x3 = x1 + t1, x2 + t2, x3 + t3
            v1, v2, v3 = n1, n2, n3
            normal, kn = normal1, kn1
            if rubbing1[2]:
                self.slid_m += rubbing1[6]
                if not sliding and kinetic < static:  # it has come loose
                    lower = kinetic / static
                    rubbing1 = rubbing1._replace(x=rubbing1[0] * lower, y=rubbing1[1] * lower)
            rubbing = rubbing1
            d1, d2, d3 = d1 + g1 * dt, d2 + g2 * dt, d3 + g3 * dt
            left -= dt
            self.sub_steps += 1
            if left < 1e-12:
                break
            dt *= 2.0
        self._sub_s = dt
        self.at, self.speed, self.surface_m = (x1, x2, x3), (v1, v2, v3), surface
        self.normal_n, self._tangent, self.rubbing = normal, kn, rubbing

    def _note(self, normal_n: float, friction_n: float) -> None:
        """Keep the largest resultant, and the largest that counts against the elastic limit."""
        resultant = math.sqrt(normal_n * normal_n + friction_n * friction_n)
        if resultant > self.peak_n:
            self.peak_n = resultant
        if normal_n > 0.0:
            equivalent_n = resultant / limit_left(friction_n / normal_n)
            if equivalent_n > self.peak_equivalent_n:
                self.peak_equivalent_n = equivalent_n


def _turns_inside(outside_m: float, speed: float, later: float, dt: float) -> bool:
    """Whether a tip that is apart before and after `dt` touches in between."""
    return speed > 0.0 > later and outside_m + 0.5 * dt * speed * speed / (speed - later) > 0.0
