"""Repairs records that were never finished or got damaged: keeps all that is provably whole."""

from __future__ import annotations

import contextlib
import fcntl
import os
import stat
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap import records
from mcap.opcode import Opcode
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.record.container import INDEX_ENTRY, Appender, index_record, sync_directory
from stepload.record.layout import LOG_TIME_AT, MESSAGE_OPCODE
from stepload.record.scan import (
    Chunk,
    DamageError,
    RawRecord,
    Run,
    Scan,
    count_messages,
    open_scan,
    parse,
    parse_attachment,
    runs,
)

PART_SUFFIX = ".part"
_WORD = np.dtype("<u8")


@dataclass(frozen=True, slots=True)
class Recovered:
    """What a repair found.

    `counts` are messages per topic, read back from the repaired file; `cut_bytes` what had to be
    left out of the damaged one.
    """

    path: Path
    counts: dict[str, int]
    cut_bytes: int
    damage: str


def is_being_written(path: Path) -> bool:
    """Whether a living writer process has this file open; not said where we may not read it."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except PermissionError:
        pass
    return False


def find_unfinished(directory: Path) -> list[Path]:
    """Records in `directory` and one level below that nobody writes to any more, oldest first.

    Also those that cannot be opened; symbolic links are not followed.
    """
    found = []
    for pattern in ("*.mcap" + PART_SUFFIX, "*/*.mcap" + PART_SUFFIX):
        for path in directory.glob(pattern):
            linked = path.parent != directory and path.parent.is_symlink()
            with contextlib.suppress(FileNotFoundError, PermissionError):  # finished, or not ours
                about = path.lstat()
                if stat.S_ISREG(about.st_mode) and not linked and not is_being_written(path):
                    found.append((about.st_mtime, path))
    return [path for _, path in sorted(found)]


class _Repair:
    """Takes whole records one after the other into a new file with fresh indexes."""

    def __init__(self, out: Appender) -> None:
        self._out = out
        self._topics: dict[int, str] = {}
        self._schemas: set[int] = set()
        self.cut_bytes = 0
        self.damage = ""
        out.start()

    @property
    def counts(self) -> dict[str, int]:
        """Messages written so far, per topic."""
        return {topic: n for topic, n in self._out.topic_counts.items() if n}

    def take(self, record: RawRecord, read_chunk: Callable[[RawRecord], Chunk]) -> None:
        """Take one record; what is damaged inside is left out and noted."""
        try:
            if record.opcode == Opcode.CHUNK:
                self._take_chunk(record, read_chunk(record))
            elif record.opcode == Opcode.METADATA:
                metadata = parse(records.Metadata, record)
                self._out.add_metadata(metadata.name, metadata.metadata)
            elif record.opcode == Opcode.ATTACHMENT:
                a = parse_attachment(record)
                self._out.append_attachment(
                    record.encoded(), a.name, a.media_type, len(a.data), a.log_time, a.create_time
                )
            else:
                self._define(record)
        except DamageError as error:
            self.damage = self.damage or str(error)
            self.cut_bytes += record.end - record.at

    def _define(self, record: RawRecord) -> None:
        """Take a schema or channel that is not known yet."""
        if record.opcode == Opcode.SCHEMA:
            schema = parse(records.Schema, record)
            if schema.id not in self._schemas:
                self._schemas.add(schema.id)
                self._out.add_schema(schema)
        elif record.opcode == Opcode.CHANNEL:
            channel = parse(records.Channel, record)
            if channel.id not in self._topics:
                self._topics[channel.id] = channel.topic
                self._out.add_channel(channel)

    def _take_chunk(self, record: RawRecord, chunk: Chunk) -> None:
        entries: dict[int, list[NDArray[np.void]]] = {}
        for run in runs(record.at, chunk.raw):
            if run.opcode != MESSAGE_OPCODE:
                self._define(run.record(record.at, chunk.raw))
                continue
            if run.channel not in self._topics:
                raise DamageError(record.at, f"a message of unknown channel {run.channel}")
            entries.setdefault(run.channel, []).append(_index_entries(chunk.raw, run))
        if not entries:
            return
        indexes = {}
        for channel, parts in entries.items():
            index = parts[0] if len(parts) == 1 else np.concatenate(parts)
            times = index["log_ns"]
            if (times[1:] < times[:-1]).any():
                index = index[np.argsort(index["log_ns"], kind="stable")]
            indexes[channel] = (len(index), index_record(channel, index))
        entry = records.ChunkIndex(
            chunk_length=record.end - record.at,
            chunk_start_offset=0,
            compression=chunk.compression,
            compressed_size=chunk.compressed_size,
            message_end_time=chunk.end_ns,
            message_index_length=0,
            message_index_offsets={},
            message_start_time=chunk.start_ns,
            uncompressed_size=len(chunk.raw),
        )
        self._out.append_chunk(record.encoded(), entry, indexes)

    def finish(self, source: str, damage: str) -> None:
        """Note the repair in the file and close it."""
        self._out.add_metadata(
            "recovered",
            {
                "source": source,
                "damage": damage,
                "cut_bytes": str(self.cut_bytes),
                **{f"recovered {topic}": str(count) for topic, count in self.counts.items()},
            },
        )
        self._out.finish()


def _index_entries(raw: bytes, run: Run) -> NDArray[np.void]:
    """Message index entries of one run, offsets from the chunk's start."""
    index = np.empty(run.number, INDEX_ENTRY)
    index["log_ns"] = np.ndarray(run.number, _WORD, raw, run.at + LOG_TIME_AT, (run.stride,))
    index["offset"] = np.arange(run.at, run.end, run.stride)
    return index


