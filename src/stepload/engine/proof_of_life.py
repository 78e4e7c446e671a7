"""Before the approach: a small shake in free air, which every force channel must feel.

A sensor that is dead under live noise, or wired with the wrong sign, axis or gain, looks sound at
rest, but does not measure the inertia of the mass that it carries.
"""

from __future__ import annotations

import math

import numpy as np

from stepload.engine.course import Course, Then
from stepload.engine.felt_mass import FeltMass, felt_mass
from stepload.engine.lock_in import LockIn
from stepload.engine.watch import ForceWatch
from stepload.envelope.shake import SETTLING_CYCLES, Shake, ShakenChannel
from stepload.record.rows import Phase

LEAST_FOLLOWED = 0.3
"""Least share of the expected swing (after the arm's lag) that must be measured."""


class ProofOfLife:
    """Shakes the arm forth, on the way that it has backed off by, and back again.

    Then it judges what the channels felt.

    Args:
        course: state of the run.
        stopped: what to do when the operator stops the run here.
        shake: travel, period and channels.
    """

    def __init__(self, course: Course, stopped: Then, shake: Shake) -> None:
        self._course = course
        self._stopped = stopped
        self._shake = shake
        self._then = stopped
        self._begin_s = self._begin_m = math.nan
        self._cycle = 0
        self._position = LockIn(shake.omega_rad_s, 1)
        self._forces = [
            (channel, LockIn(shake.omega_rad_s, 1 if self._watch(channel) is None else 3))
            for channel in shake.channels
        ]

    def prove(self, now_s: float, then: Then) -> None:
        """Shake; end the run if a channel measures a wrong mass, else call `then`."""
        course = self._course
        self._then = then
        self._begin_s, self._begin_m = now_s, course.target_m
        course.enter(Phase.PROOF_OF_LIFE, now_s, self._act)

    def _watch(self, channel: ShakenChannel) -> ForceWatch | None:
        """The sensor of a channel; None where it is the arm's own force."""
        return self._course.sup.second if channel.second else self._course.sup.force

    def _act(self, now_s: float, _step_s: float) -> None:
        course, shake = self._course, self._shake
        if course.stop_asked():
            self._stopped(now_s)
            return
        self._listen()
        since_s = now_s - self._begin_s
        cycle = int(since_s / shake.period_s)
        if cycle > self._cycle:
            self._next_cycle(cycle)
        if cycle < SETTLING_CYCLES + shake.cycles:
            swing = 0.5 * (1.0 - math.cos(shake.omega_rad_s * since_s))
            course.target_m = self._begin_m + shake.travel_m * swing
        else:
            course.target_m = self._begin_m
            self._judge(now_s)

    def _listen(self) -> None:
        """Add new readings; the times of the forces are corrected for the channels' delays."""
        sup, position = self._course.sup, self._position
        if sup.arm.fresh:
            position.add(sup.arm.receive_s - self._begin_s, (sup.arm.position_m,))
        for channel, lock_in in self._forces:
            watch = self._watch(channel)
            stream = sup.arm if watch is None else watch
            if stream.fresh:
                values = (sup.arm.force_n,) if watch is None else watch.wrench[:3]
                lock_in.add(stream.receive_s - channel.delay_s - self._begin_s, values)

    def _next_cycle(self, cycle: int) -> None:
        """End a cycle: its readings are fitted, or dropped while the arm is still settling in."""
        for lock_in in (self._position, *(lock_in for _, lock_in in self._forces)):
            if self._cycle < SETTLING_CYCLES:
                lock_in.drop()
            else:
                lock_in.end_cycle()
        self._cycle = cycle

    def _judge(self, now_s: float) -> None:
        course, shake = self._course, self._shake
        swings = self._position.amplitudes[:, 0]
        swing_m = float(np.abs(swings).mean())
        asked_m = 0.5 * shake.follow * shake.travel_m
        if not swing_m >= LEAST_FOLLOWED * asked_m:
            course.fail(
                "proof_of_life", swing_m, LEAST_FOLLOWED * asked_m, "m",
                f"the arm was to shake by {asked_m * 1e6:.3g} um about its middle, and its measured"
                f" position did so by {swing_m * 1e6:.3g} um: it does not follow",
            )  # fmt: skip
            return
        felt = [self._felt(shake, channel, lock_in) for channel, lock_in in self._forces]
        course.emit(now_s, "proof_of_life", _told(shake, felt))
        worst = max(felt, key=lambda one: (bool(one.problem), abs(one.along - 1.0)))
        if worst.problem:
            problems = "; ".join(one.problem for one in felt if one.problem)
            course.fail("proof_of_life", worst.along, 1.0, "", problems)
        else:
            self._then(now_s)

    def _felt(self, shake: Shake, channel: ShakenChannel, lock_in: LockIn) -> FeltMass:
        watch = self._watch(channel)
        along, sign = (0, 1.0) if watch is None else watch.axis
        swings = self._position.amplitudes[:, 0]
        return felt_mass(shake, channel, swings, lock_in.amplitudes, along, sign)


def _told(shake: Shake, felt: list[FeltMass]) -> dict[str, object]:
    """The figures for the record."""
    return {
        "travel_m": shake.travel_m, "frequency_hz": 1.0 / shake.period_s, "cycles": shake.cycles,
        "acceleration_m_s2": shake.acceleration_m_s2,
        "channels": [
            {"channel": one.channel.key, "tool_mass_kg": one.channel.mass_kg,
             "felt_kg": one.along * one.channel.mass_kg,
             "half_width_kg": one.half_width * one.channel.mass_kg,
             "across_kg": one.across * one.channel.mass_kg, "across_axis": one.across_axis,
             "proven": one.proven}
            for one in felt
        ],
    }  # fmt: skip
