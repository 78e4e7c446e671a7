"""The mechanics of a rig with six axes: three drives, a tip on springs, a plate with friction."""

from __future__ import annotations

import math

from stepload.rig.mount import ZERO, Mount, Vector3
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.drive import Drive
from stepload_drivers.sim.faults import Schedule
from stepload_drivers.sim.plant import BasePlant, Plant
from stepload_drivers.sim.six_tip import SWING_RAD, SixTip
from stepload_drivers.sim.springs import times, tip_constraint

_WAY_STEPS = 500
"""Base steps of the way to a start pose that presses, and of rest after it."""


class SixPlant(BasePlant):
    """Adds the axes across the press: `load` is the contact force on the plate, pressing frame.

    `peak_n` is of the resultant contact force.

    Args:
        spec: the truth.
        mount: how the tip is held.
        step_s: base step; the drives' speed is constant within it.
        swing_rad, error_factor: refine the sub-stepping (tests of convergence).

    Raises:
        DomainError: numbers that no rig has.
    """

    def __init__(
        self,
        spec: WorldSpec,
        mount: Mount,
        *,
        step_s: float,
        swing_rad: float = SWING_RAD,
        error_factor: float = 1.0,
    ) -> None:
        super().__init__(spec, step_s=step_s)
        self.mount = mount
        self._across = Drive(spec, step_s, across=True), Drive(spec, step_s, across=True)
        self._shifted = False
        self._held = tip_constraint(spec, mount, step_s)
        self.to_press = axes = self._held.to_press
        self._pulls = tuple(times(self._held.stiffness, axis) for axis in axes)
        self._slippery = Schedule(spec.faults, kinds=("plate_slips",))
        self._drive = ZERO
        self._steep = axes[2][2]
        """Cosine of the tilt: depth along the normal over travel along the press."""
        self.tip = SixTip(
            self._held,
            mount,
            self._law,
            self._steep * spec.surface_m,
            spec.payload.poisson_ratio,
            spec.payload.n,
            step_s=step_s,
            swing_rad=swing_rad,
            error_factor=error_factor,
        )
        if self.tip.depth_m > self._law.residual_m:
            self._begin_in_contact()
        self.peak_equivalent_n = 0.0
        self._take_load()
        self.last_load, self.last_force_n = self.load, self.force_n

    def _begin_in_contact(self) -> None:
        """The start pose presses: the drives came there along the press, slowly, from free air.

        Friction held the tip on that way as it does in a run.
        """
        x, y, z = self.to_press[2]
        at_m = (self.tip.surface_m + self._law.residual_m) / self._steep
        self.tip.at = (x * at_m, y * at_m, z * at_m)
        for i in range(2 * _WAY_STEPS):
            share = math.cos(0.5 * math.pi * min(1.0, i / _WAY_STEPS))
            later = math.cos(0.5 * math.pi * min(1.0, (i + 1) / _WAY_STEPS))
            speed = at_m * (later - share) / self.step_s
            drive = x * at_m * share, y * at_m * share, z * at_m * share
            self.tip.step(drive, (x * speed, y * speed, z * speed), 0.0)

    def command_shift(self, apply_s: float, x_m: float, y_m: float) -> None:
        """Let the drives across the press follow these targets."""
        for drive, target_m in zip(self._across, (x_m, y_m), strict=True):
            drive.command(apply_s, target_m)

    def step(self) -> None:
        """Go on by `step_s`: what moves by itself, the drives at constant speed, then the tip."""
        self.last_load, self.last_force_n = self.load, self.force_n
        time_s = self.time_s
        one, other = self._across
        waiting = self._axis.commands or one.commands or other.commands
        if waiting or not self._idle or self.braked or time_s >= self._slippery.next_s:
            self._move(time_s)
        self._steps = steps = self._steps + 1
        self.time_s = steps * self.step_s

    def _move(self, time_s: float) -> None:
        axial, (one, other), tip = self._axis, self._across, self.tip
        axial.take_commands(time_s)
        for drive in (one, other):
            if drive.commands:
                self._shifted = drive.take_commands(time_s) or self._shifted
        if time_s >= self._slippery.next_s:
            self._take_friction()
        before = self._drive
        moving = self._advance_drives()
        nearer_m_s = 0.0
        if self._moves:
            nearer_m_s = self._drift_m_s + self._plate_change_m() / self.step_s
        if self._creep is not None:
            self._creep.flow(self.step_s)
            tip.yielded()
        if tip.step(before, moving, self._steep * nearer_m_s):
            self._take_load()
            self._idle = False
        else:
            stand = axial.stands and one.stands and other.stands
            self._idle = stand and not self._moves and self._creep is None

    def _take_load(self) -> None:
        tip = self.tip
        rubbing = tip.rubbing
        self.load: Vector3 = times(self.to_press, (rubbing[0], rubbing[1], tip.normal_n))
        self.force_n = self.load[2]
        self.peak_n, self.peak_equivalent_n = tip.peak_n, tip.peak_equivalent_n

    def _take_friction(self) -> None:
        static, kinetic = self.mount.friction_static, self.mount.friction_kinetic
        most = self._slippery.active(self.time_s).get("plate_slips", static)
        self.tip.slips_at(min(static, most), min(kinetic, most))

    def _advance_drives(self) -> Vector3:
        """All drives by one base step; their speed in the plate's frame."""
        axial, (one, other) = self._axis, self._across
        if self.braked:
            axial.hold()
            one.hold()
            other.hold()
            return ZERO
        x, y, z = self.to_press
        along = axial.advance(self._push_n(2))
        at_m = axial.position_m
        if not self._shifted:
            z1, z2, z3 = z
            self._drive = (z1 * at_m, z2 * at_m, z3 * at_m)
            return z1 * along, z2 * along, z3 * along
        first, second = one.advance(self._push_n(0)), other.advance(self._push_n(1))
        x_m, y_m = one.position_m, other.position_m
        d1, d2, d3 = (x[i] * x_m + y[i] * y_m + z[i] * at_m for i in range(3))
        self._drive = (d1, d2, d3)
        g1, g2, g3 = (x[i] * first + y[i] * second + z[i] * along for i in range(3))
        return g1, g2, g3

    def _push_n(self, axis: int) -> float:
        """Force of the springs along an axis of the pressing frame."""
        (d1, d2, d3), (x1, x2, x3) = self._drive, self.tip.at
        p, q, r = self._pulls[axis]
        return p * (d1 - x1) + q * (d2 - x2) + r * (d3 - x3)

    @property
    def sub_steps(self) -> int:
        return self.tip.sub_steps

    @property
    def surface_m(self) -> float:
        """Travel at which the virgin payload touches."""
        return self.tip.surface_m / self._steep

    @property
    def drive_speed(self) -> float:
        """Along the press, m/s; of the fastest drive where others move too."""
        speed = self._axis.speed_m_s
        if not self._shifted:
            return speed
        return max(speed, *(drive.speed_m_s for drive in self._across), key=abs)

    @property
    def tip_m(self) -> float:
        """Travel of the tip along the press."""
        return times(self.to_press, self.tip.at)[2]

    @property
    def tip_speed(self) -> float:
        return times(self.to_press, self.tip.speed)[2]

    @property
    def closed_m(self) -> float:
        """Approach of payload and plate where the gauge sits, without the give of the load path."""
        closed_m = self.tip.depth_m / self._steep
        if self._give is not None and self.tip.normal_n > 0.0:
            closed_m -= self._give(self.tip.normal_n)[0]
        x_m, y_m = self.mount.gauge_offset_m
        if x_m or y_m:
            turn = self.turn_rad
            closed_m += turn[0] * y_m - turn[1] * x_m
        return closed_m

    @property
    def turn_rad(self) -> Vector3:
        """Rotation of the tool under the load, pressing frame."""
        return times(self.mount.turn_rad_per_n, self.load)

    @property
    def shift_m(self) -> tuple[float, float]:
        """Where the drives across the press are, as the arm measures it."""
        return self._across[0].position_m, self._across[1].position_m

    @property
    def friction_n(self) -> float:
        """Contact force in the plane of the plate, at least 0."""
        return math.hypot(self.tip.rubbing.x, self.tip.rubbing.y)


Mechanics = Plant | SixPlant
"""Along the press alone, or in six axes."""
