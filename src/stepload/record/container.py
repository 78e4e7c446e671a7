"""Appends to an MCAP file so that it is whole up to the last append, at any instant.

One `write` per chunk with its message indexes; the summary is written at the end from what was
noted on the way. Profile "ros2"; schemas and channels stand before the first chunk.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from numpy.typing import NDArray

from stepload.record.layout import Topic

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "stepload"
INDEX_ENTRY = np.dtype([("log_ns", "<u8"), ("offset", "<u8")])
_CHUNK_HEAD = struct.Struct("<BQQQQI")
_INDEX_HEAD = struct.Struct("<BQHI")


def encode(*parts: records.McapRecord) -> bytes:
    """Whole records as bytes."""
    builder = RecordBuilder()
    for part in parts:
        part.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


def index_record(channel: int, entries: NDArray[np.void]) -> bytes:
    """The Message Index record of a channel; `entries` of type INDEX_ENTRY, sorted by time."""
    raw = entries.tobytes()
    return _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + len(raw), channel, len(raw)) + raw


def sync_directory(path: Path) -> None:
    """Wait until names in a directory are on the disk."""
    fd = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)


class Appender:
    """Writes one MCAP file through a descriptor opened for writing at its end.

    Every method leaves a file that is valid up to `good` bytes; after an OSError the file is cut
    back to there and the error is raised.
    """

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self.good = 0
        self._crc = 0
        self._compressor = zstandard.ZstdCompressor(level=3)
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._chunks: list[records.ChunkIndex] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._metadata: list[records.MetadataIndex] = []
        self.counts: dict[int, int] = {}
        self._first_ns, self.last_ns = 2**64 - 1, 0

    def append(self, *parts: bytes) -> None:
        """Write bytes of whole records.

        Raises:
            OSError: disk full, I/O error; nothing of it is left in the file.
        """
        data = b"".join(parts)
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self.good)
            os.lseek(self._fd, self.good, os.SEEK_SET)
            raise
        self._crc = zlib.crc32(data, self._crc)
        self.good += len(data)

    def sync(self) -> None:
        """Wait until everything written is on the disk."""
        os.fdatasync(self._fd)

    def start(self) -> None:
        self.append(MAGIC, encode(records.Header(profile="ros2", library=LIBRARY)))

    def add_schema(self, schema: records.Schema) -> None:
        self._schemas.append(schema)
        self.append(encode(schema))

    def add_channel(self, channel: records.Channel) -> None:
        self._channels.append(channel)
        self.counts.setdefault(channel.id, 0)
        self.append(encode(channel))

    def add_topics(self, topics: Sequence[Topic]) -> None:
        """One schema per message type, one channel per topic."""
        schema_ids: dict[str, int] = {}
        for topic in topics:
            if topic.schema not in schema_ids:
                schema_ids[topic.schema] = len(schema_ids) + 1
                self.add_schema(
                    records.Schema(
                        id=schema_ids[topic.schema],
                        name=topic.schema,
                        encoding="ros2msg",
                        data=topic.definition.encode(),
                    )
                )
        for topic in topics:
            self.add_channel(
                records.Channel(
                    id=topic.channel,
                    topic=topic.name,
                    message_encoding="cdr",
                    metadata={"offered_qos_profiles": ""},
                    schema_id=schema_ids[topic.schema],
                )
            )

    def add_attachment(self, name: str, data: bytes, time_ns: int) -> None:
        media_type = "application/json" if name.endswith(".json") else "text/plain"
        record = encode(records.Attachment(time_ns, time_ns, name, media_type, data))
        self.append_attachment(record, name, media_type, len(data), time_ns, time_ns)

    def append_attachment(
        self, record: bytes, name: str, media_type: str, size: int, log_ns: int, create_ns: int
    ) -> None:
        """An attachment record that is encoded already."""
        at = self.good
        self.append(record)
        self._attachments.append(
            records.AttachmentIndex(at, len(record), log_ns, create_ns, size, name, media_type)
        )

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        at = self.good
        self.append(encode(records.Metadata(name, dict(data))))
        self._metadata.append(records.MetadataIndex(at, self.good - at, name))

    def add_chunk(self, groups: Sequence[tuple[int, NDArray[np.void], bytes | bytearray]]) -> None:
        """Compress and write one chunk with its message indexes.

        Args:
            groups: per channel its id, its index entries (INDEX_ENTRY, offsets relative to the
                group's own bytes), and its message records as bytes, sorted by log time.
        """
        raw = b"".join(data for _, _, data in groups)
        start_ns = min(int(index["log_ns"][0]) for _, index, _ in groups)
        end_ns = max(int(index["log_ns"][-1]) for _, index, _ in groups)
        packed = self._compressor.compress(raw)
        body = struct.pack("<I4sQ", 4, b"zstd", len(packed)) + packed
        head = _CHUNK_HEAD.pack(
            Opcode.CHUNK, 28 + len(body), start_ns, end_ns, len(raw), zlib.crc32(raw)
        )
        length = len(head) + len(body)
        offset = 0
        indexes: dict[int, tuple[int, bytes]] = {}
        for channel, index, data in groups:
            index["offset"] += offset
            offset += len(data)
            indexes[channel] = (len(index), index_record(channel, index))
        self.append_chunk(
            head + body,
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=self.good,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=end_ns,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=start_ns,
                uncompressed_size=len(raw),
            ),
            indexes,
        )

    def append_chunk(
        self, chunk: bytes, entry: records.ChunkIndex, indexes: Mapping[int, tuple[int, bytes]]
    ) -> None:
        """A chunk record that is encoded already, with (message count, index record) per channel.

        `entry` describes the chunk; where its indexes lie is filled in here.
        """
        at = self.good + len(chunk)
        for channel, (_, raw) in indexes.items():
            entry.message_index_offsets[channel] = at
            at += len(raw)
        entry.chunk_start_offset = self.good
        entry.message_index_length = at - self.good - len(chunk)
        self.append(chunk, *(raw for _, raw in indexes.values()))
        self._chunks.append(entry)
        for channel, (count, _) in indexes.items():
            self.counts[channel] = self.counts.get(channel, 0) + count
        self._first_ns = min(self._first_ns, entry.message_start_time)
        self.last_ns = max(self.last_ns, entry.message_end_time)

    @property
    def topic_counts(self) -> dict[str, int]:
        """Messages written so far, per topic."""
        return {channel.topic: self.counts[channel.id] for channel in self._channels}

    def finish(self) -> None:
        """Write DataEnd, summary and footer, and wait for the disk."""
        data_end = encode(records.DataEnd(self._crc))
        summary_start = self.good + len(data_end)
        messages = sum(self.counts.values())
        statistics = records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self.counts,
            chunk_count=len(self._chunks),
            message_count=messages,
            message_end_time=self.last_ns,
            message_start_time=self._first_ns if messages else 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
        groups: tuple[tuple[Opcode, Sequence[records.McapRecord]], ...] = (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        )
        summary, offsets = b"", []
        for opcode, members in groups:
            raw = encode(*members)
            if raw:
                offsets.append(
                    records.SummaryOffset(opcode, summary_start + len(summary), len(raw))
                )
            summary += raw
        offset_start = summary_start + len(summary)
        summary += encode(*offsets)
        crc = zlib.crc32(
            struct.pack("<BQQQ", Opcode.FOOTER, 20, summary_start, offset_start),
            zlib.crc32(summary),
        )
        footer = encode(records.Footer(summary_start, offset_start, crc))
        self.append(data_end, summary, footer, MAGIC)
        self.sync()
