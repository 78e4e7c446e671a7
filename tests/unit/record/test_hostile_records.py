"""Bytes nobody wrote: a clear error or what is provably there, never a crash."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stepload.errors import BadInputError
from stepload.record.container import MAGIC
from stepload.record.reader import read_recording
from stepload.record.recovery import recover
from stepload.record.scan import DamageError, RawRecord, Scan, runs


@pytest.fixture
def hostile(write_record: Callable[..., Path], tmp_path: Path) -> Path:
    return write_record("honest.mcap", chunks=3)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    changes=st.lists(
        st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.binary(min_size=1, max_size=9)),
        min_size=1,
        max_size=4,
    ),
    keep=st.floats(0.05, 1.0),
)
def test_mutated_files_are_read_or_refused(
    hostile: Path, tmp_path: Path, changes: list[tuple[float, bytes]], keep: float
) -> None:
    honest = read_recording(hostile)
    data = bytearray(hostile.read_bytes())
    for share, patch in changes:
        at = int(share * len(data))
        data[at : at + len(patch)] = patch
    path = tmp_path / "mutated.mcap"
    path.write_bytes(data[: int(keep * len(data))])
    try:
        got = read_recording(path)
    except BadInputError:
        got = None
    if got is not None:
        n = len(got.force.sequence)
        np.testing.assert_array_equal(got.force.wrench, honest.force.wrench[:n])
        assert got.partial or n == len(honest.force.sequence)
    out = tmp_path / "repaired.mcap"
    out.unlink(missing_ok=True)
    try:
        recovered = recover(path, out)
    except BadInputError:
        return
    if got is not None:
        assert recovered.counts.get("/force", 0) >= len(got.force.sequence)


@given(st.binary(max_size=400))
def test_chunk_content_of_any_bytes_adds_up_or_fails(raw: bytes) -> None:
    end = 0
    try:
        for run in runs(0, raw):
            assert run.at == end
            end = run.end
    except DamageError:
        return
    assert end == len(raw)


def chunk_record(raw: bytes, claimed: int, crc: int = 0) -> bytes:
    packed = zstandard.compress(raw)
    body = struct.pack("<QQQI", 0, 0, claimed, crc) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", 6, len(body)) + body


@pytest.mark.parametrize("claimed", [1 << 27, 0, 1 << 40])
def test_bombs_are_not_expanded(tmp_path: Path, claimed: int) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(MAGIC + chunk_record(b"\x00" * (1 << 27), claimed) * 3)
    with pytest.raises(BadInputError, match=r"expands to|holds a frame of"):
        read_recording(path)


@pytest.mark.parametrize(
    ("claimed", "crc", "damaged"),
    [(5, zlib.crc32(b"12345"), False), (5, 0, False), (5, 1, True), (6, 0, True), (4, 0, True)],
)
def test_a_chunk_is_what_it_says(claimed: int, crc: int, damaged: bool) -> None:
    body = struct.pack("<QQQIIQ", 0, 0, claimed, crc, 0, 5) + b"12345"
    scan = Scan(io.BytesIO(), 100)
    record = RawRecord(0, 6, body)
    if damaged:
        with pytest.raises(DamageError, match="checksum"):
            scan.chunk(record)
    else:
        assert scan.chunk(record).raw == b"12345"
