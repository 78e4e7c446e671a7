"""Drive, tip and contact: one axis that presses, integrated exactly where it is quiet.

The drive follows its target with delay, first-order lag, limited speed and acceleration, lost
motion and limited push. The tip (mass m) hangs on the drive by K_s and C_s and meets the payload:

    m ẍ = K_s (x_d − x) + C_s (ẋ_d − ẋ) − F(x − surface)

Each step solves the equation linearised at the present state in closed form; a step whose end does
not confirm the linearisation, or that would swing past a force peak, is divided.
"""

from __future__ import annotations

import math

from stepload.rig.world import WorldSpec
from stepload_drivers.sim.contact import contact_of, path_give
from stepload_drivers.sim.drive import Drive
from stepload_drivers.sim.faults import Schedule

SWING_RAD = 0.4
"""Largest phase of the contact oscillation in one sub-step while it rings."""
RINGING_N, RINGING_SHARE = 0.01, 2e-4
"""Oscillation below this force (absolute + share of the force) is stepped over."""
ERROR_N, ERROR_SHARE = 0.01, 5e-4
"""Largest departure of the force from its linearisation in one sub-step."""
AT_REST_N = 1e-4
"""Unbalanced force below which a contact on a standing drive is left alone."""
PLATE_MOVES_S = 0.02
"""Time in which a plate moves by the magnitude of its fault."""
FINEST_M = 2e-8
"""A plate that moves in contact does so in steps of this size, between which the tip yields."""
_SHORTEST_S = 1e-8


class BasePlant:
    """What mechanics of one axis and of six have in common; advanced by fixed steps of `step_s`.

    `force_n` is the contact force along the press, `last_force_n` that of a base step ago, `peak_n`
    the largest contact force so far, also between samples. `peak_equivalent_n` is the largest
    |f|/g(t); with one axis no lateral load lowers the payload's limit.
    """

    def __init__(self, spec: WorldSpec, *, step_s: float) -> None:
        self.step_s = step_s
        self.time_s = 0.0
        self._steps = 0
        self.force_n = self.last_force_n = self.peak_n = 0.0
        self.braked = self._idle = False
        """`_idle`: the last step changed nothing, nor will the next without a command."""
        self._axis = Drive(spec, step_s)
        self._law, self._creep = contact_of(spec)
        self._give = path_give(spec)
        self._drift_m_s = spec.drift_m_s
        self._plate_faults = Schedule(spec.faults, kinds=("plate_moves",))
        self._moves = spec.drift_m_s != 0.0 or self._plate_faults.next_s < math.inf
        self._moved_m = self._largest_m = 0.0

    @property
    def target_m(self) -> float:
        return self._axis.target_m

    @property
    def drive_m(self) -> float:
        return self._axis.position_m

    @property
    def drive_speed(self) -> float:
        return self._axis.speed_m_s

    @property
    def measured_m(self) -> float:
        """Travel where the arm measures it: before what slips, and before what gives way."""
        return self._axis.measured_m

    def command(self, apply_s: float, target_m: float) -> None:
        """Let the drive follow `target_m` from `apply_s` on; commands take effect in order."""
        self._axis.command(apply_s, target_m)

    def _plate_change_m(self) -> float:
        """How far a fault moves the plate towards the arm in this base step."""
        time_s, faults = self.time_s, self._plate_faults
        if time_s < faults.next_s and self._moved_m == 0.0:
            return 0.0
        goal_m = faults.active(time_s).get("plate_moves", 0.0)
        self._largest_m = max(abs(goal_m), self._largest_m)
        most_m = self._largest_m * self.step_s / PLATE_MOVES_S
        change_m = max(-most_m, min(most_m, goal_m - self._moved_m))
        last = change_m == goal_m - self._moved_m
        self._moved_m = goal_m if last else self._moved_m + change_m
        return change_m


