"""The contract of a simulated rig: that of its devices in its own time, and the two as one rig.

What is not checked: its faults, six axes, and whether its physics is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from functools import partial

from stepload.errors import SteploadError
from stepload.rig.contract import CHECKS, CheckResult, CheckStatus, run_check
from stepload.rig.contract_arm import ramp
from stepload.rig.contract_samples import GAIN_TOLERANCE, mean
from stepload.rig.contract_trial import ContractViolation, SkippedCheck, Trial, drain, require
from stepload.rig.device import Device
from stepload.rig.world import DEFAULT_SPEC as SPEC
from stepload.rig.world import SimulatedRig, WorldFactory, WorldFault, WorldSpec

TOP_N = 60.0
SLOW_M_S, FAST_M_S = 2e-3, 10e-3
EARLY_M = 100e-6
"""How far before the surface a force may show: dynamics, lag and lost motion."""
FREE_N = 6.0 * SPEC.force_noise_n + SPEC.force_quantum_n
NEWEST_S = 0.05
OPEN_S = 5.0
Make = Callable[[WorldSpec], SimulatedRig]


def run_world(world: WorldFactory, options: Mapping[str, object]) -> list[CheckResult]:
    """Run every check that a simulated rig can be tried with."""

    def make(spec: WorldSpec) -> SimulatedRig:
        return world(spec, **options)

    results = []
    for which in ("arm", "force"):
        trial = _trial(make, which)
        found = [run_check(check, trial) for check in CHECKS]
        results += [replace(each, name=f"{which}.{each.name}") for each in found]
    own = (check_clock, check_rates, check_seed, check_press, check_faults)
    results += [run_check(check, make) for check in own]
    return [each for each in results if each.status is not CheckStatus.SKIPPED]


def _trial(make: Make, which: str) -> Trial:
    """A trial of one device of a rig; each device that is made has a rig of its own."""
    rigs: list[SimulatedRig] = []

    def device() -> Device:
        rigs[:] = [make(SPEC)]
        found: Device = getattr(rigs[0], which)
        return found

    force = which == "force"
    return Trial(
        device,
        now_s=lambda: rigs[0].clock.now_s(),
        wait=lambda seconds: _pass(rigs[0], seconds),
        noise=SPEC.force_noise_n if force else None,
        resolution=SPEC.force_quantum_n if force else 0.0,
        move_m=1e-3,
    )


@contextmanager
def _open_rig(make: Make) -> Iterator[SimulatedRig]:
    rig = make(SPEC)
    require(isinstance(rig, SimulatedRig), f"the world gave {type(rig).__name__}")
    with closing(rig.arm), closing(rig.force):
        rig.force.open(OPEN_S)
        rig.arm.open(OPEN_S)
        yield rig


def _pass(rig: SimulatedRig, seconds: float) -> None:
    rig.clock.sleep_until(rig.clock.now_s() + seconds)


def check_clock(make: Make) -> None:
    """Virtual time stands until it is slept on, and both devices live in it."""
    with _open_rig(make) as rig:
        if not rig.clock.virtual:
            raise SkippedCheck("it runs in real time")
        begin_s = rig.clock.now_s()
        drain(rig.arm), drain(rig.force)
        require(rig.clock.now_s() == begin_s, "time passes though nobody sleeps")
        _pass(rig, 0.5)
        passed_s = rig.clock.now_s() - begin_s
        require(abs(passed_s - 0.5) < 1e-6, f"slept 0.5 s, {passed_s:.6f} s passed")
        for name, samples in (("arm", drain(rig.arm)), ("force sensor", drain(rig.force))):
            old_s = rig.clock.now_s() - samples[-1].receive_time_s
            told = f"the newest sample of the {name} is {old_s:.3g} s old: another clock"
            require(-1e-6 < old_s < NEWEST_S, told)


def check_rates(make: Make) -> None:
    """The devices run at the rates of the plan: delays and filters of a run rest on them."""
    with _open_rig(make) as rig:
        for name, rate_hz, planned_hz in (
            ("arm", 1.0 / rig.arm.period_s, SPEC.arm_rate_hz),
            ("force", rig.force.rate_hz, SPEC.force_rate_hz),
        ):
            told = f"{name}: {rate_hz:g} Hz, the spec says {planned_hz:g} Hz"
            require(abs(rate_hz / planned_hz - 1.0) < 0.05, told)
        require(rig.arm.has_force == SPEC.arm_has_force, "arm.has_force is not arm_has_force")


def check_seed(make: Make) -> None:
    """The same spec gives the same samples."""
    found = []
    for _ in range(2):
        with _open_rig(make) as rig:
            _pass(rig, 0.2)
            found.append([repr(each) for each in (*drain(rig.arm), *drain(rig.force))])
    require(found[0] == found[1], "two rigs of one spec and seed give other samples")


def check_press(make: Make) -> str:
    """Towards the plate the force comes at the surface, with the stated sign, and goes again."""
    with _open_rig(make) as rig:
        zero_n = _force_n(rig, 0.5)
        target_m = early_m = SPEC.surface_m - EARLY_M
        _go(rig, early_m, FAST_M_S)
        before_n = _force_n(rig, 0.2) - zero_n
        require(abs(before_n) < FREE_N, f"{before_n:.3g} N, 0.1 mm before the surface")
        while (force_n := _force_n(rig, 0.02) - zero_n) < TOP_N:
            target_m += 10e-6
            told = f"{force_n:.3g} N along {SPEC.force_axis}, 1 mm beyond the surface"
            require(target_m < SPEC.surface_m + 1e-3, f"{told}: no contact, or the wrong sign")
            _go(rig, target_m, SLOW_M_S)
        _pass(rig, 0.3)
        read_n, truth = _force_n(rig, 0.2) - zero_n, rig.world
        said = f"{read_n:.4g} N read, true force not told"
        if truth is not None:
            true_n, peak_n = truth.true_force_n, truth.true_peak_force_n
            said = f"{read_n:.4g} N read, {true_n:.4g} N true, true peak {peak_n:.4g} N"
            require(abs(read_n - true_n) < GAIN_TOLERANCE * read_n and peak_n >= true_n, said)
        _go(rig, early_m, FAST_M_S)
        after_n = _force_n(rig, 0.2) - zero_n
        require(abs(after_n) < FREE_N, f"{after_n:.3g} N after the way back")
    return said


def _go(rig: SimulatedRig, to_m: float, speed_m_s: float) -> None:
    trial = Trial(lambda: rig.arm, wait=partial(_pass, rig), speed_m_s=speed_m_s)
    ramp(rig.arm, trial, (rig.arm.held_m(),), (to_m,))


def _force_n(rig: SimulatedRig, over_s: float) -> float:
    """Mean force along the sensor's axis over a time."""
    drain(rig.force), drain(rig.arm)
    _pass(rig, over_s)
    which, sign = "xyz".index(SPEC.force_axis[-1]), -1.0 if SPEC.force_axis[0] == "-" else 1.0
    return sign * mean(drain(rig.force))[which]


def check_faults(make: Make) -> None:
    """A fault that the world does not know is refused."""
    with suppress(SteploadError):
        make(replace(SPEC, faults=(WorldFault("no_such_fault", 1.0, 1.0, 1.0),)))
        raise ContractViolation("an unknown fault is taken and never shown")
