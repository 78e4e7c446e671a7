"""A simulated rig in virtual time: time passes when it is slept on, as fast as the host can."""

from __future__ import annotations

from stepload.rig.world import SimulatedRig, WorldSpec
from stepload_drivers.sim.arm import WorldArm
from stepload_drivers.sim.faults import FAULTS, HOST, Schedule
from stepload_drivers.sim.sensors import WorldDisplacementSensor, WorldForceSensor
from stepload_drivers.sim.simulation import World


class VirtualHost:
    """The program's side of a simulated rig (a `sensors.Host`, and its place), and its clock.

    Time passes only when it is slept on, and takes the world with it.
    """

    virtual = True
    origin_s = 0.0

    def __init__(self, world: World) -> None:
        self.world = world
        self._now_s = 0.0
        self._stalls = Schedule(world.spec.faults, kinds=HOST)

    def now_s(self) -> float:
        return self._now_s

    def sleep_until(self, time_s: float) -> None:
        if time_s <= self._now_s:
            return
        if time_s >= self._stalls.next_s:
            time_s += self._stalls.take(time_s)
        self.world.advance(time_s)
        self._now_s = time_s

    @property
    def clock(self) -> VirtualHost:
        return self

    def host(self) -> VirtualHost:
        return self

    def give_back(self) -> None:
        """The world goes on for as long as anything refers to it."""

    def catch_up(self) -> float:
        return self._now_s


def virtual_rig(world: World) -> SimulatedRig:
    """The devices of a world in virtual time."""
    host = VirtualHost(world)
    return SimulatedRig(
        arm=WorldArm(host),
        force=WorldForceSensor(host),
        displacement=WorldDisplacementSensor(host) if world.gauge else None,
        second_force=WorldForceSensor(host, second=True) if world.second_force else None,
        clock=host,
        world=world,
    )


class _OpenWorld:
    """A simulated rig of `spec` in virtual time; entry point of group `stepload.worlds`.

    Raises:
        BadInputError: an unknown fault.
        DomainError: a number that no rig or payload has.
    """

    faults = FAULTS

    def __call__(self, spec: WorldSpec) -> SimulatedRig:
        return virtual_rig(World(spec))


open_world = _OpenWorld()
