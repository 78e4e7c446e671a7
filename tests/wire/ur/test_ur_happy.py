"""The real ur_rtde against the emulator when nothing is wrong."""

from __future__ import annotations

import math
import time

import pytest
from long_ones import long_rows


def test_open_identifies_proves_the_watchdog_and_arms_it_again(start_emulator, make_arm):
    emulator = start_emulator()
    arm = make_arm(emulator.host, prove_watchdog=True, serial_number="20235500001")
    identity = arm.open(15.0)
    truth = emulator.state()
    assert (identity.driver, identity.model) == ("ur", "UR5")
    assert identity.serial_number == "20235500001"
    assert identity.firmware == "PolyScope 5.12.6.0"
    assert truth["watchdog_trips"] == 1
    assert truth["uploads"] == 2
    assert truth["watchdog_hz"] == 5.0
    assert arm.fault() is None


def test_targets_are_followed_and_no_sample_comes_twice(start_emulator, make_arm, follow, after):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    driven = follow(arm, after(1.0))
    time.sleep(0.2)
    samples = driven.samples + arm.drain()
    arm.close()
    sequences = [sample.sequence for sample in samples]
    stamps = [sample.device_time_s for sample in samples]
    assert sequences == sorted(set(sequences))
    assert all(
        math.isclose((b - a) / 0.002, j - i, abs_tol=0.01)
        for a, b, i, j in zip(stamps, stamps[1:], sequences, sequences[1:], strict=False)
    )
    assert samples[-1].position_m == pytest.approx(driven.targets[-1], abs=2e-6)
    assert all(sample.status == 0 for sample in samples)
    health = arm.health()
    assert health.received == len(samples)
    assert health.received + health.lost == sequences[-1] + 1
    assert arm.fault() is None


def test_retract_goes_back_by_the_distance_from_where_the_arm_is(
    start_emulator, make_arm, follow, after
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    before = follow(arm, after(0.5)).samples[-1].position_m
    arm.retract(0.003, 0.02, 5.0)
    assert arm.drain()[-1].position_m == pytest.approx(before - 0.003, abs=3e-4)
    arm.safe(3.0)
    assert not emulator.state()["moving"]
    assert arm.fault() is None


def test_stop_is_proven_in_motion_and_the_arm_can_be_used_afterwards(
    start_emulator, make_arm, follow, after
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    proof = arm.prove_stop(0.002, 0.01, 10.0)
    assert proof.stop_s > 0.15
    assert proof.travel_m < 0.002
    assert emulator.state()["watchdog_hz"] == 5.0
    targets = follow(arm, after(0.3)).targets
    time.sleep(0.15)
    assert arm.drain()[-1].position_m == pytest.approx(targets[-1], abs=2e-6)
    assert arm.fault() is None


def test_idle_arm_is_kept_alive_by_the_child_alone(start_emulator, make_arm):
    emulator = start_emulator()
    arm = make_arm(emulator.host, watchdog=20.0)
    arm.open(15.0)
    time.sleep(0.8)
    assert arm.fault() is None
    # How many of the packages ur_rtde hands over is the host's doing (what the child does with each
    # is proven in virtual time); that they come to the end is the arm's being alive.
    samples = arm.drain()
    assert samples[-1].device_time_s - samples[0].device_time_s > 0.5
    assert emulator.state()["watchdog_trips"] == 0


def test_close_ends_the_program_and_open_works_again(start_emulator, make_arm):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    arm.close()
    assert emulator.state()["runtime_state"] == 1
    arm.open(15.0)
    assert arm.drain()[-1].sequence >= 0
    arm.close()
    arm.close()


@pytest.mark.parametrize(
    ("version", "period_s", "options"),
    [
        ((3, 15, 8, 0), 0.008, {}),
        *long_rows(
            [
                ((5, 4, 3, 0), 0.002, {}),
                ((5, 23, 0, 0), 0.002, {}),
                ((5, 12, 6, 0), 0.002, {"upper_registers": True}),
                (
                    (5, 12, 6, 0),
                    0.002,
                    {
                        "tcp_offset": [0, 0, 0.12],
                        "payload_mass": 1.2,
                        "payload_cog": [0, 0, 0.05],
                    },
                ),
            ]
        ),
    ],
)
def test_supported_controllers_and_settings(
    start_emulator, make_arm, follow, after, version, period_s, options
):
    emulator = start_emulator(version=version)
    arm = make_arm(emulator.host, **options)
    arm.open(15.0)
    assert arm.period_s == period_s
    targets = follow(arm, after(0.3)).targets
    time.sleep(0.15)
    assert arm.drain()[-1].position_m == pytest.approx(targets[-1], abs=2e-6)
    assert arm.fault() is None


def test_samples_wait_for_a_run_that_does_not_read(start_emulator, make_arm):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    arm.drain()
    time.sleep(1.0)
    samples = arm.drain()
    time.sleep(0.1)
    samples += arm.drain()
    assert samples[-1].sequence - samples[0].sequence >= 490
    assert len(samples) + arm.health().lost >= samples[-1].sequence - samples[0].sequence
