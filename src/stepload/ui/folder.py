"""What the page reads of one folder: its runs, their reports and curves, and its plans."""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from stepload.data.catalog import PART, RECORD, RunRow, row_of, rows
from stepload.engine.replay import limits_from
from stepload.errors import BadInputError
from stepload.plan.source import MAX_BYTES, read_source
from stepload.record.recovery import is_being_written
from stepload.record.rows import FloatArray
from stepload.record.untrusted import untrusted
from stepload.report.conditions import from_attachments, measured
from stepload.report.model import finite
from stepload.report.page import render
from stepload.report.press_data import LOADING, UNLOADING, press_data
from stepload.report.rows import in_one_unit
from stepload.report.run_document import run_document
from stepload.report.run_record import evaluation_of, read_to_evaluate, record_in

MOST_POINTS = 1500
"""Points of one curve that are sent: means of more, or the smallest and largest of each part."""
MOST_PLANS = 300
MOST_DEEP = 3
MOST_REPORT_BYTES = 1 << 25
_PLAN = re.compile(r"^stepload:", re.MULTILINE)
_HIDDEN = re.compile(r"[._]|site-packages$|node_modules$")

_known: dict[Path, tuple[tuple[int, ...], RunRow]] = {}
"""Rows of the catalogue, each with the time and size of its record."""


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
    if path.suffix not in (".mcap", ".part") or not stat.S_ISREG(_mode(path)):
        raise BadInputError(f"{key} is no record of a run")
    return path


def _mode(path: Path) -> int:
    try:
        return path.lstat().st_mode
    except OSError:
        return 0


def run_rows(root: Path) -> list[dict[str, Any]]:
    """The rows of the catalogue for the page, the newest first; records are read once."""
    found = rows(root, _remembered)
    paths = {Path(row.path) for row in found}
    for path in [each for each in _known if each not in paths]:
        del _known[path]
    return [_shown(root, row) for row in reversed(found)]


def _remembered(record: Path) -> RunRow:
    try:
        about = record.stat()
    except OSError:  # renamed meanwhile
        return row_of(record)
    stamp = about.st_mtime_ns, about.st_size, about.st_ino
    kept = _known.get(record)
    if kept is None or kept[0] != stamp:
        kept = _known[record] = stamp, row_of(record)
    return kept[1]


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
        "live": record.suffix == ".part" and _goes_on(record),
    }


def _goes_on(record: Path) -> bool:
    try:
        return is_being_written(record)
    except OSError:  # finished meanwhile
        return False


def report_of(root: Path, key: str) -> str:
    """The report of a run: the page beside its record, or one made from the record.

    Raises:
        SteploadError: there is no record, or it cannot be evaluated.
    """
    record = record_at(root, key)
    beside = record.with_name("report.html")
    if record.name == RECORD and stat.S_ISREG(_mode(beside)):
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
        found: dict[str, Any] = {
            "elastic_limit_n": finite(limits.elastic_limit_n),
            "used_limit_n": finite(limits.used_limit_n),
            "time": {}, "curve": {}, "problem": "",
        }  # fmt: skip
        if len(ticks.time_s):
            at = thinned(ticks.force_n)
            found["time"] = {
                "time_s": numbers(ticks.time_s[at] - ticks.time_s[0], 3),
                "force_n": numbers(ticks.force_n[at], 2),
                "limit_n": numbers(ticks.limit_n[at], 2),
            }
        try:
            data = press_data(recording, across=conditions.across)
        except BadInputError as error:
            return found | {"problem": error.message}
        pressed = np.isin(data.phase, [*LOADING, *UNLOADING])
        bent_m = measured(conditions, data).bend(data.force_n)
        curve = np.stack([(data.travel_m - bent_m) * 1e6, data.force_n])
        deformation_um, force_n = means(np.where(pressed, curve, np.nan))
        found["curve"] = {
            "deformation_um": numbers(deformation_um, 3),
            "force_n": numbers(force_n, 2),
        }
        return found


def means(columns: FloatArray, most: int = MOST_POINTS) -> FloatArray:
    """Means of at most so many parts of columns of equal length; NaN between what is apart."""
    size = columns.shape[1]
    starts = np.arange(0, size, max(1, -(-size // most)))
    found = np.add.reduceat(columns, starts, axis=1) / np.diff(starts, append=size)
    nothing = np.isnan(found).any(axis=0)
    return np.asarray(found[:, ~nothing | ~np.roll(nothing, 1)])


def thinned(values: FloatArray, most: int = MOST_POINTS) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Indices of at most about `most` values: the smallest and largest of each part, in order."""
    if values.size <= most:
        return np.arange(values.size)
    edges = np.linspace(0, values.size, most // 2 + 1).astype(int)
    known = np.nan_to_num(values)
    picked = {int(values.size - 1), 0}
    for low, high in pairwise(edges):
        part = known[low:high]
        picked |= {int(low + part.argmin()), int(low + part.argmax())}
    return np.array(sorted(picked))


def numbers(values: FloatArray, digits: int) -> list[float | None]:
    """Rounded numbers for JSON; None where one is not finite."""
    return [round(each, digits) if math.isfinite(each) else None for each in values.tolist()]


def plan_names(root: Path) -> list[str]:
    """Files of the folder that look like plans, by name."""
    return sorted(_plans(root, root, MOST_DEEP))[:MOST_PLANS]


def _plans(root: Path, folder: Path, deep: int) -> Iterator[str]:
    try:
        entries = [each for each in os.scandir(folder) if not each.is_symlink()]
    except OSError:
        return
    for entry in entries:
        path = Path(entry.path)
        if entry.is_dir():
            if deep and not _HIDDEN.match(entry.name) and not (path / RECORD).exists():
                yield from _plans(root, path, deep - 1)
        elif (
            path.suffix in (".yaml", ".yml")
            and entry.is_file()
            and entry.stat().st_size <= MAX_BYTES
            and _PLAN.search(path.read_text("utf-8", "replace"))
        ):
            yield str(path.relative_to(root))


def plan_text(root: Path, name: str) -> str:
    """The text of a plan of the folder.

    Raises:
        BadInputError: it is not there, or no text.
    """
    path = inside(root, name)
    if path.suffix not in (".yaml", ".yml"):
        raise BadInputError(f"{name} is no plan", hint="a plan is a YAML file")
    return read_source(path, name).text
