"""Bota frames against the vendor's vector and CRC, against wrap and damage."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.bota import codec
from stepload_drivers.bota.codec import Decoder, DeviceClock, Frame
from stepload_verify.emulators.bota import encode

VECTOR = bytes.fromhex(
    "AA 00 00 00 00 C0 3F 00 00 10 C0 00 00 F0 C1 00 00 00 3E 00 00 00 BF 00 00 80 3D"
    "15 CD 5B 07 00 00 D4 41 85 BF"
)
FRAME = Frame(0, (1.5, -2.25, -30.0, 0.125, -0.5, 0.0625), 123456789, 26.5)


def bitwise_crc(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc ^ 0xFFFF


@given(st.binary(max_size=64))
def test_crc_is_the_bitwise_one(data):
    assert codec.crc_x25(data) == bitwise_crc(data)


def test_vendor_frame_both_ways():
    assert codec.decode(VECTOR) == FRAME
    assert encode(FRAME) == VECTOR


@pytest.mark.parametrize(("rate_hz", "sinc"), sorted(codec.SINC_OF_RATE.items()))
def test_rates_follow_from_the_sinc_length(rate_hz, sinc):
    assert 1.0 / (sinc * codec.SINC_STEP_S) == pytest.approx(rate_hz, rel=0.005)


def test_clock_goes_on_over_the_wrap():
    clock = DeviceClock()
    first, _ = clock.advance(2**32 - 400)
    second, step = clock.advance(600)
    assert step == pytest.approx(1e-3)
    assert second - first == pytest.approx(1e-3)


def numbered(number):
    return encode(Frame(0, (float(number), 0.5, -0.5, 0.0, 0.0, 0.0), 1000 * number, 25.0))


def test_damaged_frames_cost_only_themselves():
    chance = random.Random(5)
    damaged = set(chance.sample(range(1, 10_000), 94))
    decoder, got = Decoder(), []
    for number in range(10_000):
        raw = bytearray(numbered(number))
        if number in damaged:
            raw[chance.randrange(37)] ^= 1 << chance.randrange(8)
        got += [int(frame.wrench[0]) for frame in decoder.feed(bytes(raw))]
    assert got == [number for number in range(10_000) if number not in damaged]
    assert 85 <= decoder.damaged <= 94


@given(st.lists(st.integers(0, 1000), max_size=6), st.lists(st.integers(1, 60), max_size=12))
def test_any_cutting_of_the_stream_gives_every_frame_once(numbers, cuts):
    stream = b"".join(map(numbered, numbers))
    decoder, got = Decoder(), []
    for cut in cuts:
        got += decoder.feed(stream[:cut])
        stream = stream[cut:]
    got += decoder.feed(stream)
    assert [int(frame.wrench[0]) for frame in got] == numbers


@given(st.binary(max_size=300))
def test_random_bytes_never_crash_and_never_pass_a_wrong_crc(data):
    for _ in Decoder().feed(data):
        assert any(
            data[i] == 0xAA
            and bitwise_crc(data[i + 1 : i + 35]) == data[i + 35] | data[i + 36] << 8
            for i in range(len(data) - 36)
        )


@given(st.integers(0, 37 * 8 - 1), st.integers(0, 37 * 8 - 1))
def test_one_or_two_flipped_bits_are_always_seen(first, second):
    raw = bytearray(VECTOR)
    raw[first // 8] ^= 1 << first % 8
    if second != first:
        raw[second // 8] ^= 1 << second % 8
    assert codec.decode(bytes(raw)) is None
