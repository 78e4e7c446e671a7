"""The RTDE frame codec: any split, any garbage."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload_drivers.ur.frames import (
    KNOWN_TYPES,
    Frame,
    FrameError,
    FrameReader,
    encode,
    package_struct,
    split_names,
)

FRAMES = st.lists(
    st.builds(Frame, st.sampled_from(sorted(KNOWN_TYPES)), st.binary(max_size=60)), max_size=8
)


@settings(max_examples=60, deadline=None)
@given(FRAMES, st.data())
def test_frames_survive_any_split_of_the_stream(frames, data):
    stream = b"".join(encode(kind, payload) for kind, payload in frames)
    reader, got = FrameReader(), []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        got += reader.feed(stream[:size])
        stream = stream[size:]
    assert got == frames


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=200))
def test_garbage_gives_frames_that_encode_back_or_a_frame_error(garbage):
    reader = FrameReader()
    try:
        frames = reader.feed(garbage)
    except FrameError:
        return
    assert garbage.startswith(b"".join(encode(kind, payload) for kind, payload in frames))


def test_bytes_of_the_guide():
    assert encode(ord("V"), b"\x00\x02") == bytes.fromhex("0005 56 0002")
    assert FrameReader().feed(bytes.fromhex("0004 56 01 0003")) == [Frame(ord("V"), b"\x01")]


@pytest.mark.parametrize("size", [0, 1, 2])
def test_size_below_the_header_is_lost_framing(size):
    with pytest.raises(FrameError, match=f"size {size} bytes"):
        FrameReader().feed(struct.pack(">HB", size, ord("U")))


def test_package_longer_than_the_size_field_is_refused():
    with pytest.raises(FrameError, match="65535"):
        encode(ord("U"), bytes(65533))


def test_names_lose_the_empty_last_one():
    assert split_names(b"timestamp,actual_q,") == ["timestamp", "actual_q"]


def test_layout_has_no_padding_and_knows_its_types():
    assert package_struct(["DOUBLE", "VECTOR6D", "UINT32"]).size == 1 + 8 + 48 + 4
    with pytest.raises(FrameError, match="IN_USE"):
        package_struct(["DOUBLE", "IN_USE"])
