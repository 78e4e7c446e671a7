"""What the commands do, as functions: nothing is printed, errors are exceptions."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.data.run import Run, open_run
from stepload.engine.operator import Operator
from stepload.errors import BadInputError
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.identification.identify import Identification
from stepload.plan.load import in_world, load_plan
from stepload.plan.model import Plan
from stepload.plan.tags import tagged
from stepload.record.curves import MIN_ROWS, Curve
from stepload.report.conditions import Stated
from stepload.report.from_file import identify_curve
from stepload.session.experiment import run_plan


@dataclass(frozen=True, slots=True)
class Identified:
    """Result for a curve: the identification, and what had to be assumed about the numbers."""

    found: Identification
    notes: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """That of the headline: "identified", "marginal" or "not identifiable"."""
        return str(self.found.verdict)

    @property
    def reasons(self) -> Sequence[str]:
        """The reasons of the verdict."""
        return self.found.reasons


def preflight(plan: Plan | str | Path) -> Preflight:
    """Compute before a run what a plan allows: limits, schedule, verdict and its reasons.

    A plan that is refused is a result, not an error: see `Preflight.verdict`.

    Raises:
        PlanError: the plan cannot be read.
    """
    return preflight_of(_plan(plan))


def run(
    plan: Plan | str | Path,
    *,
    dry_run: bool,
    out: str | Path | None = None,
    seed: int | None = None,
    tags: Sequence[str] = (),
    world: str = "",
) -> Run:
    """Run a plan as `stepload run` does, and open its record.

    A run that a rule has stopped is a result, not an error: `Run.results` says why it ended. In the
    main thread Ctrl+C stops the arm first, as on the command line.

    Args:
        dry_run: on the simulated rig in virtual time; False moves the arm.
        out: the run's directory; below the plan's own `record.directory` when None.
        seed: of the simulated rig.
        tags: words to find the run by; "specimen=S7", "batch=…" and "operator=…" set those.
        world: simulator of a dry run in place of the plan's.

    Raises:
        PlanError: the plan cannot be read.
        RefusedError: it may not run; nothing was opened or written.
        BadInputError: the directory cannot be used.
        DeviceError: a device did not open; nothing moved.
        RecordingFailedError: the record could not be kept; the arm was made safe first.
    """
    operator, loaded = Operator(), tagged(_plan(plan), tags)
    loaded = in_world(loaded, world) if world else loaded
    main = threading.current_thread() is threading.main_thread()
    with operator.listening() if main else nullcontext():
        finished = run_plan(
            preflight_of(loaded),
            dry_run=dry_run,
            out=None if out is None else Path(out),
            seed=seed,
            operator=operator,
        )
    return open_run(finished.directory)


def identify(
    force_n: ArrayLike,
    deformation_m: ArrayLike | None = None,
    *,
    position_m: ArrayLike | None = None,
    time_s: ArrayLike | None = None,
    **known: Any,
) -> Identified:
    """Identify F = K δⁿ from arrays, as `stepload identify` does from a file.

    Args:
        force_n: contact force, positive when pressing, shape (N,).
        deformation_m: of the payload alone, shape (N,); or give `position_m`.
        position_m: travel of the machine, shape (N,), from which the deflection F/K_s is
            subtracted: state `system_stiffness_n_per_m`.
        time_s: times that do not fall, shape (N,).
        known: what else is known, by the names of `stepload.report.conditions.Stated`:
            `system_stiffness_n_per_m`, `elastic_limit_n`, `force_noise_n`, `position_noise_m`,
            `secant_force_n` and others.

    Raises:
        BadInputError: columns of different lengths, numbers that are not finite or are masked, an
            unknown name, an impossible value, or nothing to identify.
    """
    if (deformation_m is None) == (position_m is None):
        raise BadInputError("give one of deformation_m and position_m")
    try:
        stated = Stated(**known)
    except TypeError as error:
        raise BadInputError(
            f"identify: {str(error).rpartition(') ')[2]}",
            hint=f"known may be {', '.join(Stated.__dataclass_fields__)}",
        ) from None
    columns = {
        "force_n": force_n,
        "deformation_m": deformation_m,
        "position_m": position_m,
        "time_s": time_s,
    }
    arrays = {name: _column(name, values) for name, values in columns.items() if values is not None}
    lengths = {name: values.size for name, values in arrays.items()}
    if len(set(lengths.values())) > 1 or min(lengths.values()) < MIN_ROWS:
        told = ", ".join(f"{size} of {name}" for name, size in lengths.items())
        raise BadInputError(f"identify: {told}: as many of each, and at least {MIN_ROWS}")
    if time_s is not None and (np.diff(arrays["time_s"]) < 0.0).any():
        raise BadInputError("identify: time_s falls", hint="sort the rows by time")
    curve = Curve(
        time_s=arrays.get("time_s"),
        position_m=arrays.get("position_m"),
        displacement_m=arrays.get("deformation_m"),
        force_n=arrays["force_n"],
    )
    with np.errstate(all="ignore"):
        return Identified(*identify_curve(curve, stated))


def _plan(plan: Plan | str | Path) -> Plan:
    return plan if isinstance(plan, Plan) else load_plan(Path(plan))


def _column(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """One column, float64, shape (N,).

    Raises:
        BadInputError: it is not a column, or has a number that is not finite, is masked or is
            complex.
    """
    if np.ma.is_masked(values):
        raise BadInputError(
            f"identify: {name} has rows that are masked", hint="leave out rows without a number"
        )
    if np.iscomplexobj(values):
        raise BadInputError(f"identify: {name} holds complex numbers")
    try:
        column = np.ascontiguousarray(values, np.float64)
    except (TypeError, ValueError) as error:
        raise BadInputError(f"identify: {name} holds what is no number ({error})") from None
    if column.ndim != 1:
        raise BadInputError(f"identify: {name} has the shape {column.shape}, not (N,)")
    if not np.isfinite(column).all():
        row = int(np.flatnonzero(~np.isfinite(column))[0])
        raise BadInputError(
            f"identify: {name}[{row}] is {column[row]}", hint="leave out rows without a number"
        )
    return column
