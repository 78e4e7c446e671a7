"""Provenance of a result: versions of the software, and checksums of the files that decided it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from stepload.errors import BadInputError
from stepload.record.summary import read_summary
from stepload.report.model import NOTHING, Document, Table
from stepload.report.run_record import SavedRun
from stepload.report.run_results import versions

TITLE = "Provenance"
STREAMS = ("force", "second_force", "arm", "displacement", "tick", "events")
UNFINISHED = "the record was never finished: what came after its end is not in this result"
_SUM = "sha256 "


def provenance_table(metadata: Mapping[str, str]) -> Table:
    """The software that evaluated a run, and the metadata of its record: who, when, with what, and
    the checksums of its files (`sha256 NAME`)."""
    rows = [
        (f"{key[len(_SUM) :]}, SHA-256" if key.startswith(_SUM) else key.replace("_", " "), value)
        for key, value in sorted(metadata.items())
        if value and not key.startswith("clock_offset")
    ]
    return Table(
        TITLE, ("what", "which"), [("evaluated by", _evaluated_by()), *rows], page_only=True
    )


def runs_table(runs: Sequence[SavedRun]) -> Table:
    """The runs that a result was made from, with the checksums of their records."""
    keys = ("specimen", "batch", "run_id", "started", "operator", "stepload")
    rows = [
        (run.name, *(run.metadata.get(key) or NOTHING for key in keys), sum_or_why(run.path))
        for run in runs
    ]
    columns = ("run", "specimen", "batch", "id", "started", "operator", "stepload", "SHA-256")
    here = f"Evaluated by {_evaluated_by()}."
    return Table("Runs", columns, rows, (here,), page_only=True)


def _evaluated_by() -> str:
    return ", ".join(f"{name} {version}" for name, version in versions().items())


def sum_or_why(path: Path) -> str:
    """SHA-256 of a file in hexadecimal, or the reason why there is none: a report is written in
    any case."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        return f"not known: {error.strerror or error}"


def sealed(document: Document, record: Path, rows: Sequence[tuple[str, str]] = ()) -> Document:
    """The document with the checksum of the record it was made from, which must be finished.

    `rows` are further ones of the table of its provenance.
    """
    told = sum_or_why(record)
    rows = [(f"{record.name}, SHA-256", told), *rows]
    tables = [
        replace(each, rows=[*each.rows, *rows]) if each.title == TITLE else each
        for each in document.tables
    ]
    sheet = document.certificate
    if sheet is not None:
        sheet = replace(sheet, seal=f"{record.name} SHA-256 {told}")
    return replace(document, tables=tables, certificate=sheet)


def with_record(document: Document, record: Path) -> Document:
    """The document of a run with the state of its record: its checksum, its content, and whether it
    was finished. To be called when the record has got its name."""
    try:
        summary = read_summary(record)
    except BadInputError as error:
        told = f"the record cannot be read: {error.message}"
        return _remarked(sealed(document, record), told)
    rows = [
        (
            f"messages, {stream.replace('_', ' ')}",
            f"{recorded} recorded, {summary.outcome.get(f'dropped_{stream}', NOTHING)} dropped",
        )
        for stream in STREAMS
        if (recorded := summary.outcome.get(f"recorded_{stream}"))
    ]
    document = sealed(document, record, rows)
    return _remarked(document, UNFINISHED) if summary.partial else document


def _remarked(document: Document, remark: str) -> Document:
    """The document with one remark more, before all others."""
    sheet = document.certificate
    if sheet is not None:
        sheet = replace(sheet, remarks=[remark, *sheet.remarks])
    return replace(document, reasons=[remark, *document.reasons], certificate=sheet)
