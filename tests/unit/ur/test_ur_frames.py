"""The RTDE frame codec: any split, any garbage."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.ur.frames import (
    KNOWN_TYPES,
    Frame,
    FrameError,
    FrameReader,
    encode,
)

FRAMES = st.lists(
    st.builds(Frame, st.sampled_from(sorted(KNOWN_TYPES)), st.binary(max_size=60)), max_size=8
)


@given(FRAMES, st.data())
def test_frames_survive_any_split_of_the_stream(frames, data):
    stream = b"".join(encode(kind, payload) for kind, payload in frames)
    reader, got = FrameReader(), []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        got += reader.feed(stream[:size])
        stream = stream[size:]
    assert got == frames


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
