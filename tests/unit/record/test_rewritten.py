"""A record that another MCAP writer wrote again reads as its original, with or without chunks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from stepload.record.container import Appender
from stepload.record.reader import read_recording
from stepload.record.recovery import recover
from stepload.record.scan import DamageError, count_messages, open_scan
from stepload.record.summary import read_summary

BARE = {
    "index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False,
    "use_statistics": False, "use_summary_offsets": False,
}  # fmt: skip
KINDS: dict[str, dict[str, Any]] = {
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "small chunks": {"chunk_size": 2000, "enable_data_crcs": True},
    "one chunk": {"chunk_size": 1 << 24},
    "no index": {"index_types": IndexType.NONE},
    "no summary": {**BARE, "enable_crcs": False},
    "no chunks": {"use_chunking": False},
    "no chunks, no summary": {"use_chunking": False, **BARE},
}


def rewritten(source: Path, target: Path, **how: Any) -> Path:
    """The record as the writer of the package mcap writes it, its messages in order of time."""
    with source.open("rb") as file, target.open("wb") as out:
        reader, writer = make_reader(file), Writer(out, **how)
        writer.start(profile="ros2", library="other")
        for each in reader.iter_attachments():
            writer.add_attachment(
                each.create_time, each.log_time, each.name, each.media_type, each.data
            )
        for about in reader.iter_metadata():
            writer.add_metadata(about.name, about.metadata)
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():
            if channel.id not in channels:
                assert schema is not None
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, known, channel.metadata
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time,
                message.sequence,
            )  # fmt: skip
        writer.finish()
    return target


@pytest.mark.parametrize("kind", KINDS)
def test_what_another_writer_wrote_reads_as_its_original(
    write_record: Callable[..., Path], tmp_path: Path, kind: str
) -> None:
    original = write_record()
    path = rewritten(original, tmp_path / "other.mcap", **KINDS[kind])
    wanted, got = read_recording(original), read_recording(path)
    assert not got.damage
    assert not got.partial
    for stream in ("force", "arm", "ticks"):
        for column, values in getattr(wanted, stream)._asdict().items():
            np.testing.assert_array_equal(getattr(getattr(got, stream), column), values)
    assert (got.events, got.results, got.metadata) == (
        wanted.events, wanted.results, wanted.metadata
    )  # fmt: skip
    assert count_messages(path) == count_messages(original)
    assert read_summary(path).results == read_summary(original).results == {"k": 1.5}
    again = recover(path)
    assert again.cut_bytes == 0
    assert again.counts == count_messages(original)


@pytest.mark.parametrize("kind", ["lz4", "no chunks"])
def test_a_cut_in_it_is_found(write_record: Callable[..., Path], tmp_path: Path, kind: str) -> None:
    path = rewritten(write_record(), tmp_path / "other.mcap", **KINDS[kind], chunk_size=8000)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    got = read_recording(path)
    assert got.damage
    assert 0 < len(got.force.sequence) < 400
    np.testing.assert_array_equal(got.force.sequence, np.arange(len(got.force.sequence)))


@pytest.mark.parametrize("results", [b"[]", b"{"])
def test_results_that_are_no_object_are_none(
    write_record: Callable[..., Path], tmp_path: Path, results: bytes
) -> None:
    path = tmp_path / "other.mcap"
    with write_record(finished=False).open("rb") as file, path.open("wb") as out:
        out.write(file.read())
        rest = Appender(out.fileno())
        out.flush()
        rest.add_attachment("results.json", results, 0)
        rest.finish()
    found = read_summary(path)
    assert found.partial
    assert found.results is None
    assert found.metadata == {"force_axis": "+fz"}


def test_an_lz4_chunk_cannot_be_larger_than_it_says(
    write_record: Callable[..., Path], tmp_path: Path
) -> None:
    path = rewritten(write_record(), tmp_path / "other.mcap", **KINDS["lz4"])
    data = bytearray(path.read_bytes())
    at = data.index(b"\x03\x00\x00\x00lz4") - 12  # its uncompressed size
    data[at : at + 8] = (100).to_bytes(8, "little")
    path.write_bytes(data)
    file, scan = open_scan(path)
    with file:
        chunk = next(each for each in scan.records() if each.opcode == Opcode.CHUNK)
        with pytest.raises(DamageError, match="checksum"):
            scan.chunk(chunk)
