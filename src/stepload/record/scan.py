"""Walks an MCAP file record by record, trusting nothing: every length and checksum is checked.

Needs no index and no footer, so it reads unfinished and cut files up to where they are whole.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar

import lz4.frame
import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from stepload.errors import BadInputError
from stepload.record.container import MAGIC
from stepload.record.layout import LOG_TIME_AT, MESSAGE_HEAD, MESSAGE_OPCODE, RECORD_HEAD

MAX_RECORD_BYTES = 1 << 28
"""No record of ours comes near it; bounds the memory a hostile file can ask for."""
MAX_EXPANSION = 100
"""Each message costs 16 bytes of index on disk, so honest files stay far below."""
_BLOCK_BYTES = 1 << 22
_FREE_EXPANSION_BYTES = 1 << 26
_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII")
_LOOSE_HEAD = _CHUNK_HEAD.size + 8
LEAST_MESSAGE = RECORD_HEAD + MESSAGE_HEAD

_WORD = np.dtype("<u8")

R = TypeVar("R", bound=records.McapRecord)


class DamageError(Exception):
    """From byte `at` on the file cannot be trusted."""

    def __init__(self, at: int, why: str) -> None:
        super().__init__(f"byte {at}: {why}")
        self.at = at


class RawRecord(NamedTuple):
    """One whole record: where it begins in the file, its opcode, its content without head."""

    at: int
    opcode: int
    body: bytes

    @property
    def end(self) -> int:
        return self.at + RECORD_HEAD + len(self.body)

    def encoded(self) -> bytes:
        """The record as it stood in the file."""
        return _RECORD_HEAD.pack(self.opcode, len(self.body)) + self.body


@dataclass(frozen=True, slots=True)
class Chunk:
    """A decompressed chunk whose checksum is right."""

    start_ns: int
    end_ns: int
    compression: str
    compressed_size: int
    raw: bytes


class Run(NamedTuple):
    """`number` records of one kind in a row, `stride` bytes apart, from byte `at` of a chunk."""

    opcode: int
    channel: int
    at: int
    stride: int
    number: int

    @property
    def end(self) -> int:
        return self.at + self.stride * self.number

    def record(self, at: int, raw: bytes) -> RawRecord:
        """The first one, from the bytes of the chunk that begins at byte `at` of the file."""
        return RawRecord(at, self.opcode, raw[self.at + RECORD_HEAD : self.at + self.stride])


def parse(kind: type[R], record: RawRecord) -> R:
    """The content of a small record.

    Raises:
        DamageError: the content does not fit its type.
    """
    try:
        parsed: R = kind.read(ReadDataStream(BytesIO(record.body)))  # type: ignore[attr-defined]
    except (McapError, struct.error, ValueError, MemoryError, OverflowError) as error:
        told = str(error) or "it ends too early"
        raise DamageError(record.at, f"its {kind.__name__} record: {told}") from error
    return parsed


def parse_attachment(record: RawRecord) -> records.Attachment:
    """The content of an attachment; raises as `parse`, and where its checksum is wrong."""
    if int.from_bytes(record.body[-4:], "little") not in (0, zlib.crc32(record.body[:-4])):
        raise DamageError(record.at, "the checksum of an attachment is wrong")
    return parse(records.Attachment, record)


def record_head(
    data: bytes, at: int, base: int = 0, room: int = MAX_RECORD_BYTES
) -> tuple[int, int]:
    """Opcode of the record at a place of `data`, 0 where its head is not whole yet, and its end.

    Args:
        base: where in the file `data` begins, for errors.
        room: bytes that the file has behind the head.

    Raises:
        DamageError: no record begins so, or it is longer than the file or than any of ours.
    """
    if at + RECORD_HEAD > len(data):
        return 0, at + RECORD_HEAD
    opcode, length = _RECORD_HEAD.unpack_from(data, at)
    if not 1 <= opcode <= 0x0F:
        raise DamageError(base + at, f"no record begins with opcode {opcode}")
    if length > room:
        raise DamageError(base + at, f"a record of {length} bytes goes beyond the file's end")
    if length > MAX_RECORD_BYTES:
        raise DamageError(base + at, f"a record of {length} bytes, limit {MAX_RECORD_BYTES}")
    return opcode, at + RECORD_HEAD + length


class Scan:
    """A file being walked; bounds what its chunks may expand to altogether."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file = file
        self._size = size
        self._budget = MAX_EXPANSION * size + _FREE_EXPANSION_BYTES
        self._decompressor = zstandard.ZstdDecompressor()

    def records(self) -> Iterator[RawRecord]:
        """Records in file order up to and including DataEnd, without the message indexes.

        Messages outside of chunks come as chunks without compression.

        Raises:
            BadInputError: not an MCAP file at all.
            DamageError: cut or overwritten; everything before was yielded.
        """
        data = self._file.read(_BLOCK_BYTES)
        if not data.startswith(MAGIC):
            why = f"not an MCAP file (begins with {data[:8]!r})" if data else "the file is empty"
            raise BadInputError(
                f"{getattr(self._file, 'name', 'file')}: {why}",
                hint="records are named run.mcap; a CSV goes to identify, or to compare --curve",
            )
        base, at, crc = 0, len(MAGIC), 0
        while True:
            opcode, end = record_head(data, at, base, self._size - base - at - RECORD_HEAD)
            if end > len(data):
                crc = zlib.crc32(memoryview(data)[:at], crc)
                data = data[at:] + self._file.read(max(_BLOCK_BYTES, end - len(data)))
                base, at, end = base + at, 0, end - at
                if end > len(data):
                    raise DamageError(base, "the file ends before its DataEnd record")
                if opcode == 0:
                    continue
            if opcode == Opcode.MESSAGE:
                yield (record := _as_chunk(data, at, base))
                end = at + len(record.body) - _LOOSE_HEAD
            elif opcode != Opcode.MESSAGE_INDEX:
                record = RawRecord(base + at, opcode, data[at + RECORD_HEAD : end])
                if opcode == Opcode.DATA_END:
                    stored = parse(records.DataEnd, record).data_section_crc
                    if stored not in (0, zlib.crc32(memoryview(data)[:at], crc)):
                        raise DamageError(record.at, "the data section's checksum is wrong")
                    yield record
                    return
                yield record
            at = end

    def chunk(self, record: RawRecord) -> Chunk:
        """Decompress and check one chunk.

        Raises:
            DamageError: malformed, wrong checksum, or larger than an honest chunk can be.
        """
        body = record.body
        if len(body) < _CHUNK_HEAD.size + 8:
            raise DamageError(record.at, "a chunk shorter than its own head")
        start_ns, end_ns, size, crc, name_length = _CHUNK_HEAD.unpack_from(body)
        data_at = _CHUNK_HEAD.size + name_length + 8
        if name_length > 32 or data_at > len(body):
            raise DamageError(record.at, "the name of the chunk's compression is too long")
        name = body[_CHUNK_HEAD.size : data_at - 8]
        (packed_size,) = struct.unpack_from("<Q", body, data_at - 8)
        if packed_size > len(body) - data_at:
            raise DamageError(record.at, "the chunk's data go beyond the chunk")
        self._budget -= size
        if size > MAX_RECORD_BYTES or self._budget < 0:
            raise DamageError(record.at, f"a chunk that expands to {size} bytes")
        packed = body[data_at : data_at + packed_size]
        raw = self._expand(record.at, name, packed, size)
        if len(raw) != size or (crc and zlib.crc32(raw) != crc):
            raise DamageError(record.at, "the chunk's checksum is wrong")
        return Chunk(start_ns, end_ns, name.decode(), packed_size, raw)

    def _expand(self, at: int, name: bytes, packed: bytes, size: int) -> bytes:
        if name == b"":
            return packed
        if name == b"lz4":
            try:
                expand = lz4.frame.LZ4FrameDecompressor().decompress
                return bytes(expand(packed, max_length=size + 1))
            except RuntimeError as error:
                raise DamageError(at, f"the chunk does not decompress: {error}") from error
        if name != b"zstd":
            raise DamageError(at, f"chunk compression {name!r}; read are zstd, lz4 and none")
        try:
            declared = zstandard.frame_content_size(packed)
            if declared not in (-1, size):
                raise DamageError(at, f"a chunk of {size} bytes holds a frame of {declared}")
            return self._decompressor.decompress(packed, max_output_size=max(size, 1))
        except zstandard.ZstdError as error:
            raise DamageError(at, f"the chunk does not decompress: {error}") from error


