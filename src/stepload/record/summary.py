"""Reads what a record is from its summary: a few reads, however long the record."""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap import records
from mcap.opcode import Opcode

from stepload.errors import BadInputError
from stepload.record.container import MAGIC
from stepload.record.layout import RECORD_HEAD
from stepload.record.reader import Reading, results_in
from stepload.record.scan import (
    DamageError,
    RawRecord,
    open_scan,
    parse,
    parse_attachment,
    record_head,
)

_Found = tuple[Mapping[str, Mapping[str, str]], Mapping[str, object] | None]
_FOOTER = struct.Struct("<BQQQI")
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
    """Read a record's summary; the whole of a record that has none, or is not finished.

    Raises:
        BadInputError: not a record of stepload.
    """
    try:
        with path.open("rb") as file:
            found = _finished(file)
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error
    except DamageError:
        found = None
    metadata, results = found or _walked(path)
    partial = "recovered" in metadata or results is None
    return Summary(path, metadata["run"], metadata.get("result", {}), results, partial)


def _finished(file: BinaryIO) -> _Found | None:
    """Metadata and results of a whole file; None where there is none, or not all is named in it."""
    size = file.seek(0, os.SEEK_END)
    tail = _FOOTER.size + len(MAGIC)
    if size < tail + len(MAGIC):
        return None
    file.seek(size - tail)
    opcode, length, start, _, _ = _FOOTER.unpack_from(end := file.read(tail))
    if end[-len(MAGIC) :] != MAGIC or opcode != Opcode.FOOTER or length != 20 or not start:
        return None
    if not start < size - tail or size - tail - start > MOST_BYTES:
        return None
    file.seek(start)
    data, at = file.read(size - tail - start), 0
    metadata: dict[str, Mapping[str, str]] = {}
    results = None
    while at < len(data):
        opcode, stop = record_head(data, at, start, len(data) - at - RECORD_HEAD)
        record = RawRecord(start + at, opcode, data[at + RECORD_HEAD : stop])
        at = stop
        if opcode == Opcode.METADATA_INDEX:
            index = parse(records.MetadataIndex, record)
            found = parse(records.Metadata, _at(file, index.offset, Opcode.METADATA))
            metadata[found.name] = found.metadata
        elif opcode == Opcode.ATTACHMENT_INDEX:
            named = parse(records.AttachmentIndex, record)
            if named.name == "results.json":
                attached = parse_attachment(_at(file, named.offset, Opcode.ATTACHMENT))
                results = results_in({attached.name: attached.data})
    whole = "run" in metadata and (results is not None or "recovered" in metadata)
    return (metadata, results) if whole else None


def _at(file: BinaryIO, at: int, opcode: int) -> RawRecord:
    """The record of a kind at a place of the file."""
    file.seek(at)
    found, end = record_head(file.read(RECORD_HEAD), 0, at, MOST_BYTES)
    body = file.read(end - RECORD_HEAD)
    if found != opcode or len(body) < end - RECORD_HEAD:
        raise DamageError(at, "the summary names a record that is not there")
    return RawRecord(at, opcode, body)


def _walked(path: Path) -> _Found:
    """The same from the whole of a file: it is unfinished, or its summary does not name them."""
    file, scan = open_scan(path)
    reading, results, damage = Reading(scan), None, ""
    with file:
        try:
            for record in scan.records():
                if record.opcode in (Opcode.METADATA, Opcode.ATTACHMENT):
                    reading.take(record)
            results = results_in(reading.attachments)
        except DamageError as error:
            damage = f" ({error})"
    if "run" not in reading.metadata:
        raise BadInputError(f"{path}: no record of a run{damage}")
    return reading.metadata, results
