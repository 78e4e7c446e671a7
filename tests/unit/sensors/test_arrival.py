"""Losses found from arrival times alone, through jitter, bursts and a clock that is off."""

import random

import pytest

from stepload_drivers.arrival import ArrivalCounter


def arrivals(count, period_s, rng, jitter_s, burst_s, lost):
    """(number of samples, time) as a host sees them."""
    now_s = waiting = 0
    for index in range(count):
        time_s = 100.0 + index * period_s + rng.expovariate(1.0 / jitter_s)
        if burst_s:
            time_s = (time_s // burst_s + 1) * burst_s
        if index in lost:
            continue
        if waiting and time_s > now_s:
            yield waiting, now_s
            waiting = 0
        now_s = max(now_s, time_s)
        waiting += 1
    yield waiting, now_s


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    ("clock", "burst_s"), [(0.99, 0.0), (1.0, 0.0), (1.004, 0.0), (1.0, 0.004), (1.0, 0.016)]
)
def test_lost_samples_are_counted(seed, burst_s, clock):
    rng = random.Random(seed)
    lost = set(rng.sample(range(1500, 9000), 12))
    counter = ArrivalCounter(1e-3)
    found = sum(
        counter.arrived(count, time_s)
        for count, time_s in arrivals(10_000, clock * 1e-3, rng, 1e-4, burst_s, lost)
    )
    assert found == len(lost)


@pytest.mark.parametrize("seed", range(5))
def test_jitter_and_stalls_are_no_loss(seed):
    rng = random.Random(seed)
    counter, found, waiting, blocked_s = ArrivalCounter(1e-3), 0, 0, 0.0
    for index in range(20_000):
        time_s = 50.0 + index * 1e-3
        waiting += 1
        if time_s < blocked_s:
            continue
        if rng.random() < 0.005:
            blocked_s = time_s + rng.uniform(0.0, 0.08)
        found += counter.arrived(waiting, time_s + rng.uniform(0.0, 9e-4))
        waiting = 0
    assert found == 0