def _as_chunk(data: bytes, at: int, base: int) -> RawRecord:
    """The messages in a row from byte `at` of `data` on, as one chunk; raises as `record_head`."""
    end, first_ns, last_ns = at, 2**64 - 1, 0
    while end + LEAST_MESSAGE <= len(data) and data[end] == Opcode.MESSAGE:
        _, stop = record_head(data, end, base)
        if stop > len(data) or stop - end < LEAST_MESSAGE:
            break
        log_ns = int.from_bytes(data[end + LOG_TIME_AT : end + LOG_TIME_AT + 8], "little")
        first_ns, last_ns, end = min(first_ns, log_ns), max(last_ns, log_ns), stop
    if end == at:
        raise DamageError(base + at, "a message shorter than its own head")
    head = _CHUNK_HEAD.pack(first_ns, last_ns, end - at, 0, 0) + struct.pack("<Q", end - at)
    return RawRecord(base + at, Opcode.CHUNK, head + data[at:end])


def runs(at: int, raw: bytes) -> Iterator[Run]:
    """The records of a chunk in runs of equal length and channel.

    Args:
        at: where the chunk begins in the file, for errors.

    Raises:
        DamageError: the lengths do not add up.
    """
    position = 0
    while position < len(raw):
        if position + RECORD_HEAD > len(raw):
            raise DamageError(at, f"half a record at byte {position} of the chunk")
        opcode, length = _RECORD_HEAD.unpack_from(raw, position)
        stride = RECORD_HEAD + length
        if stride > len(raw) - position:
            raise DamageError(at, f"a record beyond the chunk's end at its byte {position}")
        channel, count = 0, 1
        if opcode == MESSAGE_OPCODE:
            if length < MESSAGE_HEAD:
                raise DamageError(at, f"a message of {length} bytes at byte {position} of a chunk")
            (channel,) = struct.unpack_from("<H", raw, position + RECORD_HEAD)
            count = _equal_heads(raw, position, stride)
        yield Run(opcode, channel, position, stride, count)
        position += stride * count


