"""Devices of a simulated rig in virtual time: samples, health, safing, determinism."""

from __future__ import annotations

import contextlib
import math
import statistics
from dataclasses import replace
from itertools import pairwise

import pytest

from stepload.errors import BadInputError, DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ArmSample, ForceSample
from stepload.rig.world import DEFAULT_SPEC, SimulatedRig, WorldFault, WorldSpec
from stepload_drivers.sim.noise import smooth_error
from stepload_drivers.sim.plant import Plant
from stepload_drivers.sim.world import open_world

SPEC = replace(DEFAULT_SPEC, surface_m=0.1e-3)


def opened(spec: WorldSpec) -> SimulatedRig:
    rig = open_world(spec)
    rig.arm.open(1.0)
    rig.force.open(1.0)
    return rig


def run(
    rig: SimulatedRig, seconds: float, target_m: float
) -> tuple[list[ArmSample], list[ForceSample]]:
    arm, force = [], []
    end_s = rig.clock.now_s() + seconds
    while rig.clock.now_s() < end_s - 1e-9:
        rig.clock.sleep_until(rig.clock.now_s() + 0.002)
        arm += rig.arm.drain()
        force += rig.force.drain()
        rig.arm.command(target_m)
    return arm, force


def test_nothing_is_lost_or_repeated_and_times_are_right() -> None:
    rig = opened(SPEC)
    arm, force = run(rig, 1.0, 0.0)
    for samples, period_s, delay_s in ((arm, 0.002, 0.0), (force, 0.001, 0.002)):
        numbers = [s.sequence for s in samples]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        steps = {round(b[1] - a[1], 9) for a, b in pairwise(samples)}
        assert steps == {period_s}
        offsets = {round(s.receive_time_s - s.device_time_s - delay_s, 6) for s in samples}
        assert len(offsets) == 1, "the device's clock has another zero than the host's"
        assert samples[-1].receive_time_s <= rig.clock.now_s() + 1e-9
        assert samples[-1].receive_time_s >= rig.clock.now_s() - period_s - 1e-9


@pytest.mark.parametrize(("axis", "place", "sign"), [("+fx", 0, 1), ("-fy", 1, -1), ("-fz", 2, -1)])
def test_force_axis_is_positive_when_pressing(axis: str, place: int, sign: int) -> None:
    rig = opened(replace(SPEC, force_axis=axis, start_force_bias_n=0.0))
    _, force = run(rig, 1.0, 0.15e-3)
    wrench = force[-1].wrench
    assert sign * wrench[place] == pytest.approx(rig.world.true_force_n, abs=0.5)
    assert rig.world.true_force_n > 20.0
    assert [v for i, v in enumerate(wrench) if i != place] == [0.0] * 5


def test_noise_quantum_bias_and_drift_of_the_force() -> None:
    spec = replace(
        SPEC,
        force_noise_n=0.3,
        force_quantum_n=0.05,
        start_force_bias_n=4.0,
        force_drift_n_per_s=0.5,
    )
    _, force = run(opened(spec), 4.0, 0.0)
    values = [s.wrench[2] for s in force]
    assert statistics.mean(values) == pytest.approx(4.0 + 0.5 * 2.0, abs=0.05)
    late, early = statistics.mean(values[-1000:]), statistics.mean(values[:1000])
    assert late - early == pytest.approx(1.5, abs=0.05)
    level = [v - 4.0 - 0.5 * s.receive_time_s for v, s in zip(values, force, strict=True)]
    assert statistics.stdev(level) == pytest.approx(0.3, rel=0.1)
    assert all(v / 0.05 == pytest.approx(round(v / 0.05), abs=1e-6) for v in values)


def test_beyond_its_range_the_sensor_clips_and_tells() -> None:
    rig = opened(replace(SPEC, force_range_n=30.0, start_force_bias_n=0.0))
    run(rig, 1.0, 0.2e-3)
    _, force = run(rig, 0.1, 0.2e-3)
    assert rig.world.true_force_n > 60.0
    assert force[-1].wrench[2] == pytest.approx(36.0, abs=0.1)
    fault = rig.force.fault()
    assert fault is not None
    assert fault.code is FaultCode.OVERLOAD


def test_measured_position_has_quantum_and_noise() -> None:
    arm, _ = run(opened(replace(SPEC, position_quantum_m=1e-6, position_noise_m=3e-6)), 2.0, 0.0)
    values = [s.position_m for s in arm]
    assert statistics.stdev(values) == pytest.approx(3e-6, rel=0.1)
    assert all(v * 1e6 == pytest.approx(round(v * 1e6), abs=1e-6) for v in values)
    assert arm[-1].pose == (0.0, 0.0, -arm[-1].position_m, 0.0, 0.0, 0.0)


def test_smooth_error_has_its_size_and_length() -> None:
    error = smooth_error(3, 1, 2e-6, 10e-6)
    assert error is not None
    values = [error(i * 1e-6) for i in range(640)]
    assert statistics.pstdev(values) == pytest.approx(2e-6, rel=0.3)
    near = statistics.mean(a * b for a, b in zip(values, values[10:], strict=False))
    assert near / statistics.pvariance(values) == pytest.approx(math.exp(-0.5), abs=0.15)
    assert max(abs(a - b) for a, b in pairwise(values)) < 1e-6
    assert smooth_error(3, 1, 0.0, 10e-6) is None


