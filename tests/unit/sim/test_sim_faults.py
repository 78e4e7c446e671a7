"""Every fault is seen from its start on, and not before; and it does what its line of help says."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from stepload.errors import DeviceError
from stepload.rig.faults import Fault, FaultCode
from stepload.rig.samples import Status
from stepload.rig.world import DEFAULT_SPEC, SimulatedRig, WorldFault
from stepload_drivers.sim.faults import FAULTS
from stepload_drivers.sim.world import open_world

START_S, DURATION_S, END_S = 0.3, 0.2, 0.8
MAGNITUDES = {"gain": 0.5, "bias": -20.0, "delay": 0.05, "clock_step": 7.0, "position_drift": 1e-3}
MAGNITUDES |= {"position_jump": 2e-3}
MAGNITUDES |= {"command_latency": 0.1, "command_jitter": 0.1, "host_stall": 0.15}
MAGNITUDES |= {"gain_ramp": -0.5, "bias_ramp": -20.0, "clipped": 1e-6, "plate_moves": 20e-6}
ONLY_SIX = ("force_lateral_dead", "force_lateral_swapped", "force_torque_dead")
ONLY_SIX += ("force_torque_saturated", "plate_slips", "arm_turned")
MAGNITUDES |= {"aged": 0.1, "old": 0.1, "filter": 0.1}

SPEC = replace(
    DEFAULT_SPEC,
    surface_m=0.05e-3,
    gauge_rate_hz=200.0,
    gauge_noise_m=0.1e-6,
    gauge_quantum_m=0.05e-6,
    second_force_rate_hz=500.0,
    second_force_noise_n=0.2,
    second_force_quantum_n=0.1,
    second_force_range_n=1000.0,
)


@dataclass
class Seen:
    """What a program sees of a rig in 0.8 s of slow pressing."""

    force: list[Any] = field(default_factory=list)
    second: list[Any] = field(default_factory=list)
    gauge: list[Any] = field(default_factory=list)
    arm: list[Any] = field(default_factory=list)
    raised: list[tuple[float, str]] = field(default_factory=list)
    ticks: list[float] = field(default_factory=list)
    faults: dict[str, Fault | None] = field(default_factory=dict)
    rig: SimulatedRig | None = None

    def before(self, time_s: float) -> list[Any]:
        streams = (self.force, self.second, self.gauge, self.arm)
        rows = [sample for stream in streams for sample in stream if sample[2] < time_s]
        return rows + [tick for tick in self.ticks if tick < time_s]

    def window(self, name: str) -> list[Any]:
        """Samples taken while the fault was active."""
        return [s for s in getattr(self, name) if START_S <= s[2] - self.delay(name) < 0.5 - 1e-6]

    @staticmethod
    def delay(name: str) -> float:
        return SPEC.force_delay_s if name == "force" else 0.0


def watch(kind: str | None, magnitude: float | None = None) -> Seen:
    if magnitude is None:
        magnitude = MAGNITUDES.get(kind or "", 0.0)
        for name, value in MAGNITUDES.items():
            if kind and kind.endswith("_" + name):
                magnitude = value
    faults = (WorldFault(kind, START_S, DURATION_S, magnitude),) if kind else ()
    rig = open_world(replace(SPEC, faults=faults))
    seen = Seen(rig=rig)
    assert rig.displacement is not None
    assert rig.second_force is not None
    devices = {
        "force": rig.force,
        "second": rig.second_force,
        "gauge": rig.displacement,
        "arm": rig.arm,
    }
    for device in devices.values():
        device.open(1.0)
    while (now_s := rig.clock.now_s()) < END_S - 1e-6:
        rig.clock.sleep_until(round(now_s + 0.002, 6))
        seen.ticks.append(rig.clock.now_s())
        for name, device in devices.items():
            try:
                getattr(seen, name).extend(device.drain())
            except RuntimeError as error:
                seen.raised.append((rig.clock.now_s(), str(error)))
        try:
            rig.arm.command(0.2e-3 * rig.clock.now_s())
        except RuntimeError as error:
            seen.raised.append((rig.clock.now_s(), str(error)))
    seen.faults = {name: device.fault() for name, device in devices.items()}
    return seen


HEALTHY = watch(None)


def test_healthy_rig_has_no_fault_and_presses() -> None:
    assert set(HEALTHY.faults.values()) == {None}
    assert not HEALTHY.raised
    assert HEALTHY.rig is not None
    assert HEALTHY.rig.world.true_force_n > 50.0


@pytest.mark.parametrize("kind", [k for k in FAULTS if k not in ONLY_SIX])
def test_every_fault_is_seen_from_its_start_and_not_before(kind: str) -> None:
    seen = watch(kind)
    assert seen.before(START_S - 1e-6) == HEALTHY.before(START_S - 1e-6)
    assert (seen.before(END_S), seen.raised) != (HEALTHY.before(END_S), [])


def reading(sample: Any) -> float:
    return float(sample[4][2] if isinstance(sample[4], tuple) else sample[4])


CHANNELS = ["force", "second", "gauge"]


@pytest.mark.parametrize("name", CHANNELS)
class TestChannels:
    def test_freeze(self, name: str) -> None:
        window = watch(f"{name}_freeze").window(name)
        assert len({reading(s) for s in window}) == 1
        assert len({s.sequence for s in window}) == len(window) > 20

    def test_stuck_mean_keeps_the_noise(self, name: str) -> None:
        seen, noise = watch(f"{name}_stuck_mean"), {"gauge": 0.1e-6}.get(name, 0.2)
        window = [reading(s) for s in seen.window(name)]
        healthy = [reading(s) for s in HEALTHY.window(name)]
        assert len(set(window)) > 3
        assert max(window) - min(window) < 8.0 * noise
        assert healthy[-1] - healthy[0] > 12.0 * noise

    def test_dropout_loses_samples_and_goes_on(self, name: str) -> None:
        seen = watch(f"{name}_dropout")
        assert not seen.window(name)
        assert getattr(seen, name)[-1] == getattr(HEALTHY, name)[-1]
        device = {"force": "force", "second": "second_force", "gauge": "displacement"}[name]
        health = getattr(seen.rig, device).health()
        assert health.lost == len(HEALTHY.window(name))
        assert health.longest_gap_s > DURATION_S

    def test_delay(self, name: str) -> None:
        seen = watch(f"{name}_delay")
        late = {
            round(s[2] - h[2], 6)
            for s, h in zip(getattr(seen, name), getattr(HEALTHY, name), strict=False)
        }
        assert {0.0, 0.05} <= late
        received = [s[2] for s in getattr(seen, name)]
        assert received == sorted(received)

    def test_ramps_and_a_channel_that_clips(self, name: str) -> None:
        def ratio(kind: str, magnitude: float) -> list[tuple[float, float, float]]:
            window = watch(f"{name}_{kind}", magnitude).window(name)
            return [
                (s[2] - START_S - Seen.delay(name), reading(s), reading(h))
                for s, h in zip(window, HEALTHY.window(name), strict=True)
            ]

        for after_s, got, sound in ratio("gain_ramp", -2.0):
            assert got == pytest.approx((1.0 - 2.0 * after_s) * sound, abs=0.02 * abs(sound) + 0.1)
        for after_s, got, sound in ratio("bias_ramp", -30.0):
            assert got == pytest.approx(sound - 30.0 * after_s, abs=0.4)
        clipped = 5e-6 if name == "gauge" else 4.0
        for _, got, sound in ratio("clipped", clipped):
            assert got == pytest.approx(max(-clipped, min(clipped, sound)), abs=1e-9)


def test_a_plate_that_moves_presses_as_far_as_springs_give_way() -> None:
    """Slowly, into a linear contact: the force grows by K_eff times the way, and falls again."""
    stiff = replace(
        SPEC, payload=replace(SPEC.payload, law="smooth", k=2e6, n=1.0, hysteresis=0.0),
        faults=(WorldFault("plate_moves", 0.6, 0.5, 20e-6),),
    )  # fmt: skip
    rig = open_world(stiff)
    rig.arm.open(1.0)
    peak_n = before_n = held_n = 0.0
    for tick in range(1, 701):
        rig.clock.sleep_until(0.002 * tick)
        rig.arm.command(min(0.08e-3, 0.4e-3 * rig.clock.now_s()))
        if tick == 299:
            before_n = rig.world.true_force_n
        if tick == 500:
            held_n, peak_n = rig.world.true_force_n, rig.world.true_peak_force_n
    k_s = SPEC.system_stiffness_n_per_m
    grown_n = 20e-6 / (1.0 / k_s + 1.0 / 2e6)
    assert before_n > 1.0
    assert held_n - before_n == pytest.approx(grown_n, rel=0.02)
    assert held_n <= peak_n < held_n + grown_n
    assert rig.world.true_force_n == pytest.approx(before_n, rel=0.02)


def test_command_latency_and_loss_leave_the_arm_behind() -> None:
    at_end = HEALTHY.arm[-1].position_m
    late = [s for s in watch("command_latency").arm if s[2] < 0.45][-1].position_m
    on_time = [s for s in HEALTHY.arm if s[2] < 0.45][-1].position_m
    assert on_time - late > 0.015e-3
    lost = watch("command_lost").arm[-1].position_m
    assert lost == pytest.approx(0.2e-3 * START_S, abs=5e-6)
    assert at_end > 0.15e-3


def test_protective_stop_holds_tells_and_ends() -> None:
    seen = watch("protective_stop")
    window = seen.window("arm")
    assert all(s.status & Status.STOPPED for s in window)
    assert max(s.position_m for s in window) - min(s.position_m for s in window) < 8e-6
    fault = seen.faults["arm"]
    assert fault is not None
    assert fault.code is FaultCode.PROTECTIVE_STOP
    assert not seen.arm[-1].status


def test_after_a_protective_stop_the_arm_waits_for_a_new_target() -> None:
    rig = open_world(
        replace(SPEC, surface_m=1.0, faults=(WorldFault("protective_stop", 0.1, 0.1, 0.0),))
    )
    rig.arm.open(1.0)
    rig.arm.command(-50e-3)
    rig.clock.sleep_until(0.15)
    held_m = rig.arm.drain()[-1].position_m
    assert -40e-3 < held_m < -5e-3
    rig.clock.sleep_until(0.4)
    assert rig.arm.drain()[-1].position_m == pytest.approx(held_m, abs=6e-6)
    rig.arm.command(-50e-3)
    rig.clock.sleep_until(1.5)
    assert rig.arm.drain()[-1].position_m == pytest.approx(-50e-3, abs=10e-6)


def test_command_raise_does_not_stop_the_retract() -> None:
    rig = open_world(replace(SPEC, faults=(WorldFault("command_raise", 0.0, math.inf, 0.0),)))
    rig.arm.open(1.0)
    with pytest.raises(RuntimeError, match="command"):
        rig.arm.command(0.0)
    rig.arm.retract(1e-3, 0.05, 1.0)
    rig.clock.sleep_until(rig.clock.now_s() + 0.1)
    assert rig.arm.drain()[-1].position_m == pytest.approx(-1e-3, abs=20e-6)


@pytest.mark.parametrize("kind", ["command_lost", "protective_stop", "position_frozen"])
def test_retract_that_cannot_be_confirmed_says_so(kind: str) -> None:
    rig = open_world(replace(SPEC, faults=(WorldFault(kind, 0.0, math.inf, 0.0),)))
    rig.arm.open(1.0)
    with pytest.raises(DeviceError, match="retract not confirmed") as caught:
        rig.arm.retract(1e-3, 0.05, 0.5)
    assert caught.value.code in (FaultCode.REFUSED_COMMAND, FaultCode.PROTECTIVE_STOP)
    assert rig.clock.now_s() == pytest.approx(0.5, abs=0.01)


def test_retract_is_sent_but_not_confirmed_while_the_arm_is_silent() -> None:
    rig = open_world(replace(SPEC, faults=(WorldFault("arm_lost", 0.1, 1.0, 0.0),)))
    rig.arm.open(1.0)
    rig.arm.command(0.15e-3)
    rig.clock.sleep_until(0.5)
    assert rig.world.true_force_n > 50.0
    with pytest.raises(DeviceError, match="samples do not arrive"):
        rig.arm.retract(1e-3, 0.05, 0.5)
    assert rig.world.true_force_n == 0.0
    with pytest.raises(DeviceError, match="stop not confirmed"):
        rig.arm.safe(0.1)


def test_retract_from_a_position_that_froze_deep_does_not_push() -> None:
    rig = open_world(replace(SPEC, faults=(WorldFault("position_frozen", 0.5, 9.0, 0.0),)))
    rig.arm.open(1.0)
    rig.arm.command(0.15e-3)
    rig.clock.sleep_until(0.6)
    peak_n = rig.world.true_peak_force_n
    rig.arm.command(-1e-3)
    rig.clock.sleep_until(1.5)
    assert rig.world.true_force_n == 0.0
    with pytest.raises(DeviceError):
        rig.arm.retract(1e-3, 0.05, 0.5)
    assert rig.world.true_force_n == 0.0
    assert rig.world.true_peak_force_n == peak_n


def test_host_stall_happens_once_and_the_rig_goes_on() -> None:
    seen = watch("host_stall")
    gaps = [round(b - a, 6) for a, b in zip(seen.ticks, seen.ticks[1:], strict=False)]
    assert gaps.count(0.002) == len(gaps) - 1
    assert max(gaps) == pytest.approx(0.152)
    assert [s.sequence for s in seen.force] == [s.sequence for s in HEALTHY.force]


def along_n(sample: Any) -> float:
    return float(sample.force_n if hasattr(sample, "force_n") else reading(sample))


@pytest.mark.parametrize("name", ["force", "second", "arm_force"])
def test_a_late_force_is_that_of_before_with_fresh_stamps(name: str) -> None:
    """0.1 s late; a buffer that fills shows the force at its beginning until then."""
    stream, sound = name.removesuffix("_force"), {}
    for s in getattr(HEALTHY, stream):
        sound[round(s[2], 4)] = along_n(s)

    def check(kind: str, expected: Any, noise_n: float) -> None:
        window = watch(f"{name}_{kind}").window(stream)
        assert [s[:3] for s in window] == [s[:3] for s in HEALTHY.window(stream)]
        rows = [s for s in window if round(expected(s[2]), 4) in sound]
        apart = np.array([along_n(s) - sound[round(expected(s[2]), 4)] for s in rows])
        assert len(rows) > 50
        assert abs(apart.mean()) < 0.5 * noise_n
        assert 0.5 * noise_n < apart.std() < 2.5 * noise_n
        assert sound[round(rows[-1][2], 4)] - along_n(rows[-1]) > 5.0

    noise_n = {"force": 0.2, "second": 0.2, "arm_force": SPEC.arm_force_noise_n}[name]
    begin_s = START_S + Seen.delay(stream)
    check("old", lambda t: t - 0.1, noise_n)
    check("aged", lambda t: max(begin_s, t - 0.1), noise_n)


@pytest.mark.parametrize("name", ["force", "second", "arm_force"])
def test_a_filter_follows_a_ramp_by_its_time_constant(name: str) -> None:
    stream = name.removesuffix("_force")
    window, sound = watch(f"{name}_filter", 0.02).window(stream), HEALTHY.window(stream)
    behind = [along_n(h) - along_n(s) for s, h in zip(window, sound, strict=True)]
    grown_n = np.polyfit([s[2] for s in sound], [along_n(s) for s in sound], 1)[0] * 0.02
    assert np.mean(behind[len(behind) // 2 :]) == pytest.approx(grown_n, rel=0.15)


def test_an_arm_that_is_turned_round_moves_away_and_measures_what_was_commanded() -> None:
    turned = (WorldFault("arm_turned", 0.0, math.inf, 0.0),)
    for faults, pressed in ((turned, False), ((), True)):
        rig = open_world(replace(SPEC, faults=faults))
        rig.arm.open(1.0)
        for goal_m in (0.2e-3, -0.2e-3):
            rig.arm.command(goal_m)
            rig.clock.sleep_until(rig.clock.now_s() + 0.5)
            assert rig.arm.drain()[-1].position_m == pytest.approx(goal_m, abs=10e-6)
            assert rig.arm.held_m() == goal_m
            assert (rig.world.true_force_n > 50.0) == ((goal_m > 0.0) == pressed)
        rig.arm.safe(0.5)
        assert (rig.world.true_force_n > 50.0) != pressed
        before_n = rig.world.true_force_n
        rig.arm.retract(0.1e-3, 0.01, 0.5)
        assert (rig.world.true_force_n > before_n) != pressed
