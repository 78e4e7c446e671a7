"""The contract of a simulated rig: that of its devices in its own time, and the two as one rig.

What is not checked: faults, six axes, and whether its physics is right.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import replace
from functools import partial

from stepload.errors import SteploadError
from stepload.rig.contract import CHECKS, CheckResult, CheckStatus, run_check
from stepload.rig.contract_samples import GAIN_TOLERANCE
from stepload.rig.contract_trial import SkippedCheck, Trial, drain, require
from stepload.rig.device import Arm, Device, ForceSensor
from stepload.rig.samples import ForceSample
from stepload.rig.world import DEFAULT_SPEC as SPEC
from stepload.rig.world import SimulatedRig, WorldFactory, WorldFault

TOP_N = 60.0
SLOW_M_S = 2e-3
FAST_M_S = 10e-3
EARLY_M = 100e-6
"""How far before the surface a force may show: dynamics, lag and lost motion."""
SIGMAS = 6.0
OPEN_S = 5.0


def run_world(world: WorldFactory, options: Mapping[str, object]) -> list[CheckResult]:
    """Run every check that a simulated rig can be tried with."""
    make = partial(world, SPEC, **options)
    results = []
    for which in ("arm", "force"):
        trial = _trial(make, which)
        found = [run_check(check, trial) for check in CHECKS]
        results += [
            replace(each, name=f"{which}.{each.name}")
            for each in found
            if each.status is not CheckStatus.SKIPPED
        ]
    unused = Trial(make=lambda: make().arm)
    checks: tuple[Callable[[Callable[[], SimulatedRig]], str | None], ...] = (
        check_clock, check_rates, check_seed, check_press,
    )  # fmt: skip

    def named(check: Callable[..., str | None], call: Callable[[], str | None]) -> CheckResult:
        return replace(run_check(lambda _: call(), unused), name=check.__name__[6:])

    results += [named(check, partial(check, make)) for check in checks]
    results.append(named(check_faults, partial(check_faults, world, options)))
    return results


def _trial(make: Callable[[], SimulatedRig], which: str) -> Trial:
    """A trial of one device of a rig; each device that is made has a rig of its own."""
    rigs: list[SimulatedRig] = []

    def device() -> Device:
        rigs[:] = [make()]
        found: Device = getattr(rigs[0], which)
        return found

    def now_s() -> float:
        return rigs[0].clock.now_s()

    return Trial(
        device,
        now_s=now_s,
        wait=lambda seconds: rigs[0].clock.sleep_until(now_s() + seconds),
        noise=SPEC.force_noise_n if which == "force" else None,
        resolution=SPEC.force_quantum_n if which == "force" else 0.0,
        move_m=1e-3,
    )


def _opened(make: Callable[[], SimulatedRig]) -> SimulatedRig:
    rig = make()
    require(isinstance(rig, SimulatedRig), f"the world gave {type(rig).__name__}")
    require(isinstance(rig.arm, Arm), f"the arm is {type(rig.arm).__name__}, no Arm")
    require(isinstance(rig.force, ForceSensor), f"the force sensor is {type(rig.force).__name__}")
    rig.force.open(OPEN_S)
    rig.arm.open(OPEN_S)
    return rig


def check_clock(make: Callable[[], SimulatedRig]) -> None:
    """Virtual time stands until it is slept on, and both devices live in it."""
    rig = _opened(make)
    with closing(rig.arm), closing(rig.force):
        if not rig.clock.virtual:
            raise SkippedCheck("it runs in real time")
        begin_s = rig.clock.now_s()
        drain(rig.arm), drain(rig.force)
        require(rig.clock.now_s() == begin_s, "time passes though nobody sleeps")
        rig.clock.sleep_until(begin_s + 0.5)
        now_s = rig.clock.now_s()
        require(abs(now_s - begin_s - 0.5) < 1e-6, f"slept 0.5 s, {now_s - begin_s:.6f} s passed")
        for device in (rig.arm, rig.force):
            stamps = [sample.receive_time_s for sample in drain(device)]
            newest_s = max(stamps, default=-math.inf)
            require(
                0.0 <= now_s - newest_s + 1e-6 < 0.05,
                f"{type(device).__name__}: newest sample {now_s - newest_s:.3g} s old: wrong clock",
            )


def check_rates(make: Callable[[], SimulatedRig]) -> None:
    """The devices run at the rates of the plan: delays and filters of a run rest on them."""
    rig = _opened(make)
    with closing(rig.arm), closing(rig.force):
        for name, rate_hz, planned_hz in (
            ("arm", 1.0 / rig.arm.period_s, SPEC.arm_rate_hz),
            ("force", rig.force.rate_hz, SPEC.force_rate_hz),
        ):
            told = f"{name}: {rate_hz:g} Hz, the spec says {planned_hz:g} Hz"
            require(abs(rate_hz / planned_hz - 1.0) < 0.05, told)
        require(rig.arm.has_force == SPEC.arm_has_force, "arm.has_force is not arm_has_force")


def check_seed(make: Callable[[], SimulatedRig]) -> None:
    """The same spec gives the same samples."""
    found = []
    for _ in range(2):
        rig = _opened(make)
        with closing(rig.arm), closing(rig.force):
            rig.clock.sleep_until(rig.clock.now_s() + 0.2)
            found.append([repr(each) for each in (*drain(rig.arm), *drain(rig.force))])
    require(found[0] == found[1], "two rigs of one spec and seed give other samples")


def check_press(make: Callable[[], SimulatedRig]) -> str:
    """Towards the plate the force comes at the surface, with the stated sign, and goes again."""
    rig = _opened(make)
    with closing(rig.arm), closing(rig.force):
        _run(rig, 0.0, 0.0)
        zero_n, noise_n = _force_n(rig, 0.5), SIGMAS * SPEC.force_noise_n + SPEC.force_quantum_n
        early_m = SPEC.surface_m - EARLY_M
        _run(rig, early_m, FAST_M_S)
        before_n = _force_n(rig, 0.2) - zero_n
        require(abs(before_n) < noise_n, f"{before_n:.3g} N, 0.1 mm before the surface")
        target_m, force_n = early_m, 0.0
        while force_n < TOP_N:
            target_m += 10e-6
            if target_m > SPEC.surface_m + 1e-3:
                told = (
                    f"1 mm beyond the surface the force along {SPEC.force_axis} is {force_n:.3g} N"
                )
                require(False, f"{told}: no contact, or the wrong sign")
            _run(rig, target_m, SLOW_M_S)
            force_n = _force_n(rig, 0.02) - zero_n
        said = _compare(rig, zero_n)
        _run(rig, early_m, FAST_M_S)
        after_n = _force_n(rig, 0.2) - zero_n
        require(abs(after_n) < noise_n, f"{after_n:.3g} N after the way back")
    return said


def _compare(rig: SimulatedRig, zero_n: float) -> str:
    """What is read against the truth, where the world tells it."""
    rig.clock.sleep_until(rig.clock.now_s() + 0.3)
    read_n = _force_n(rig, 0.2) - zero_n
    if rig.world is None:
        return f"{read_n:.4g} N read; the world does not tell the true force"
    true_n, peak_n = rig.world.true_force_n, rig.world.true_peak_force_n
    told = f"{read_n:.4g} N read, {true_n:.4g} N true"
    require(abs(read_n / true_n - 1.0) < GAIN_TOLERANCE if true_n else False, told)
    require(peak_n >= true_n, f"a true peak of {peak_n:.4g} N below the true force {true_n:.4g} N")
    return told


def _run(rig: SimulatedRig, to_m: float, speed_m_s: float) -> None:
    """Command a ramp from where the arm is held, as a run does: one target a period."""
    at_m, period_s = rig.arm.held_m(), rig.arm.period_s
    steps = math.ceil(abs(to_m - at_m) / speed_m_s / period_s) if speed_m_s else 1
    for step in range(1, steps + 1):
        rig.arm.command(at_m + (to_m - at_m) * step / steps)
        rig.clock.sleep_until(rig.clock.now_s() + period_s)
        drain(rig.arm), drain(rig.force)
    rig.clock.sleep_until(rig.clock.now_s() + 10.0 * SPEC.lag_s + SPEC.command_delay_s)
    drain(rig.arm), drain(rig.force)


def _force_n(rig: SimulatedRig, over_s: float) -> float:
    """Mean force along the sensor's axis over a time."""
    rig.clock.sleep_until(rig.clock.now_s() + over_s)
    which = "xyz".index(SPEC.force_axis[-1])
    sign = -1.0 if SPEC.force_axis[0] == "-" else 1.0
    values = [s.wrench[which] for s in drain(rig.force) if isinstance(s, ForceSample)]
    require(bool(values), "no force samples")
    return sign * math.fsum(values) / len(values)


def check_faults(world: WorldFactory, options: Mapping[str, object]) -> None:
    """A fault that the world does not know is refused."""
    unknown = WorldFault("no_such_fault", 1.0, 1.0, 1.0)
    try:
        world(replace(SPEC, faults=(unknown,)), **options)
    except SteploadError:
        return
    require(False, "an unknown fault is taken and never shown")
