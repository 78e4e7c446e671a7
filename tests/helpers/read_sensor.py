"""A stream driver that is read step by step in virtual time, without its thread."""

from __future__ import annotations

from stepload_drivers.streamed import Deadline


def connect(sensor, timeout_s: float = 5.0):
    """Open `sensor` as its `open` does, but start no thread; its identity."""
    identity = sensor._connect(Deadline(timeout_s))
    sensor._stream = sensor._new_stream()
    return identity


def look(sensor, clock):
    """One turn of the reader thread; the samples that came."""
    began_s = clock.now_s
    sensor._read(sensor._stream)
    sensor._stream.looked(began_s)
    return sensor.drain()


def read(sensor, clock, seconds: float):
    """Samples of some time."""
    samples, end_s = [], clock.now_s + seconds
    while clock.now_s < end_s:
        samples += look(sensor, clock)
    return samples
