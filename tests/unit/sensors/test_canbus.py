"""Lines of an slcan adapter: python-can's own parser trusts them, this one does not."""

import os
import pty
import time
import tty

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.canbus import MAX_BATCH, CanLink, FastSlcan, slcan_frame
from stepload_drivers.framing import CanFrame, CanPairer


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("t00180B0271FFCEF44803", (1, bytes.fromhex("0B0271FFCEF44803"))),
        ("t2000", (0x200, b"")),
        ("t2002ABCD1F40", (0x200, b"\xab\xcd")),
    ],
)
def test_frames_with_and_without_time_stamp(line, expected):
    assert slcan_frame(line) == expected


@given(st.text(max_size=40))
def test_any_text_is_a_frame_or_none(line):
    frame = slcan_frame(line)
    assert frame is None or (frame[0] < 0x800 and len(frame[1]) <= 8)


@pytest.fixture
def adapter():
    master, slave = pty.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    os.close(master)
    os.close(slave)


def read_frame(bus, timeout):
    message, _ = bus._recv_internal(timeout)
    if message is None:
        return None
    return CanFrame(message.arbitration_id, bytes(message.data), message.timestamp, bus.early_s)


def together(first, second):
    """Whether two frames are taken for halves of one message."""
    pairer = CanPairer((1, 2), 1e-3, (1, 1))
    pairer.feed(first)
    return pairer.feed(second) is not None


def test_what_came_while_the_host_stalled_may_have_come_at_any_time_of_it(adapter):
    master, channel = adapter
    bus = FastSlcan(channel, bitrate=1_000_000)
    try:
        os.write(master, b"t00112A\r")
        first = read_frame(bus, 1.0)
        os.write(master, b"t00212B\r")
        time.sleep(0.02)  # a stalled reader
        second = read_frame(bus, 1.0)
        assert (first.id, second.id) == (1, 2)
        assert second.time_s - first.time_s >= 0.02
        assert together(first, second)

        os.write(master, b"t00112A\r")
        first = read_frame(bus, 1.0)
        assert read_frame(bus, 0.005) is None  # nothing came for 5 ms
        os.write(master, b"t00212B\r")
        assert not together(first, read_frame(bus, 1.0))
    finally:
        bus.shutdown()
        bus.serialPortOrig.close()


def test_a_backlog_longer_than_a_batch_comes_out_whole(adapter):
    master, channel = adapter
    link = CanLink("slcan", channel, 1_000_000, 1.0)
    sent = 5 * MAX_BATCH // 2
    try:
        os.write(master, b"".join(b"t0011%02X\r" % number for number in range(sent)))
        got: list[int] = []
        while frames := link.receive(0.0):
            assert len(frames) <= MAX_BATCH
            got += [frame.data[0] for frame in frames]
        assert got == list(range(sent))
    finally:
        link.close()
