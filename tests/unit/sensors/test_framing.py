"""Frames of fixed size in a byte stream: damage costs what it touched, and is counted."""

import pytest

from stepload_drivers.framing import FrameDecoder


def decoder():
    """Frames are ">" and three digits whose last is the sum of the first two, modulo 10."""

    def decode(raw):
        a, b, total = (byte - 48 for byte in raw[1:])
        return raw if (a + b) % 10 == total else None

    return FrameDecoder(ord(">"), 4, decode)


@pytest.mark.parametrize("noise", [b">", b">>", b">1", b">12", b">>9>", b"xyz", b">999"])
def test_noise_before_a_frame_costs_no_frame(noise):
    frames = decoder()
    assert frames.feed(b">123" + noise + b">224>336") == [b">123", b">224", b">336"]
    assert (frames.damaged, frames.skipped) == (1, len(noise))


def test_every_damaged_frame_is_counted():
    frames = decoder()
    frames.feed(b">123")
    for _ in range(3):
        assert frames.feed(b">129>123") == [b">123"]
    assert (frames.damaged, frames.skipped) == (3, 12)
