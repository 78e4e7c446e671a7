"""RFT messages against the vendor's own encoder, and against damage."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.framing import CanFrame, CanPairer
from stepload_drivers.robotous import codec
from stepload_drivers.robotous.codec import MODELS, Command, UartDecoder, model_named

SAMPLE = bytes.fromhex("55 0B 02 71 FF CE F4 48 03 E8 F8 30 00 07 00 00 00 A1 AA")
RFT64 = model_named("RFT64-SB01")


@pytest.mark.parametrize(
    ("name", "parameters", "expected"),
    [
        (Command.START, (), "55 0B 00 00 00 00 00 00 00 0B AA"),
        (Command.STOP, (), "55 0C 00 00 00 00 00 00 00 0C AA"),
        (Command.SET_RATE, (8,), "55 0F 08 00 00 00 00 00 00 17 AA"),
        (Command.BIAS, (1,), "55 11 01 00 00 00 00 00 00 12 AA"),
        (Command.SET_FILTER, (1, 5), "55 08 01 05 00 00 00 00 00 0E AA"),
        (Command.SET_BAUD, (1,), "55 06 01 00 00 00 00 00 00 07 AA"),
    ],
)
def test_commands_are_the_vendors_bytes(name, parameters, expected):
    assert codec.uart_frame(codec.command(name, *parameters)) == bytes.fromhex(expected)


def test_uart_sample_of_the_vendor():
    (payload,) = UartDecoder().feed(SAMPLE)
    assert codec.wrench(payload, RFT64) == (12.5, -1.0, -60.0, 0.5, -1.0, 0.0035)
    assert codec.overload(payload) == 0


def test_can_sample_of_the_vendor():
    pairer = CanPairer((1, 2), 1e-3)
    assert pairer.feed(CanFrame(1, bytes.fromhex("0B0271FFCEF44803"), 0.0)) is None
    payload = pairer.feed(CanFrame(2, bytes.fromhex("E8F8300007000000"), 2e-4))
    assert codec.wrench(payload, RFT64) == (12.5, -1.0, -60.0, 0.5, -1.0, 0.0035)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_models_are_found_by_the_name_they_give(model):
    assert model_named(model.name.lower() + "-X") == model


def test_a_lost_half_is_an_orphan_and_never_pairs_with_the_next():
    pairer = CanPairer((1, 2), 1e-3)
    assert pairer.feed(CanFrame(1, b"A" * 8, 0.000)) is None
    assert pairer.feed(CanFrame(1, b"B" * 8, 0.001)) is None
    assert pairer.feed(CanFrame(2, b"b" * 8, 0.0012)) == b"B" * 8 + b"b" * 8
    assert pairer.feed(CanFrame(2, b"c" * 8, 0.0022)) is None
    assert pairer.orphans == 2


def test_halves_of_two_samples_are_told_apart_by_time():
    pairer = CanPairer((1, 2), 1e-3)
    pairer.feed(CanFrame(1, b"A" * 8, 0.000))
    assert pairer.feed(CanFrame(2, b"b" * 8, 0.0013)) is None
    assert pairer.orphans == 2


def test_halves_that_a_stall_of_the_host_drew_apart_belong_together():
    pairer = CanPairer((1, 2), 1e-3)
    pairer.feed(CanFrame(1, b"A" * 8, 0.0, 0.5e-3))
    assert pairer.feed(CanFrame(2, b"a" * 8, 0.2, 0.1999)) == b"A" * 8 + b"a" * 8
    pairer.feed(CanFrame(1, b"B" * 8, 0.3))
    assert pairer.feed(CanFrame(2, b"c" * 8, 0.5, 0.1)) is None
    assert pairer.orphans == 2


payloads = st.binary(min_size=16, max_size=16)


@given(st.lists(payloads, max_size=8), st.lists(st.integers(1, 40), max_size=20))
def test_any_cutting_of_the_stream_gives_every_payload_once(sent, cuts):
    stream = b"".join(map(codec.uart_frame, sent))
    decoder, got = UartDecoder(), []
    for cut in cuts:
        got += decoder.feed(stream[:cut])
        stream = stream[cut:]
    got += decoder.feed(stream)
    assert got == sent
    assert decoder.damaged == 0


@given(st.binary(max_size=400))
def test_random_bytes_give_only_frames_that_add_up(data):
    for payload in UartDecoder().feed(data):
        assert codec.uart_frame(payload) in data


@given(payloads, st.integers(0, 151), payloads)
def test_one_flipped_bit_costs_one_frame(first, bit, second):
    damaged = bytearray(codec.uart_frame(first))
    damaged[bit // 8] ^= 1 << bit % 8
    good = codec.uart_frame(second)
    decoder = UartDecoder()
    assert decoder.feed(good) == [second]
    got = decoder.feed(bytes(damaged) + good * 2)
    assert first not in got or first == second
    assert got[-1] == second
    assert decoder.damaged >= 1