class Plant(BasePlant):
    """The mechanics of a rig that presses along one axis.

    `surface_m` is the travel at which the virgin payload touches.

    Args:
        spec: the truth.
        step_s: base step; drive speed is constant within it.
        swing_rad, error_factor: refine the sub-stepping (tests of convergence).
    """

    def __init__(
        self,
        spec: WorldSpec,
        *,
        step_s: float,
        swing_rad: float = SWING_RAD,
        error_factor: float = 1.0,
    ) -> None:
        super().__init__(spec, step_s=step_s)
        self.tip_m = self.tip_speed = self._tangent = 0.0
        self._resting = False
        self.sub_steps = 0
        self.spec = spec
        self._evaluate = self._law.evaluate
        self._slow = self._creep is not None or self._moves
        self._moving_m = 0.0
        self.surface_m = spec.surface_m
        self._contact_m = spec.surface_m + self._law.residual_m
        self._mass = spec.effective_mass_kg
        self._stiffness = spec.system_stiffness_n_per_m
        self._damping = spec.system_damping_n_s_per_m
        self._gamma = 0.5 * self._damping / self._mass
        self._swing = swing_rad
        self._error_factor = error_factor
        self._sub_s = step_s
        self._free = self._propagator(0.0, step_s)
        if self.tip_m > self._contact_m:
            self._begin_in_contact()

    def _begin_in_contact(self) -> None:
        """The start pose presses: the tip is where spring and payload hold each other."""
        low, high = self._contact_m, self.drive_m
        for _ in range(60):
            self.tip_m = 0.5 * (low + high)
            self.force_n, self._tangent = self._evaluate(self.tip_m - self.surface_m)
            if self.force_n > self._stiffness * (self.drive_m - self.tip_m):
                high = self.tip_m
            else:
                low = self.tip_m
        self._law.remember(self.tip_m - self.surface_m)
        self.last_force_n = self.peak_n = self.force_n

    @property
    def peak_equivalent_n(self) -> float:
        return self.peak_n

    @property
    def closed_m(self) -> float:
        """Approach of payload and plate, negative apart; without the give of the load path."""
        closed_m = self.tip_m - self.surface_m
        if self._give is not None and self.force_n > 0.0:
            closed_m -= self._give(self.force_n)[0]
        return closed_m

    def _propagator(self, tangent: float, dt: float) -> tuple[float, float, float, float]:
        """exp of the linearised system over `dt`: (u, u̇) → (p11 u + p12 u̇, p21 u + p22 u̇)."""
        gamma = self._gamma
        omega2 = (self._stiffness + tangent) / self._mass
        square = omega2 - gamma * gamma
        if square > 0.0:
            root = math.sqrt(square)
            decay = math.exp(-gamma * dt)
            c = decay * math.cos(root * dt)
            s = decay * math.sin(root * dt) / root
        elif square < 0.0:
            root = math.sqrt(-square)
            fast = math.exp(-(gamma + root) * dt)
            slow = math.exp(-omega2 / (gamma + root) * dt)
            c = 0.5 * (slow + fast)
            s = 0.5 * (slow - fast) / root
        else:
            c = math.exp(-gamma * dt)
            s = c * dt
        return c + gamma * s, s, -omega2 * s, c - gamma * s

    def step(self) -> None:
        """Go on by `step_s`: first what moves by itself, then drive and tip."""
        h = self.step_s
        if self._slow:
            self._go_slowly()
        force = self.last_force_n = self.force_n
        axis = self._axis
        due = bool(axis.commands) and axis.take_commands(self.time_s)
        if due or not self._idle:
            drive, actual = axis.position_m, 0.0
            if self.braked and not axis.there:
                axis.hold()
            else:
                actual = axis.advance(self._stiffness * (drive - self.tip_m))
            if force == 0.0:
                still = self._fly(drive, actual)
            else:
                if actual or not self._resting:
                    self._press(drive, actual, h)
                still = self._resting
            self._idle = still and not self._slow and axis.stands
        self._steps = steps = self._steps + 1
        self.time_s = steps * h
        if self._slow:
            self.surface_m -= self._moving_m  # the tip is apart: nothing was pressed on the way

    def advance_drive(self) -> float:
        """Let the drive follow its commands for a base step; where it is then."""
        axis = self._axis
        axis.take_commands(self.time_s)
        if self.braked and not axis.there:
            axis.hold()
        else:
            axis.advance(self.force_n)
        return axis.position_m

    def finish(self, tip_m: float, force_n: float) -> None:
        """End a base step of other mechanics than these, in their `step`: where the tip is then."""
        self.tip_speed, self.tip_m = (tip_m - self.tip_m) / self.step_s, tip_m
        self.last_force_n, self.force_n = self.force_n, force_n
        self.peak_n = max(self.peak_n, force_n)
        self._steps += 1
        self.time_s = self._steps * self.step_s

    def _go_slowly(self) -> None:
        """Let the payload creep and the load path drift over a base step."""
        self.surface_m -= self._drift_m_s * self.step_s
        self._moving_m = self._plate_change_m()
        if self._creep is not None:
            self._creep.flow(self.step_s)
        if self.force_n != 0.0:
            self.force_n, self._tangent = self._evaluate(self.tip_m - self.surface_m)
            if self.force_n > self.peak_n:
                self.peak_n = self.force_n
            self._resting = False
        self._contact_m = self.surface_m - self._moving_m + self._law.residual_m

    def _fly(self, drive: float, actual: float) -> bool:
        """Apart at the beginning: exactly to the end of a base step; whether the tip stands."""
        moved = tip = self._axis.position_m
        u = self.tip_m - drive
        was = self.tip_speed
        w = was - actual
        if u != 0.0 or w != 0.0:
            p11, p12, p21, p22 = self._free
            tip = moved + p11 * u + p12 * w
            w = p21 * u + p22 * w
            if -1e-15 < w < 1e-15 and -1e-18 < tip - moved < 1e-18:
                tip, w = moved, 0.0
        speed = actual + w
        h = self.step_s
        if tip > self._contact_m or (
            was > 0.0 > speed and self._turns_inside(self.tip_m, was, speed, h)
        ):
            self._press(drive, actual, h)
            return False
        self.tip_m = tip
        self.tip_speed = speed
        return tip == moved == drive and speed == 0.0

    def _turns_inside(self, x: float, v: float, v1: float, dt: float) -> bool:
        """Whether a tip that is apart before and after `dt` touches in between."""
        return v > 0.0 > v1 and x + 0.5 * dt * v * v / (v - v1) > self._contact_m

    def _press(self, drive: float, speed: float, h: float) -> None:
        """Press on a plate that may move at the same time."""
        if self._moving_m == 0.0:
            self._press_still(drive, speed, h)
            return
        pieces = math.ceil(abs(self._moving_m) / FINEST_M)
        piece_m, self._moving_m = self._moving_m / pieces, 0.0
        for _ in range(pieces):
            self.surface_m -= piece_m
            self.force_n, self._tangent = self._evaluate(self.tip_m - self.surface_m)
            self.peak_n = max(self.peak_n, self.force_n)
            self._press_still(drive, speed, h / pieces)
            drive += speed * h / pieces

    def _press_still(self, drive: float, speed: float, h: float) -> None:
        """Tip in contact, or coming into it, over one base step in as many sub-steps as needed."""
        evaluate, remember, propagator = self._evaluate, self._law.remember, self._propagator
        stiffness, damping, mass, gamma = self._stiffness, self._damping, self._mass, self._gamma
        surface, peak, swing, factor = self.surface_m, self.peak_n, self._swing, self._error_factor
        x, v, force, tangent = self.tip_m, self.tip_speed, self.force_n, self._tangent
        left = h
        dt = 2.0 * self._sub_s
        self._resting = False
        while left > 0.0:
            total = stiffness + tangent
            drift = stiffness * speed / total
            rest = (stiffness * drive + damping * (speed - drift) - force + tangent * x) / total
            u = x - rest
            w = v - drift
            omega2 = total / mass
            amplitude = math.sqrt(u * u + w * w / omega2)
            if speed == 0.0 and total * amplitude < AT_REST_N:
                v = 0.0
                self._resting = force > 0.0
                break
            ringing = tangent * amplitude
            if dt > left:
                dt = left
            size = force if force > 0.0 else -force
            small = ringing < RINGING_N + RINGING_SHARE * size
            if not small:
                square = omega2 - gamma * gamma
                if square > 0.0 and square * dt * dt > swing * swing:
                    dt = swing / math.sqrt(square)
            while True:
                p11, p12, p21, p22 = propagator(tangent, dt)
                x1 = rest + drift * dt + p11 * u + p12 * w
                v1 = drift + p21 * u + p22 * w
                force1, tangent1 = evaluate(x1 - surface)
                error = force1 - force - tangent * (x1 - x)
                size = force1 if force1 > 0.0 else -force1
                allowed = factor * (ERROR_N + ERROR_SHARE * size)
                if dt <= _SHORTEST_S:
                    break
                if -allowed <= error <= allowed and (
                    force1 != 0.0 or force != 0.0 or not self._turns_inside(x, v, v1, dt)
                ):
                    break
                dt *= 0.5
            if force1 > peak:
                peak = force1
            if v > 0.0 > v1 and force1 > 0.0:
                turn = evaluate(x + 0.5 * dt * v * v / (v - v1) - surface)[0]
                if turn > peak:
                    peak = turn
            if small and force1 + ringing > peak:
                peak = force1 + ringing
            remember(x1 - surface)
            x, v, force, tangent = x1, v1, force1, tangent1
            drive += speed * dt
            left -= dt
            self.sub_steps += 1
            if left < 1e-12:
                break
            dt *= 2.0
        self._sub_s = dt
        self.tip_m, self.tip_speed, self.force_n, self._tangent = x, v, force, tangent
        self.peak_n = peak
        if force == 0.0:
            self._contact_m = surface + self._law.residual_m
