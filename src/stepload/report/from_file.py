"""Identification from a file: a record of ours, or a curve from elsewhere."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from stepload.contact.curve_factors import TipFactors
from stepload.errors import BadInputError
from stepload.identification.curve_channels import quantum
from stepload.identification.identify import Identification, identify
from stepload.identification.run_in import RunIn
from stepload.identification.system_stiffness import SystemStiffnessFit, fit_system_stiffness
from stepload.record.curve_mapping import CurveMapping
from stepload.record.curves import Curve, Reading, read_curve
from stepload.record.untrusted import untrusted
from stepload.report.analyse import (
    cycles_of_run,
    identify_payload,
    identify_system,
    touched_before,
)
from stepload.report.conditions import Stated
from stepload.report.curve import deformation_curve, prepare
from stepload.report.curve_zero import zero
from stepload.report.model import finite
from stepload.report.reasons import loaded
from stepload.report.run_record import SavedRun, saved_run
from stepload.report.tip_factors import with_factors


def is_record(path: Path) -> bool:
    """Whether a path is a record of stepload, judged by its name."""
    return path.is_dir() or path.suffix.lower() in (".mcap", ".part")


class FromFile(NamedTuple):
    """Result of a file: the identification, the assumptions, and of a record its cycles, whether a
    simulated rig made it, and the largest force of the whole run, None where it is not stored; of a
    curve how it was read."""

    found: Identification
    notes: tuple[str, ...]
    run_in: RunIn | None = None
    simulated: bool = False
    peak_force_n: float | None = None
    reading: Reading | None = None


def identify_file(path: Path, stated: Stated) -> tuple[Identification, tuple[str, ...]]:
    """Identify a payload from a record (.mcap) or a CSV curve; also returns the assumptions.

    Raises:
        BadInputError: the file is invalid, or has nothing to identify.
    """
    return results_of_file(path, stated)[:2]


def results_of_file(
    path: Path,
    stated: Stated,
    factors: TipFactors | None = None,
    mapping: CurveMapping | None = None,
) -> FromFile:
    """The same with the cycles of a record; `factors` are those of a curve of deformation,
    `mapping` says how to read it.

    Raises:
        BadInputError: the file is invalid, or has nothing to identify.
    """
    with untrusted(path):
        if not is_record(path):
            curve = read_curve(path, mapping)
            reading = curve.reading
            if factors is not None:
                curve = with_factors(deformation_curve(curve), factors)
            return FromFile(*identify_curve(curve, stated), reading=reading)
        if factors is not None:
            raise BadInputError(
                f"{path}: a factor on the record of a run",
                hint="--rough and --plastic are for a curve: displacement_m, force_n",
            )
        run = saved_run(path)
        found, notes = _identify_record(run, stated)
        try:
            before = touched_before(run.metadata)
            run_in = cycles_of_run(run.data, found, run.events, touched_before=before)
        except BadInputError as error:
            run_in, notes = None, (*notes, error.message)
        return FromFile(found, notes, run_in, run.simulated, finite(run.peak_force_n))


def _identify_record(run: SavedRun, stated: Stated) -> tuple[Identification, tuple[str, ...]]:
    notes = ("the record is partial",) if run.partial else ()
    if (stood := run.stood) is not None and stood.joints_rad:
        joints = ", ".join(f"{math.degrees(each):.1f}°" for each in stood.joints_rad)
        notes = (
            *notes,
            f"the arm stood at the joints {joints} ({run.conditions.pose or 'no name'})",
        )
    found = identify_payload(run.data, stated.applied(run.conditions))
    until = loaded(run.events, found)
    return found, (*notes, until.text) if until is not None else notes


def system_results_of_file(
    path: Path, mapping: CurveMapping | None = None
) -> tuple[SystemStiffnessFit, bool, Reading | None]:
    """System stiffness from a record or a curve with positions; whether it was simulated, and how
    a curve was read.

    Raises:
        BadInputError: the file is invalid, or has nothing to identify.
    """
    with untrusted(path):
        if is_record(path):
            run = saved_run(path)
            return identify_system(run.data, run.conditions), run.simulated, None
        curve = read_curve(path, mapping)
        if curve.position_m is None or curve.time_s is None:
            raise BadInputError(
                f"{path}: system stiffness needs the columns time_s, position_m, force_n"
            )
        pressed = zero(curve, keep_zero=False)  # signs and tare corrected, from its touch
        assert pressed.time_s is not None
        fit = fit_system_stiffness(
            pressed.time_s, pressed.travel_m, pressed.force_n,
            resolution_m=quantum(pressed.travel_m),
        )  # fmt: skip
        return fit, False, curve.reading


def identify_curve(curve: Curve, stated: Stated) -> tuple[Identification, tuple[str, ...]]:
    """Identify a payload from a curve from elsewhere; also returns the assumptions.

    Raises:
        BadInputError: there is nothing in it to identify.
    """
    prepared = prepare(curve, stated)
    return identify(prepared.selected, prepared.run), prepared.notes
