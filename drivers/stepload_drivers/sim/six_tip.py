"""The tip of a rig with six axes on its springs, pressed onto the plate with friction.

It moves as `springs` says, in the frame of the plate (axis 3 its normal), under the normal force of
the contact law and the friction of `friction`.

In free air a step is exact. In contact each sub-step solves the equation linearised at the present
state: by the trapezoidal rule while anything swings, by backward Euler where all is quiet. A
sub-step whose end does not confirm the linearisation is divided.
"""

from __future__ import annotations

import math

from stepload.rig.mount import Mount, Vector3
from stepload_drivers.sim.friction import (
    CLEAN,
    Follow,
    Rubbing,
    following,
    lateral_derating,
    rub,
)
from stepload_drivers.sim.laws import ContactLaw
from stepload_drivers.sim.springs import Springs, Swing, TipConstraint

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

End = tuple[float, float, Rubbing, float, float]


class SixTip:
    """State of the tip, frame of the plate; advanced by base steps of `step_s`.

    `normal_n` is the contact force along the plate's normal, `slid_m` the way that the contact has
    slid so far.

    Args:
        law: of the normal force.
        surface_m: coordinate along the normal at which the virgin payload touches.
        poisson_ratio: of the body that yields first.
        exponent: n of the normal law.
        swing_rad, error_factor: refine the sub-stepping (tests of convergence).
    """

    def __init__(
        self,
        held: TipConstraint,
        mount: Mount,
        law: ContactLaw,
        surface_m: float,
        poisson_ratio: float,
        exponent: float,
        *,
        step_s: float,
        swing_rad: float = SWING_RAD,
        error_factor: float = 1.0,
    ) -> None:
        self.at = self.speed = _ZERO
        self.rubbing = CLEAN
        self.normal_n = self._tangent = self._clings = 0.0
        self.peak_n = self.peak_equivalent_n = self.slid_m = 0.0
        self.surface_m = surface_m
        self.resting = self._calm = False
        self.sub_steps = 0
        self._law, self._evaluate = law, law.evaluate
        self._left = lateral_derating(poisson_ratio)
        self._static, self._kinetic = mount.friction_static, mount.friction_kinetic
        self._ratio, self._exponent = mount.tangential_ratio, exponent
        self._springs = Springs(held)
        self._stiffest, self._lightest, self._heaviest = (
            held.stiffest,
            held.lightest,
            held.heaviest,
        )
        a, b, c, d = held.apart
        self._free = [
            (*one, *two) for p, q in ((a, b), (c, d)) for one, two in zip(p, q, strict=True)
        ]
        self._step_s = self._sub_s = step_s
        self._swing, self._error_factor = swing_rad, error_factor
        omega2 = held.stiffest / held.lightest
        self._damping_rate = 0.5 * held.damping_s * omega2
        self._soft_rate = math.sqrt(omega2) + self._damping_rate
        self._quiet_soft = math.sqrt(held.stiffest * held.heaviest)

    @property
    def depth_m(self) -> float:
        """Approach along the normal; negative apart."""
        return self.at[2] - self.surface_m

    def slips_at(self, static: float, kinetic: float) -> None:
        """From now on payload and plate have this friction."""
        self._static, self._kinetic = static, kinetic
        clings = self._clings
        if clings > 0.0:
            self.rubbing = rub(self.rubbing, 0.0, 0.0, (clings, clings), kinetic * self.normal_n)
        self.resting = self._calm = False

    def yielded(self) -> None:
        """The law has changed by itself: the force is another one at the same place."""
        if self.normal_n != 0.0:
            self.normal_n, self._tangent = self._evaluate(self.depth_m)
            self._clings = self._clinging(self.normal_n, self.depth_m)
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
            return True
        if still and self.resting:
            return False
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
            u1, u2, u3, w1, w2, w3 = [
                p * u1 + q * u2 + r * u3 + s * w1 + t * w2 + u * w3
                for p, q, r, s, t, u in self._free
            ]
            if (
                -_STILL_M_S < w1 < _STILL_M_S
                and -_STILL_M < u1 < _STILL_M
                and max(abs(u2), abs(u3)) < _STILL_M
                and max(abs(w2), abs(w3)) < _STILL_M_S
            ):
                u1 = u2 = u3 = w1 = w2 = w3 = 0.0
            at = (d1 + g1 * h + u1, d2 + g2 * h + u2, d3 + g3 * h + u3)
            speed = (g1 + w1, g2 + w2, g3 + w3)
        if at[2] > contact or self._turns_inside(speed[2] + nearer_m_s, nearer_m_s, h):
            self._press(drive, moving, nearer_m_s)
        else:
            self.at, self.speed, self.surface_m = at, speed, surface

    def _press(self, drive: Vector3, moving: Vector3, nearer: float) -> None:
        """In contact, or coming into it, over one base step in as many sub-steps as needed."""
        standing = moving == _ZERO and nearer == 0.0
        left, dt = self._step_s, 2.0 * self._sub_s
        self.resting = False
        while left > 0.0:
            (x1, x2, x3), (d1, d2, d3) = self.at, drive
            tip = (d1 - x1, d2 - x2, d3 - x3), self.speed, (*self.rubbing[:2], self.normal_n)
            if standing and self._balanced(tip):
                self.speed = _ZERO
                self.resting = self.normal_n > 0.0
                break
            if self._calm and self._calmly(tip, moving, nearer, left):
                dt = left
            else:
                dt = self._divided(tip, moving, nearer, min(dt, left))
            x, y, z = drive
            drive = (x + moving[0] * dt, y + moving[1] * dt, z + moving[2] * dt)
            left -= dt
            self.sub_steps += 1
            if left < 1e-12:
                break
            dt *= 2.0
        self._sub_s = dt

    def _balanced(self, tip: Swing) -> bool:
        """Whether the tip of a standing drive may be left where it is."""
        v1, v2, v3 = self.speed
        most = math.sqrt(self._stiffest_now() * self._heaviest)
        swinging_n = most * math.sqrt(v1 * v1 + v2 * v2 + v3 * v3)
        return self._springs.unbalanced_n(tip) + swinging_n < AT_REST_N

    def _stiffest_now(self) -> float:
        """No less than the stiffness of springs and contact in any direction."""
        return self._stiffest + self._tangent * (1.0 + self._kinetic)

    def _calmly(self, tip: Swing, moving: Vector3, nearer: float, dt: float) -> bool:
        """One quiet sub-step if the inertia that it shows is as small as that of the last one.

        What swings would show by its inertia, smaller by (ω dt)² where dt is long.
        """
        follow = self._follow()
        move, speed = self._springs.moved(tip, moving, nearer * dt, follow, dt, True)
        before, mass = self.speed, self._heaviest
        a, b, c = speed[0] - before[0], speed[1] - before[1], speed[2] - before[2]
        phase2 = self._stiffest_now() / self._lightest * dt * dt
        shown = mass / dt * math.sqrt(a * a + b * b + c * c)
        if phase2 > 1.0:
            shown *= phase2
        if shown < QUIET_N + QUIET_SHARE * self.normal_n:
            end = self._end(move, nearer * dt)
            if end[0] > 0.0 and self._is_linear(move, nearer * dt, follow, end[0], end[2]):
                self._take(move, speed, nearer, dt, end, shown)
                return True
        self._calm = False
        return False

    def _divided(self, tip: Swing, moving: Vector3, nearer: float, dt: float) -> float:
        """One sub-step of at most `dt` that follows what swings; returns its length."""
        normal = self.normal_n
        follow = self._follow()
        unbalanced, fast, ringing = self._springs.swinging(tip, moving, nearer, follow)
        small = QUIET_N + QUIET_SHARE * abs(normal)
        quiet = ringing < small and unbalanced + self._quiet_soft * fast < small
        if not quiet:
            rate = self._soft_rate
            if ringing >= small:
                rate = math.sqrt(self._stiffest_now() / self._lightest) + self._damping_rate
            if rate * dt > self._swing:
                dt = self._swing / rate
        while True:
            move, speed = self._springs.moved(tip, moving, nearer * dt, follow, dt, quiet)
            end = self._end(move, nearer * dt)
            if dt <= _SHORTEST_S or (
                self._is_linear(move, nearer * dt, follow, end[0], end[2])
                and (
                    end[0] != 0.0
                    or normal != 0.0
                    or not self._turns_inside(speed[2] + nearer, nearer, dt)
                )
            ):
                break
            dt *= 0.5
        self._take(move, speed, nearer, dt, end, ringing if quiet else 0.0)
        self._calm = quiet and end[0] > 0.0
        return dt

    def _follow(self) -> Follow:
        return following(self.rubbing, self._clings, self._tangent, self._kinetic)

    def _clinging(self, force_n: float, depth_m: float) -> float:
        """Stiffness of a contact that clings: that of a curve without memory through this force.

        It follows the size of the contact. The slope of the normal force does not where that turns
        back: friction would fall with it at once, and the tip would swing.
        """
        if force_n <= 0.0:
            return 0.0
        return self._ratio * (self._exponent * force_n / (depth_m - self._law.residual_m))

    def _end(self, move: Vector3, come: float) -> End:
        """Normal force, its tangent, friction, depth and clinging stiffness after a move."""
        depth_m = self.at[2] + move[2] - self.surface_m + come
        force, tangent = self._evaluate(depth_m)
        if force <= 0.0:
            return force, tangent, CLEAN, depth_m, 0.0
        before = self.rubbing
        most = (self._kinetic if before[2] else self._static) * force
        clings = self._clinging(force, depth_m)
        rubbing = rub(before, move[0], move[1], (self._clings, clings), most)
        return force, tangent, rubbing, depth_m, clings

    def _take(
        self,
        move: Vector3,
        speed: Vector3,
        nearer: float,
        dt: float,
        end: End,
        ringing: float,
    ) -> None:
        """Go on to the end of a sub-step; `ringing` is the swinging force that it stepped over."""
        force, self._tangent, rubbing, depth_m, self._clings = end
        if force > 0.0:
            friction = math.sqrt(rubbing[0] * rubbing[0] + rubbing[1] * rubbing[1])
            self._note(self._most(speed[2] + nearer, nearer, dt, force) + ringing, friction)
        x, y, z = self.at
        self.at = (x + move[0], y + move[1], z + move[2])
        self.speed = speed
        self.surface_m -= nearer * dt
        self._law.remember(depth_m)
        if rubbing[2]:
            self.slid_m += rubbing[6]
            if not self.rubbing[2] and self._kinetic < self._static:  # it has come loose
                lower = self._kinetic / self._static
                rubbing = rubbing._replace(x=rubbing[0] * lower, y=rubbing[1] * lower)
        self.normal_n, self.rubbing = force, rubbing

    def _is_linear(
        self, move: Vector3, come: float, follow: Follow, force_n: float, rubbing: Rubbing
    ) -> bool:
        """Whether the contact has answered a move as it was linearised."""
        k11, k12, k22, k13, k23, kn = follow
        x, y, deeper = move[0], move[1], move[2] + come
        before = self.rubbing
        error1 = rubbing[0] - before[0] - k11 * x - k12 * y - k13 * deeper
        error2 = rubbing[1] - before[1] - k12 * x - k22 * y - k23 * deeper
        error3 = force_n - self.normal_n - kn * deeper
        allowed = self._error_factor * (ERROR_N + ERROR_SHARE * abs(force_n))
        return error1 * error1 + error2 * error2 + error3 * error3 <= allowed * allowed

    def _turns_inside(self, later: float, nearer: float, dt: float) -> bool:
        """Whether a tip that is apart before and after `dt` touches in between."""
        speed = self.speed[2] + nearer
        outside_m = self.at[2] - self.surface_m - self._law.residual_m
        return speed > 0.0 > later and outside_m + 0.5 * dt * speed**2 / (speed - later) > 0.0

    def _most(self, later: float, nearer: float, dt: float, force_n: float) -> float:
        """Largest normal force of a sub-step that ends with `force_n`."""
        speed = self.speed[2] + nearer
        if not speed > 0.0 > later:
            return force_n
        turn_m = self.at[2] - self.surface_m + 0.5 * dt * speed**2 / (speed - later)
        return max(force_n, self._evaluate(turn_m)[0])

    def _note(self, normal_n: float, friction_n: float) -> None:
        """Keep the largest resultant, and the largest that counts against the elastic limit."""
        resultant = math.sqrt(normal_n * normal_n + friction_n * friction_n)
        if resultant > self.peak_n:
            self.peak_n = resultant
        if normal_n > 0.0:
            equivalent_n = resultant / self._left(friction_n / normal_n)
            if equivalent_n > self.peak_equivalent_n:
                self.peak_equivalent_n = equivalent_n
