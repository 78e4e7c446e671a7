"""What the page reads of its folder: runs, their reports and curves, plans, and preflight."""

from __future__ import annotations

import math
import os
import re
from contextlib import suppress
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from stepload.data.catalog import PART, RECORD, RunRow, row_of, rows
from stepload.engine.replay import limits_from
from stepload.errors import BadInputError, SteploadError
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.feasibility.reason import findings
from stepload.plan.load import load_text
from stepload.plan.problems import MAX_PROBLEMS, PlanError, Problem
from stepload.plan.references import place_of
from stepload.plan.source import Folder, read_source
from stepload.record.recovery import is_being_written
from stepload.record.rows import FloatArray
from stepload.record.untrusted import untrusted
from stepload.report.conditions import from_attachments, measured
from stepload.report.figures import thin
from stepload.report.model import finite
from stepload.report.page import render
from stepload.report.preflight import figures, headline
from stepload.report.press_data import LOADING, UNLOADING, press_data
from stepload.report.rows import in_one_unit
from stepload.report.run_document import run_document
from stepload.report.run_record import evaluation_of, read_to_evaluate, record_in

MOST_POINTS = 1500
"""Points of one curve that are sent: means, or the smallest and largest of each part."""
MOST_ROWS = 1 << 15
MOST_PLANS = 300
MOST_DEEP = 3
MOST_REPORT_BYTES = 1 << 25
_PLAN = re.compile(r"^stepload:", re.MULTILINE)
_HIDDEN = re.compile(r"[._]|site-packages$|node_modules$")


def inside(root: Path, name: str) -> Path:
    """The path of a name in a folder, which is resolved.

    Raises:
        BadInputError: it is outside, or reached by a link.
    """
    try:
        path = root / name
        if path.is_relative_to(root) and path.resolve() == path:
            return path
    except (OSError, ValueError, RuntimeError):  # a null byte, a name that is too long
        pass
    raise BadInputError("this is no name of a file in the folder of the page")


def record_at(root: Path, key: str) -> Path:
    """The record of a run by its key: its directory, or its file, from the folder.

    Raises:
        BadInputError: there is none.
    """
    path = record_in(inside(root, key))
    if path.suffix not in (".mcap", ".part") or not _is_file(path):
        raise BadInputError(f"{key} is no record of a run")
    return path


def _is_file(path: Path) -> bool:
    return os.path.isfile(path) and not path.is_symlink()


def run_rows(root: Path) -> list[dict[str, Any]]:
    """The rows of the catalogue for the page, the newest first; records are read once."""
    return [_shown(root, row) for row in reversed(rows(root, _remembered))]


def _remembered(record: Path) -> RunRow:
    try:
        about = record.stat()
    except OSError:  # renamed meanwhile
        return row_of(record)
    return _row(record, (about.st_mtime_ns, about.st_size, about.st_ino))


@lru_cache(MOST_ROWS)
def _row(record: Path, _stamp: tuple[int, ...]) -> RunRow:
    return row_of(record)


def _shown(root: Path, row: RunRow) -> dict[str, Any]:
    record = Path(row.path)
    place = record.parent if record.name in (RECORD, PART) else record
    chord, interval = "", ""
    if not math.isnan(row.chord_n_per_m):
        chord, interval = in_one_unit((row.low_n_per_m, row.high_n_per_m), "N/m", row.chord_n_per_m)
    return {
        **row.model_dump(exclude={"path"}),
        "key": str(place.relative_to(root)),
        "chord": chord,
        "interval": interval,
        "live": goes_on(record),
    }


def goes_on(record: Path) -> bool:
    """Whether a run is writing this record."""
    try:
        return record.suffix == ".part" and is_being_written(record)
    except OSError:  # finished meanwhile
        return False


def report_of(root: Path, key: str) -> str:
    """The report of a run: the page beside its record, or one made from the record.

    Raises:
        SteploadError: there is no record, or it cannot be evaluated.
    """
    record = record_at(root, key)
    beside = record.with_name("report.html")
    if record.name == RECORD and _is_file(beside):
        with beside.open("rb") as file:
            page = file.read(MOST_REPORT_BYTES + 1)
        if len(page) <= MOST_REPORT_BYTES:
            return page.decode("utf-8", "replace")
    return render(run_document(evaluation_of(record)))


