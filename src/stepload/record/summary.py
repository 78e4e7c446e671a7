"""Reads what a record is from its summary alone: a few reads, however long the record."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap import records
from mcap.opcode import Opcode

from stepload.errors import BadInputError
from stepload.record.container import MAGIC
from stepload.record.layout import RECORD_HEAD
from stepload.record.reader import results_in
from stepload.record.scan import DamageError, RawRecord, open_scan, parse, parse_attachment

_FOOTER = struct.Struct("<BQQQI")
_HEAD = struct.Struct("<BQ")
_WANTED = (Opcode.METADATA_INDEX, Opcode.ATTACHMENT_INDEX)
MOST_BYTES = 1 << 26
"""Largest size in bytes of a summary, or of one record that it names."""


@dataclass(frozen=True, slots=True)
class Summary:
    """What a run began with, how it ended and what came of it.

    `outcome` and `results` are empty and None where the record was never finished: `partial`.
    """

    path: Path
    metadata: Mapping[str, str]
    outcome: Mapping[str, str]
    results: Mapping[str, object] | None
    partial: bool


def read_summary(path: Path) -> Summary:
    """Read a record's summary, or of an unfinished one what it began with.

    Raises:
        BadInputError: not a record of stepload.
    """
    try:
        with path.open("rb") as file:
            found = _finished(file, path)
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error
    except DamageError:
        found = None
    return found or _begun(path)


def _finished(file: BinaryIO, path: Path) -> Summary | None:
    """The summary of a whole file; None where there is none."""
    size = file.seek(0, os.SEEK_END)
    tail = _FOOTER.size + len(MAGIC)
    if size < tail + len(MAGIC):
        return None
    file.seek(size - tail)
    opcode, length, start, offsets, _ = _FOOTER.unpack_from(end := file.read(tail))
    if end[-len(MAGIC) :] != MAGIC or opcode != Opcode.FOOTER or length != 20 or not start:
        return None
    if not start < size - tail or size - tail - start > MOST_BYTES:
        return None
    metadata: dict[str, Mapping[str, str]] = {}
    results = None
    for record in _indexes(file, start, offsets, size - tail):
        if record.opcode == Opcode.METADATA_INDEX:
            index = parse(records.MetadataIndex, record)
            found = parse(records.Metadata, _at(file, index.offset, Opcode.METADATA))
            metadata[found.name] = found.metadata
        elif record.opcode == Opcode.ATTACHMENT_INDEX:
            named = parse(records.AttachmentIndex, record)
            if named.name == "results.json":
                attached = parse_attachment(_at(file, named.offset, Opcode.ATTACHMENT))
                results = results_in({attached.name: attached.data})
    if "run" not in metadata:
        raise BadInputError(f"{path}: no record of a run")
    partial = "recovered" in metadata or results is None
    return Summary(path, metadata["run"], metadata.get("result", {}), results, partial)


def _indexes(file: BinaryIO, start: int, offsets: int, end: int) -> Iterator[RawRecord]:
    """The summary's indexes of metadata and attachments; all of it where nothing says where.

    The index of chunks, which grows with the record, is passed over.
    """
    if not start < offsets < end:
        file.seek(start)
        yield from _records(file.read(end - start), start)
        return
    file.seek(offsets)
    for record in _records(file.read(end - offsets), offsets):
        group = parse(records.SummaryOffset, record)
        if group.group_opcode in _WANTED:
            if not start <= group.group_start <= offsets - group.group_length:
                raise DamageError(record.at, "the summary names a group that is not there")
            file.seek(group.group_start)
            yield from _records(file.read(group.group_length), group.group_start)


def _records(data: bytes, base: int) -> Iterator[RawRecord]:
    at = 0
    while at + RECORD_HEAD <= len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        end = at + RECORD_HEAD + length
        if end > len(data):
            raise DamageError(base + at, "a record goes beyond the summary")
        yield RawRecord(base + at, opcode, data[at + RECORD_HEAD : end])
        at = end


def _at(file: BinaryIO, at: int, opcode: int) -> RawRecord:
    """The record of a kind at a place of the file."""
    file.seek(at)
    head = file.read(RECORD_HEAD)
    if len(head) < RECORD_HEAD or head[0] != opcode:
        raise DamageError(at, "the summary names a record that is not there")
    (length,) = struct.unpack_from("<Q", head, 1)
    if length > MOST_BYTES or len(body := file.read(length)) < length:
        raise DamageError(at, "a record that the summary names goes beyond the file")
    return RawRecord(at, opcode, body)


def _begun(path: Path) -> Summary:
    """What an unfinished record began with."""
    file, scan = open_scan(path)
    with file:
        try:
            for record in scan.records():
                if record.opcode == Opcode.METADATA:
                    found = parse(records.Metadata, record)
                    if found.name == "run":
                        return Summary(path, found.metadata, {}, None, True)
        except DamageError as error:
            raise BadInputError(f"{path}: no record of a run ({error})") from error
    raise BadInputError(f"{path}: no record of a run")
