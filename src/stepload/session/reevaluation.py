"""Results and report of an existing record, written as a run writes its own."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import stepload
from stepload.engine.replay import limits_from
from stepload.errors import BadInputError
from stepload.record.plain import plain
from stepload.report.analyse import Evaluation
from stepload.report.certificate import other_elastic_limit
from stepload.report.conditions import Stated
from stepload.report.model import Document
from stepload.report.provenance import with_record
from stepload.report.run_document import run_document
from stepload.report.run_record import evaluation_of, record_in
from stepload.report.run_results import run_data
from stepload.session import files


def results_again(record: Path, stated: Stated | None = None) -> tuple[dict[str, Any], Document]:
    """The contents of results.json and report.html of a record; raises as `evaluation_of`."""
    run = evaluation_of(record, stated)
    data, document = plain(run_data(run)), with_record(run_document(run), record_in(record))
    others = _other_limits(run), _other_elastic_limit(run), _other_payload(run, stated)
    if told := [each for each in others if each]:
        data = data | {"reasons": [*told, *data["reasons"]]}
        document = replace(document, reasons=(*told, *document.reasons))
    return data, document


def _other_limits(run: Evaluation) -> str:
    """A note that this version derives another force limit than the run had; "" if it does not.

    Preflight and limits of an evaluation are always those of the version that makes it.
    """
    had_n = limits_from(run.recording.attachments).force_limit_n
    now_n = run.preflight.force_limit_n
    if math.isclose(had_n, now_n, rel_tol=1e-6):
        return ""
    return (
        f"the run's force limit was {had_n:.4g} N; stepload {stepload.__version__} derives"
        f" {now_n:.4g} N from its plan: preflight and limits shown here are not those of that day"
    )


def _other_elastic_limit(run: Evaluation) -> str:
    """A note that the result was judged by another F_c than the plan's; "" where it was not."""
    used_n = other_elastic_limit(run.preflight, run.identification)
    if used_n is None:
        return ""
    return (
        f"the result was judged by F_c = {used_n:.4g} N; by its plan the run had"
        f" {run.preflight.theory.elastic_limit_n:.4g} N"
    )


def _other_payload(run: Evaluation, stated: Stated | None) -> str:
    """A note that another payload was stated than the plan's; "" where none was."""
    law = run.preflight.theory.law
    if stated is None or stated.theory_k is None or stated.theory_n is None:
        return ""
    if math.isclose(stated.theory_k, law.k, rel_tol=1e-6) and stated.theory_n == law.n:
        return ""
    return (
        f"the result was judged by another payload than the plan's, with K = {stated.theory_k:.4g}"
        f" N/m^n and n = {stated.theory_n:.4g}; geometry and material shown here are the plan's"
    )


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