def _equal_heads(raw: bytes, position: int, stride: int) -> int:
    """How many records from `position` on have the first one's opcode, length and channel."""
    size = RECORD_HEAD + 2
    head = raw[position : position + size]
    most = (len(raw) - position) // stride
    if most < 2 or raw[position + stride : position + stride + size] != head:
        return 1
    shift = size - _WORD.itemsize
    pair = np.ndarray(2, _WORD, head, 0, (shift,))  # two overlapping words cover the 11 bytes
    known, window = 2, 64
    while known < most:
        n = min(window, most - known)
        heads = np.ndarray((n, 2), _WORD, raw, position + known * stride, (stride, shift))
        differ = heads != pair
        place = int(differ.argmax())
        if differ.item(place):
            return known + place // 2
        known += n
        window *= 4
    return most


def open_scan(path: Path) -> tuple[BinaryIO, Scan]:
    """Open a file for walking; the caller closes it.

    Raises:
        BadInputError: cannot be opened, or not a plain file.
    """
    if not path.is_file():
        raise BadInputError(f"{path}: no such file" if not path.exists() else f"{path}: not a file")
    try:
        file = path.open("rb")
        return file, Scan(file, path.stat().st_size)
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error


def count_messages(path: Path) -> dict[str, int]:
    """Messages per topic of a file that must be whole, every checksum checked.

    Raises:
        BadInputError: damaged, with the place.
    """
    counts: dict[int, int] = {}
    topics: dict[int, str] = {}
    file, scan = open_scan(path)
    with file:
        try:
            for record in scan.records():
                found = [record]
                if record.opcode == Opcode.CHUNK:
                    raw = scan.chunk(record).raw
                    for run in runs(record.at, raw):
                        if run.opcode == MESSAGE_OPCODE:
                            counts[run.channel] = counts.get(run.channel, 0) + run.number
                        else:
                            found.append(run.record(record.at, raw))
                for each in found:
                    if each.opcode == Opcode.CHANNEL:
                        channel = parse(records.Channel, each)
                        topics[channel.id] = channel.topic
        except DamageError as damage:
            raise BadInputError(f"{path}: {damage}") from damage
        file.seek(-len(MAGIC), os.SEEK_END)
        if file.read() != MAGIC:
            raise BadInputError(f"{path}: no footer")
    return {topics.get(c, f"channel {c}"): n for c, n in counts.items()}
