"""Frames that a USB adapter holds back and hands over in bursts: in virtual time, to the sample."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from stepload_drivers.bota import sensor as module
from stepload_drivers.bota.codec import Frame
from stepload_drivers.bota.sensor import BotaSerial
from stepload_verify.emulators.bota import encode

PERIOD_S = 1e-3
BURST = 16


class Bursts:
    """A port that hands over every 16 frames together, each burst `late_s` after its last frame."""

    slow = False

    def __init__(self, late_s: list[float]) -> None:
        self._late_s = late_s
        self._read = 0
        self.now_s = 0.0

    def read(self) -> bytes:
        first = BURST * self._read
        frames = [
            Frame(0, (0.0, 0.0, 0.1 * number, 0.0, 0.0, 0.0), round(number * 1000), 26.5)
            for number in range(first, first + BURST)
        ]
        self.now_s = (first + BURST - 1) * PERIOD_S + self._late_s[self._read]
        self._read += 1
        return b"".join(map(encode, frames))


@pytest.mark.parametrize(
    ("late_s", "clamped"),
    [([0.001] * 8, 0), ([0.001, 0.003] + [0.001] * 6, 2)],
    ids=["on time", "one late"],
)
def test_each_frame_of_a_burst_has_the_time_of_its_own(monkeypatch, late_s, clamped):
    """After a late burst the next one's first frames would be earlier: time does not run back."""
    port = Bursts(late_s)
    clock = SimpleNamespace(monotonic=lambda: port.now_s)
    monkeypatch.setattr(module, "time", clock)
    driver = BotaSerial(port="a burst", max_age=1.0)
    driver._period_s, driver._link = PERIOD_S, port
    stream = driver._new_stream()
    for _ in late_s:
        driver._read(stream)
    samples = stream.drain()
    assert [sample.sequence for sample in samples] == list(range(1, BURST * len(late_s) + 1))
    true_s = [sample.device_time_s - samples[0].device_time_s for sample in samples]
    delay_s = [sample.receive_time_s - at_s for sample, at_s in zip(samples, true_s, strict=True)]
    late_there = [delay for delay in delay_s if delay != pytest.approx(0.001, abs=1e-9)]
    assert len(late_there) == (BURST + clamped - 1 if clamped else 0)
    receive_s = [sample.receive_time_s for sample in samples]
    assert receive_s == sorted(receive_s)
    assert len(receive_s) - len(set(receive_s)) == clamped
    assert stream.health().lost == 0
