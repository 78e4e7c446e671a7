"""Results and report of a record that is there already, written as a run writes its own."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

from stepload.errors import BadInputError
from stepload.record.plain import plain
from stepload.results.data import run_data
from stepload.results.model import Document
from stepload.results.provenance import with_record
from stepload.results.run_document import run_document
from stepload.results.saved import record_in
from stepload.results.stored import evaluation_of
from stepload.results.wishes import Wishes
from stepload.session import files


class Again(NamedTuple):
    """What results.json and report.html of a record say."""

    data: dict[str, Any]
    document: Document


def results_again(record: Path, wishes: Wishes | None = None) -> Again:
    """Evaluate a record; raises as `evaluation_of`."""
    run = evaluation_of(record, wishes)
    document = with_record(run_document(run), record_in(record))
    return Again(plain(run_data(run)), document)


def write_new(directory: Path, data: dict[str, Any], document: Document) -> Path:
    """Write results.json and report.html into a directory that has neither; the report.

    Raises:
        BadInputError: one of them is there, or they cannot be written.
    """
    for name in (files.RESULTS, files.REPORT):
        if os.path.lexists(directory / name):
            raise BadInputError(
                f"{directory / name} exists already: nothing was written",
                hint="name another directory",
            )
    try:
        directory.mkdir(parents=True, exist_ok=True)
        files.write_results(directory, data, document)
    except OSError as error:
        raise BadInputError(f"cannot write to {directory}: {error.strerror}") from error
    return directory / files.REPORT