def test_gauge_takes_the_system_stiffness_out_of_the_chain() -> None:
    rig = opened(replace(SPEC, gauge_rate_hz=100.0, gauge_quantum_m=1e-9))
    assert rig.displacement is not None
    rig.displacement.open(1.0)
    run(rig, 1.0, 0.1e-3)
    free_m = rig.displacement.drain()[-1].displacement_m
    run(rig, 1.0, 0.2e-3)
    pressed_m = rig.displacement.drain()[-1].displacement_m
    force_n = rig.world.true_force_n
    touching_m = 0.1e-3 - SPEC.surface_m
    deformation_m = (force_n / SPEC.payload.k) ** (1.0 / SPEC.payload.n)
    assert pressed_m - free_m == pytest.approx(deformation_m - touching_m, abs=1e-8)


def test_opening_a_dead_link_fails_in_time() -> None:
    rig = open_world(replace(SPEC, faults=(WorldFault("force_lost", 0.0, 1.0, 0.0),)))
    with pytest.raises(DeviceError, match=r"no sample within 0\.5 s") as caught:
        rig.force.open(0.5)
    assert caught.value.code == FaultCode.NOT_CONNECTED
    assert rig.clock.now_s() == pytest.approx(0.5, abs=0.002)
    assert rig.force.drain() == []


def test_undrained_samples_are_not_stale_but_silence_is() -> None:
    rig = opened(replace(SPEC, faults=(WorldFault("force_lost", 5.0, 1.0, 0.0),)))
    rig.clock.sleep_until(4.0)
    assert rig.force.fault() is None
    rig.force.drain()
    rig.clock.sleep_until(6.0)
    fault = rig.force.fault()
    assert fault is not None
    assert fault.code is FaultCode.STALE
    assert rig.force.fault() is fault


def test_safe_stops_and_keeps_the_force_on() -> None:
    rig = opened(SPEC)
    run(rig, 0.3, 0.15e-3)
    before_n = rig.world.true_force_n
    rig.arm.command(0.3e-3)
    rig.arm.safe(0.5)
    rig.clock.sleep_until(rig.clock.now_s() + 0.5)
    assert rig.world.true_force_n == pytest.approx(before_n, rel=0.1)
    rig.arm.safe(0.5)


@pytest.mark.parametrize(
    ("kind", "magnitude"),
    [("position_jump", 20e-3), ("position_jump", -20e-3), ("position_drift", 0.1),
     ("position_drift", -0.1), ("position_frozen", 0.0)],
)  # fmt: skip
def test_a_lying_position_cannot_turn_the_retract_round(kind: str, magnitude: float) -> None:
    rig = opened(replace(SPEC, faults=(WorldFault(kind, 0.9, math.inf, magnitude),)))
    run(rig, 1.0, 0.2e-3)
    assert rig.world.true_force_n > 50.0
    peak_n = rig.world.true_peak_force_n
    with contextlib.suppress(DeviceError):  # it is not confirmed where the position denies it
        rig.arm.retract(1e-3, 0.01, 0.5)
    assert rig.world.true_force_n == 0.0
    assert rig.world.true_peak_force_n == peak_n


def test_retract_unloads_from_the_measured_position() -> None:
    rig = opened(SPEC)
    run(rig, 1.0, 0.2e-3)
    peak_n = rig.world.true_peak_force_n
    began_s = rig.clock.now_s()
    rig.arm.retract(1e-3, 0.01, 2.0)
    assert rig.clock.now_s() - began_s == pytest.approx(0.1, abs=0.1)
    assert rig.world.true_force_n == 0.0
    assert rig.world.true_peak_force_n == peak_n
    rig.arm.drain()
    rig.clock.sleep_until(rig.clock.now_s() + 0.05)
    assert rig.arm.drain()[-1].position_m == pytest.approx(-0.8e-3, abs=20e-6)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_target_that_is_not_finite_is_refused_and_never_forwarded(
    sent: list[float], value: float
) -> None:
    rig = opened(SPEC)
    with pytest.raises(DeviceError) as caught:
        rig.arm.command(value)
    assert caught.value.code == FaultCode.NOT_FINITE
    assert sent == []
    rig.arm.command(1e-5)
    assert sent == [1e-5]


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1e-3])
@pytest.mark.parametrize("place", [0, 1])
def test_a_retract_that_is_no_way_back_is_refused_and_never_forwarded(
    sent: list[float], value: float, place: int
) -> None:
    rig = opened(SPEC)
    numbers = [1e-3, 0.01]
    numbers[place] = value
    with pytest.raises(BadInputError, match="not a positive number"):
        rig.arm.retract(numbers[0], numbers[1], 1.0)
    assert sent == []


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Every target that reaches a simulated plant."""
    targets: list[float] = []
    forward = Plant.command

    def note(self: Plant, time_s: float, position_m: float) -> None:
        targets.append(position_m)
        forward(self, time_s, position_m)

    monkeypatch.setattr(Plant, "command", note)
    return targets


def test_a_target_far_ahead_of_the_last_one_is_refused_and_never_forwarded(
    sent: list[float],
) -> None:
    rig = opened(SPEC)
    with pytest.raises(DeviceError, match="ahead of the last one") as caught:
        rig.arm.command(1.1e-3)
    assert caught.value.code == FaultCode.OUT_OF_RANGE
    rig.arm.command(0.9e-3)
    rig.arm.command(1.8e-3)
    rig.arm.command(-5e-3)
    assert sent == [0.9e-3, 1.8e-3, -5e-3]
