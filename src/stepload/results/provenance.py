"""Provenance of a result: versions of the software, and checksums of the files that decided it."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import scipy

import stepload
from stepload.errors import BadInputError
from stepload.record.summary import read_summary
from stepload.results.model import NOTHING, Document, Table
from stepload.results.run_record import SavedRun

SCHEMA = "stepload-results/1"
"""Name of the schema of results.json. Within a version keys are added, never removed or changed."""

_TEXTS = (
    "run_id", "started", "plan", "payload", "rig", "specimen", "batch", "operator", "notes",
    "calibration", "arm", "stepload",
)  # fmt: skip
_DEVICES = {
    "force": "force_sensor",
    "second_force": "second_force_sensor",
    "displacement": "displacement_sensor",
}
"""Keys of the results, by the record's names of the devices."""


def schema_text() -> str:
    """The JSON Schema of results.json."""
    return (resources.files("stepload.results") / "results.schema.json").read_text()


def about(metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> dict[str, Any]:
    """The head of the results of a run.

    Args:
        metadata: of the record.
        attachments: files of the record; those of the plan are named with their SHA-256.
    """
    tags = [tag for tag in metadata.get("tags", "").split("\n") if tag]
    sums = {
        name: hashlib.sha256(data).hexdigest()
        for name, data in attachments.items()
        if name.startswith("plan")
    }
    devices = {name: metadata.get(role, "") for name, role in _DEVICES.items()}
    texts = {name: metadata.get(name, "") for name in _TEXTS}
    return {
        "schema": SCHEMA,
        "run": texts | devices | {"tags": tags, "files": sums},
        "versions": _versions(),
    }


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
    """The runs that a result was made from; `sealed_runs` adds the checksums of their records."""
    rows = [
        (
            run.name, *(run.metadata.get(key) or NOTHING for key in ("specimen", "batch")),
            run.metadata.get("run_id") or NOTHING, run.metadata.get("started") or NOTHING,
            run.metadata.get("operator") or NOTHING,
            f"stepload {run.metadata.get('stepload') or 'unknown'}",
        )
        for run in runs
    ]  # fmt: skip
    columns = ("run", "specimen", "batch", "id", "started", "operator", "recorded by")
    here = f"Evaluated by {_evaluated_by()}."
    return Table("Runs", columns, rows, (here,), page_only=True)


def sealed_runs(document: Document, runs: Sequence[SavedRun]) -> Document:
    """The document with the checksums of the records it was made from."""
    rows = [(run.name, run.path.name, sum_or_why(run.path)) for run in runs]
    sums = Table("Records", ("run", "file", "SHA-256"), rows, page_only=True)
    return replace(document, tables=[*document.tables, sums])


def _versions() -> dict[str, str]:
    return {
        "stepload": stepload.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }


def _evaluated_by() -> str:
    return ", ".join(f"{name} {version}" for name, version in _versions().items())


def sum_or_why(path: Path) -> str:
    """SHA-256 of a file in hexadecimal, or the reason why there is none: a report is written in
    any case."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        return f"not known: {error.strerror or error}"


def sealed(document: Document, record: Path) -> Document:
    """The document with the checksum of the record it was made from, which must be finished."""
    told = sum_or_why(record)
    row = (f"{record.name}, SHA-256", told)
    tables = [
        replace(each, rows=[*each.rows, row]) if each.title == TITLE else each
        for each in document.tables
    ]
    sheet = document.certificate
    if sheet is not None:
        sheet = replace(sheet, seal=f"{record.name} SHA-256 {told}")
    return replace(document, tables=tables, certificate=sheet)


def with_record(document: Document, record: Path) -> Document:
    """The document of a run with the state of its record: its checksum, its content, and whether it
    was finished. To be called when the record has got its name."""
    document = sealed(document, record)
    try:
        summary = read_summary(record)
    except BadInputError as error:
        return _remarked(document, f"the record cannot be read: {error.message}")
    rows = [
        (stream.replace("_", " "), recorded, summary.outcome.get(f"dropped_{stream}", NOTHING))
        for stream in STREAMS
        if (recorded := summary.outcome.get(f"recorded_{stream}"))
    ]
    table = Table("Messages of the record", ("stream", "recorded", "dropped"), rows, page_only=True)
    document = replace(document, tables=[*document.tables, table])
    return _remarked(document, UNFINISHED) if summary.partial else document


def _remarked(document: Document, remark: str) -> Document:
    """The document with one remark more, before all others."""
    sheet = document.certificate
    if sheet is not None:
        sheet = replace(sheet, remarks=[remark, *sheet.remarks])
    return replace(document, reasons=[remark, *document.reasons], certificate=sheet)
