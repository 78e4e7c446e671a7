"""Microseconds of a simulated rig per tick of 1 ms, by situation: `python bench/world.py`.

Each tick is a sleep of the virtual clock, a drain of arm and force sensor, and a command. The
lowest of five repetitions is printed, because the machine's other work only adds.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace

from stepload.rig.mount import Mount
from stepload.rig.world import PayloadTruth, SimulatedRig, WorldSpec
from stepload_drivers.sim.simulation import World
from stepload_drivers.sim.world import open_world

PAYLOAD = PayloadTruth("smooth", 6.57e8, 1.5, 727.0, 0.0, 0.0, 0.0, math.inf)
STVF = WorldSpec(
    seed=1,
    payload=PAYLOAD,
    surface_m=2e-3,
    arm_rate_hz=1000.0,
    system_stiffness_n_per_m=3.49e6,
    system_damping_n_s_per_m=3.87e4,
    effective_mass_kg=20.0,
    command_delay_s=0.002,
    lag_s=0.004,
    lost_motion_m=1e-6,
    max_speed_m_s=0.05,
    max_acceleration_m_s2=2.0,
    max_push_n=1000.0,
    position_quantum_m=2e-6,
    position_noise_m=0.5e-6,
    kinematic_error_m=0.5e-6,
    kinematic_length_m=30e-6,
    arm_has_force=True,
    arm_force_noise_n=3.0,
    force_rate_hz=1000.0,
    force_axis="+fz",
    force_noise_n=0.3,
    force_quantum_n=1.5,
    force_delay_s=0.002,
    force_range_n=1000.0,
    start_force_bias_n=5.0,
    force_drift_n_per_s=0.001,
    gauge_rate_hz=0.0,
    gauge_quantum_m=0.0,
    gauge_noise_m=0.0,
)

SIX_AXES = replace(
    STVF,
    mount=Mount(
        compliance_m_per_n=(
            (1.7 / 3.49e6, 0.0, 0.1 / 3.49e6),
            (0.0, 1.7 / 3.49e6, 0.0),
            (0.1 / 3.49e6, 0.0, 1.0 / 3.49e6),
        ),
        friction_static=0.3,
        friction_kinetic=0.3,
        plate_tilt_rad=(0.0, 0.03),
    ),
)


def drive(rig: SimulatedRig, start_m: float, speed_m_s: float, ticks: int) -> float:
    """CPU seconds for `ticks` ticks along a ramp of commands."""
    sleep, arm, force = rig.clock.sleep_until, rig.arm, rig.force
    now_s = rig.clock.now_s()
    begun = time.process_time()
    for tick in range(1, ticks + 1):
        sleep(now_s + tick * 0.001)
        arm.drain()
        force.drain()
        arm.command(start_m + speed_m_s * tick * 0.001)
    return time.process_time() - begun


def idle(rig: SimulatedRig, ticks: int) -> float:
    """CPU seconds for `ticks` ticks of the world alone, samples made and not drained."""
    sleep = rig.clock.sleep_until
    now_s = rig.clock.now_s()
    begun = time.process_time()
    for tick in range(1, ticks + 1):
        sleep(now_s + tick * 0.001)
    return time.process_time() - begun


def main() -> None:
    ticks = 5000
    rows: dict[str, list[float]] = {}
    for name, spec in [*[("", STVF)] * 5, *[("six axes: ", SIX_AXES)] * 5]:
        rig = open_world(spec)
        rig.arm.open(1.0)
        rig.force.open(1.0)
        world = rig.world
        assert isinstance(world, World)
        rows.setdefault(f"{name}free, standing", []).append(drive(rig, 0.0, 0.0, ticks))
        rows.setdefault(f"{name}free, moving", []).append(drive(rig, 0.0, 0.0004, ticks))
        before = world.plant.sub_steps
        rows.setdefault(f"{name}pressing, 20 um/s", []).append(drive(rig, 0.00198, 0.00002, ticks))
        subs = world.plant.sub_steps - before
        rows.setdefault(f"{name}pressing, holding", []).append(drive(rig, 0.00208, 0.0, ticks))
        rows.setdefault(f"{name}world alone, holding", []).append(idle(rig, ticks))
    for name, seconds in rows.items():
        print(f"{name:31} {min(seconds) / ticks * 1e6:6.2f} us per tick")
    print(f"sub-steps per tick while pressing: {subs / ticks:.2f}")
    print(f"true peak {world.true_peak_force_n:.2f} N")


if __name__ == "__main__":
    main()