def curves_of(root: Path, key: str) -> dict[str, Any]:
    """Force against deformation and against time of a run, thinned.

    Raises:
        SteploadError: there is no record, or it ended before there was a contact.
    """
    record = record_at(root, key)
    with untrusted(record):
        recording = read_to_evaluate(record)
        limits = limits_from(recording.attachments)
        conditions = from_attachments(recording.attachments)
        ticks = recording.ticks
        at = thin(MOST_POINTS, np.nan_to_num(ticks.force_n))
        found: dict[str, Any] = {
            "elastic_limit_n": finite(limits.elastic_limit_n),
            "used_limit_n": finite(limits.used_limit_n),
            "time": {
                "time_s": numbers(ticks.time_s[at] - ticks.time_s[:1], 3),
                "force_n": numbers(ticks.force_n[at], 2),
                "limit_n": numbers(ticks.limit_n[at], 2),
            },
            "curve": {}, "problem": "",
        }  # fmt: skip
        try:
            data = press_data(recording, across=conditions.across)
        except BadInputError as error:
            return found | {"problem": error.message}
        pressed = np.isin(data.phase, [*LOADING, *UNLOADING])
        bent_m = measured(conditions, data).bend(data.force_n)
        deformation_um = np.where(pressed, (data.travel_m - bent_m) * 1e6, np.nan)
        starts = np.arange(0, len(pressed), max(1, -(-len(pressed) // MOST_POINTS)))
        found["curve"] = curve(deformation_um, data.force_n, starts)
        return found


def curve(deformation_um: FloatArray, force_n: FloatArray, starts: Any) -> dict[str, Any]:
    """Means of parts that begin at `starts`, for JSON; null where a deformation is NaN."""
    sizes = np.diff(starts, append=len(force_n))
    return {
        name: numbers(np.add.reduceat(values, starts) / sizes, digits)
        for name, values, digits in (
            ("deformation_um", deformation_um, 3), ("force_n", force_n, 2),
        )
    }  # fmt: skip


def numbers(values: FloatArray, digits: int) -> list[float | None]:
    """Rounded numbers for JSON; None where one is not finite."""
    return [round(each, digits) if math.isfinite(each) else None for each in values.tolist()]


def plan_names(root: Path) -> list[str]:
    """Files of the folder that look like plans, by name."""
    found = []
    for place, folders, files in os.walk(root):
        inner = Path(place).relative_to(root)
        folders[:] = [
            each for each in folders
            if len(inner.parts) < MOST_DEEP and not _HIDDEN.match(each)
            and not os.path.exists(root / inner / each / RECORD)
        ]  # fmt: skip
        for name in [str(inner / each) for each in files]:
            with suppress(SteploadError):
                if _PLAN.search(plan_text(root, name)):
                    found.append(name)
    return sorted(found)[:MOST_PLANS]


def plan_text(root: Path, name: str) -> str:
    """The text of a plan of the folder.

    Raises:
        SteploadError: it is not there, or no text.
    """
    path = inside(root, name)
    if path.suffix not in (".yaml", ".yml"):
        raise BadInputError(f"{name} is no plan", hint="a plan is a YAML file")
    return read_source(path, name).text


def check(root: Path, name: str, text: str) -> dict[str, Any]:
    """Verdict, findings and figures of a plan, or its problems, each with its place.

    Args:
        root: the folder of the page, resolved; no file outside it is read.
        name: of the plan in it; the files that it names are found from there.

    Raises:
        BadInputError: the name is outside the folder.
    """
    path = inside(root, name)
    problems: tuple[Problem, ...]
    try:
        return _told(preflight_of(load_text(text, path, root)), Folder(root, path, text))
    except PlanError as error:
        problems = error.problems
    except SteploadError as error:
        problems = (Problem("", 0, 0, "", error.message, error.hint),)
    here = str(path.relative_to(root))
    told = [{**asdict(each), "here": each.file == here} for each in problems[:MAX_PROBLEMS]]
    return {"problems": told, "count": len(problems)}


def _told(preflight: Preflight, shelf: Folder) -> dict[str, Any]:
    plan = preflight.plan
    weighty = findings(preflight.reasons)
    told = []
    for each in (*weighty, *(each for each in preflight.reasons if each not in weighty)):
        place = place_of(plan, each.key, shelf) if each.key else None
        here = place if place is not None and place.source.path == plan.path else None
        where = {"line": here.line if here else 0, "column": here.column if here else 0}
        told.append(asdict(each) | where)
    return {
        "problems": [],
        "verdict": preflight.verdict,
        "headline": " ".join(headline(preflight).split()).partition(" ")[2],
        "findings": told,
        "figures": list(figures(preflight)),
    }