def _default_out(path: Path) -> Path:
    if path.suffix == PART_SUFFIX:
        return path.with_suffix("")
    return path.with_name(f"{path.stem}.recovered{path.suffix or '.mcap'}")


def recover(path: Path, out: Path | None = None) -> Recovered:
    """Copy everything whole into a proper record, read it back and count.

    run.mcap.part becomes run.mcap and is removed once the copy is verified; any other file stays,
    and the copy is named *.recovered.mcap. A symbolic link is followed first.

    Raises:
        BadInputError: nothing to recover, still being written, or the target exists.
    """
    if path.is_symlink():
        path = path.resolve()
    target = out or _default_out(path)
    if target.exists():
        raise BadInputError(f"{target} exists already", hint="move it away or name another file")
    file, scan = open_scan(path)
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadInputError(
                f"{path} is being written by a running experiment", hint="wait for its end"
            ) from None
        found = copy_whole(file, scan, target, path.name)
    if path.suffix == PART_SUFFIX and out is None:
        path.unlink()
    sync_directory(target.parent)
    return found


def copy_whole(
    file: BinaryIO,
    scan: Scan,
    target: Path,
    source: str,
    rest: Callable[[Appender], None] | None = None,
) -> Recovered:
    """Copy everything whole of a file named `source` into a proper record, read it back and count.

    `rest` writes behind it what the file does not have; it may be unreadable then.

    Raises:
        BadInputError: it does not read back as it was written.
        OSError: it could not be written; nothing is left of it.
    """
    unverified = target.with_name(target.name + ".recovering")
    unverified.unlink(missing_ok=True)  # of a repair that was cut off, or anybody's
    fd = os.open(unverified, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
    try:
        repair = _Repair(out := Appender(fd))
        damage = ""
        try:
            for record in scan.records():
                repair.take(record, scan.chunk)
        except DamageError as error:
            damage = str(error)
            repair.cut_bytes += os.fstat(file.fileno()).st_size - error.at
        except (BadInputError, OSError) as error:
            if rest is None:
                raise
            damage = str(error)
        if rest is not None:
            rest(out)
        damage = repair.damage or damage
        repair.finish(source, damage)
    except BaseException:
        unverified.unlink()
        raise
    finally:
        os.close(fd)
    counts = count_messages(unverified)
    if counts != repair.counts:
        raise BadInputError(f"{unverified}: read back {counts}, written {repair.counts}")
    os.rename(unverified, target)
    return Recovered(target, counts, repair.cut_bytes, damage)
