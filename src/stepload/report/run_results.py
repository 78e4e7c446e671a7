"""Figures of a run, as they stand in results.json, and the schema of that."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import scipy
from pydantic import Field

import stepload
from stepload.feasibility.preflight import Preflight
from stepload.record.outcome import RunOutcome, RunStatus
from stepload.report.analyse import Evaluation
from stepload.report.identified import Identified, Pair, identification_data
from stepload.report.levels import Level
from stepload.report.press_data import TouchPoint
from stepload.report.reasons import Loaded, loaded, reasons_of
from stepload.report.rows import Cell, Row, column, data, figure, form, part, quantity, schema_of
from stepload.units import percent

SCHEMA, SCHEMA_ID = "stepload-results/1", "urn:stepload:results:1"


class RunHead(Row):
    """Which run this is."""

    run_id: str = figure('Twelve hexadecimal digits; "" for a curve from elsewhere.')
    started: str = figure("ISO 8601 with time zone.")
    plan: str = figure("Name of the plan.")
    payload: str = figure("Name of the payload.")
    rig: str = figure("Name of the rig.")
    specimen: str = figure("Which piece.")
    batch: str = figure("Which batch.")
    operator: str = figure("Who ran it.")
    notes: str = figure("Of the plan.")
    calibration: str = figure(
        "Where K_s comes from: SHA-256 of the calibration record, or who answers for it."
    )
    arm: str = figure("What the arm said of itself.")
    force: str = figure("The same of the force sensor.", at="force_sensor")
    second_force: str = figure('The same of the second one; "" without.', at="second_force_sensor")
    displacement: str = figure('The same of the gauge; "" without.', at="displacement_sensor")
    stepload: str = figure("Version that ran it.")
    tags: tuple[str, ...] = figure("Free words.")
    files: Mapping[str, str] = figure(
        "SHA-256 of the plan and of every file it was made from, by their names in the record."
    )


class Versions(Row):
    """What computed these results."""

    stepload: str = figure("Version that computed these results.")
    python: str = figure("Its Python.")
    numpy: str = figure("NumPy.")
    scipy: str = figure("SciPy.")


class Head(Row):
    """The head of results.json."""

    schema_id: Literal["urn:stepload:results:1"] = Field(
        serialization_alias="$schema", description="`$id` of this schema."
    )
    schema_: Literal["stepload-results/1"] = Field(
        serialization_alias="schema",
        description="Name and version of this schema. Within a version keys are added, never taken "
        "away or changed in meaning.",
    )
    run: RunHead = figure("Which run this is.")
    versions: Versions = figure("What computed these results.")


class CauseRow(Row):
    """What stopped a run."""

    rule: str = figure("Code of a rule, or a word.")
    value: float | None = figure("What was seen.")
    limit: float | None = figure("What it passed.")
    unit: str = figure("Of both.")
    sample_age_s: float | None = figure("Age of the sample judged by.")
    time_s: float | None = figure("On the run's clock.")
    message: str = figure("In words.")


class LimitSource(Row):
    """One source of the uncertainty of the elastic limit."""

    what: str = figure("Which input.")
    sigma: float | None = figure("Its standard uncertainty.")
    sigma_ln: float = figure("What it adds to that of ln F_c.")
    assumed: bool = figure("Not stated in the plan.")
    relative: bool = figure("Whether sigma is a share.")


class ElasticLimit(Row):
    """The elastic limit F_c, and the part of it that is used."""

    value_n: float = figure("F_c.")
    equation: str = figure("Where it comes from.")
    sigma_ln: float = figure("Standard uncertainty of its logarithm.")
    coverage: float = figure("Standard uncertainties that are left off.")
    lower_n: float = figure("F_c used.")
    probability: float | None = figure("That F_c is below it.")
    sources: tuple[LimitSource, ...] = figure("What its uncertainty is made of.")


class Safing(Row):
    """One action that made the rig safe."""

    name: str = figure("Of the action.")
    sent: bool = figure("Whether it was sent.")
    duration_s: float | None = figure("How long it took.")
    error: str = figure('"" where it was confirmed.')


class LatenessRow(Row):
    """How late the loop was."""

    ticks: int = figure("Ticks of the loop.")
    overruns: int = figure("Late by more than a period.")
    worst_s: float | None = figure("Of the latest tick.")
    mean_s: float | None = figure("On average.")


class Ended(Row):
    """What is known of a run before anything is evaluated."""

    status: RunStatus = figure("How the run ended.", at="outcome.status")
    why_it_ended: str = figure("The same in sentences.", at="outcome.why")
    cause: CauseRow | None = figure("What stopped the run.", at="outcome.cause")
    peak_force_n: float | None = figure(
        "Largest measured contact force.", at="outcome.peak_force_n"
    )
    elastic_limit_n: float = figure("F_c.", at="preflight.theory.elastic_limit_n")
    elastic_limit: ElasticLimit = figure(
        "The elastic limit, and the part of it that is used.", at="preflight.theory.counted"
    )
    force_limit_n: float = figure("F_lim: where a run is stopped.", at="preflight.force_limit_n")
    levels_done: int = figure("Load levels that were held on the way up.", at="outcome.levels_done")
    cycle: int = figure("Last cycle, from 1.", at="outcome.cycle")
    duration_s: float | None = figure("From first to last tick.", at="outcome.duration_s")
    zero_shift_n: float | None = figure(
        "Change of the force zero from first to last tare; null where it was not taken.",
        at="outcome.zero_shift_n",
    )
    safing: tuple[Safing, ...] = figure("How the rig was made safe.", at="outcome.safing")
    errors: tuple[str, ...] = figure("Errors on the way.", at="outcome.errors")
    lateness: LatenessRow = figure("How late the loop was.", at="outcome.lateness")


class Clock(Row):
    """Timing of a channel."""

    channel: str = figure("Which.", "channel")
    how: str = figure("How its samples were timed.", "times from")
    why: str = column("why")
    skew_ppm: Annotated[float | None, form(".1f")] = figure("Skew of its clock.", "skew [ppm]")
    residual_median_us: Annotated[float | None, form(".0f")] = figure(
        "Median of the residuals.", "residual, median [µs]"
    )
    residual_p99_us: Annotated[float | None, form(".0f")] = figure(
        "99 % of the residuals are below.", "residual, 99 % [µs]"
    )


class Measured(Row):
    """What a run measured beside the law."""

    noise_n: float | None = figure("Standard deviation of a force sample.")
    zero_shift_n: float | None = figure("As above.")
    second_zero_shift_n: float | None = figure(
        "The same of the second force channel; null without one."
    )
    lag_s: float | None = figure("Lag of the force behind the position.", at="lag.lag_s")
    lag_sigma_s: float | None = figure("Its standard uncertainty.", at="lag.sigma_s")
    lag_corrected_s: float = figure("What was taken out.")
    touches: tuple[TouchPoint, ...] = figure("Every touch.")
    clocks: tuple[Clock, ...] = figure("Timing of each channel.")


def smooth_error(size_m: float, degrees: float | None) -> str:
    """A smooth error and the uncertainty of its size."""
    known = "" if degrees is None else f", known with {degrees:.2g} degrees of freedom"
    return f"{quantity('m')(size_m)}{known}"


class SystemRun(Row):
    """K_s in a table of several runs."""

    run: str = column("run")
    stiffness_n_per_m: float = figure("K_s (26).", "K_s")
    sigma_n_per_m: float = figure("Its standard uncertainty.", "standard uncertainty")
    msde_m: float = figure("Mean smooth deformation error.", "MSDE")
    nonlinearity: Annotated[
        float | None,
        Cell(
            lambda row: f"{100.0 * row.nonlinearity:+.2f} % ± {percent(row.nonlinearity_sigma, 3)}"
        ),
    ] = figure("Of the deflection.", "nonlinearity")
    nonlinearity_sigma: float | None = figure("Its standard uncertainty.")


class SystemStiffness(SystemRun):
    """The system stiffness K_s that a run measured."""

    stiffness_upper_n_per_m: float | None = figure(
        "Upper limit, if the contact is in series.", "upper limit, if the contact is in series"
    )
    damping_lower_bound_n_s_per_m: Annotated[float | None, form(".3g")] = figure(
        "Lower bound of the damping C_s.", "C_s, lower bound [N s/m]"
    )
    smooth_error_m: Annotated[
        float | None, Cell(lambda row: smooth_error(row.smooth_error_m, row.smooth_degrees))
    ] = figure("Smooth error of the position.", "smooth position error")
    smooth_degrees: float | None = figure("Its degrees of freedom.")
    force_range_n: Pair = figure("Forces fitted.", "force range")
    points: int = figure("Samples.", "samples")
    intercept_n: float | None = figure("Force of the line where the travel is 0.")
    contact_share: float | None = figure(
        "Share of the contact in the compliance that was taken out."
    )


class CycleRow(Row):
    """One cycle of loading and unloading."""

    number: int = figure("From 1.", "cycle")
    secant_n_per_m: float | None = figure("Secant stiffness.", "secant", at="fit.secant_n_per_m")
    n: Annotated[float | None, form(".3f")] = figure("Exponent.", "n", at="fit.n")
    chord_n_per_m: float | None = figure(
        "Chord between the forces common to all cycles.", "chord, forces common to all cycles"
    )
    loop_energy_j: Annotated[
        float | None,
        Cell(lambda row: f"{row.loop_energy_j * 1e3:.3g} ± {row.loop_sigma_j * 1e3:.1g} mJ"),
    ] = figure("Energy lost in the cycle.", "loop energy")
    loop_sigma_j: float | None = figure("Its standard uncertainty.")
    stored_energy_j: Annotated[
        float | None, Cell(lambda row: percent(row.loop_energy_j / row.stored_energy_j, 2))
    ] = figure("Energy put in.", "of stored")


class RunInRow(Row):
    """Cycles of a run, virgin and steady; never their mean."""

    cycles: tuple[CycleRow, ...] = figure("Whole cycles.")
    lift_off: bool = figure("Whether the contact was parted between them.")
    virgin: Annotated[int | None, part("number")] = figure("Number of the virgin cycle.")
    steady: Annotated[int | None, part("number")] = figure("Number of the first steady one.")
    secant_tolerance: float | None = figure("Relative change that counts as steady.")
    secant_change: float | None = figure("Last change.")
    energy_change: float | None = figure("Last change of the energy of the loop.")
    energy_tolerance: float | None = figure("That counts as steady.")
    shakedown_m: float | None = figure("Shakedown.")
    residual_indentation_m: float | None = figure("How far the touch has moved.")


class Results(Head, Identified, Ended):
    """results.json of stepload, version 1.

    What a run leaves in results.json, in its record, and prints with --json (which adds
    `directory`). SI units; NaN and infinities are null. A file without a run has no outcome, a run
    that measures K_s no identification.
    """

    simulated: bool = figure(
        "Whether simulated devices made the data: then nothing here is a measurement."
    )
    levels: tuple[Level, ...] = figure("Every hold in the order of time.")
    measured: Measured = figure("What the run measured beside the law.")
    until: Loaded = figure("How far the first loading went; only with procedure.until.")
    system_stiffness: SystemStiffness = figure("Of a run that measures K_s.")
    run_in: RunInRow = figure("Of runs with cycles.")
    resumed: str = figure("What a reader must know of a run that was taken up again.")
    notes: tuple[str, ...] = figure("Of a curve from elsewhere: what had to be assumed.")


def results_schema() -> dict[str, Any]:
    """The JSON Schema of results.json."""
    return schema_of(Results, "results", required=("$schema", "schema", "run", "versions"))


def versions() -> dict[str, str]:
    """The software that evaluates."""
    return {
        "stepload": stepload.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }


def about(metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> dict[str, Any]:
    """The head of the results of a run.

    Args:
        metadata: of the record.
        attachments: files of the record; those of the plan are named with their SHA-256.
    """
    sums = {
        name: hashlib.sha256(content).hexdigest()
        for name, content in attachments.items()
        if name.startswith("plan")
    }
    roles = ("force_sensor", "second_force_sensor", "displacement_sensor")
    known = dict.fromkeys((*RunHead.model_fields, *roles), "") | dict(metadata)
    tags = [tag for tag in metadata.get("tags", "").split("\n") if tag]
    run = known | {"tags": tags, "files": sums}
    return data(
        Head, {"schema_id": SCHEMA_ID, "schema_": SCHEMA, "run": run, "versions": versions()}
    )


class _Run(NamedTuple):
    outcome: RunOutcome
    preflight: Preflight


def outcome_data(outcome: RunOutcome, preflight: Preflight) -> dict[str, Any]:
    """What is known of a run before anything is evaluated."""
    return data(Ended, _Run(outcome, preflight)) | {"verdict": outcome.status, "reasons": []}


def system_data(fit: Any) -> dict[str, Any]:
    """The object of a system stiffness."""
    return data(SystemStiffness, fit)


def run_data(run: Evaluation) -> dict[str, Any]:
    """The object of a run, including that of its identification where there is one."""
    made = {
        **about(run.recording.metadata, run.recording.attachments),
        "simulated": run.dry_run,
        **outcome_data(run.outcome, run.preflight),
    }
    if run.data is not None:
        made["levels"] = [each.model_dump() for each in run.levels]
        made["measured"] = data(Measured, run.data)
    if run.identification is not None:
        peak_n = made["peak_force_n"]  # of the whole run, not of its first loading alone
        made |= identification_data(run.identification) | {"peak_force_n": peak_n}
    if run.system is not None:
        made["system_stiffness"] = system_data(run.system)
        made["verdict"] = "system stiffness measured"
    if run.run_in is not None:
        made["run_in"] = data(RunInRow, run.run_in)
    if (until := loaded(run.recording.events, run.identification)) is not None:
        made["until"] = until.model_dump()
    if resumed := run.recording.metadata.get("resumed"):
        made["resumed"] = resumed
    return made | {"reasons": [*filter(None, [run.problem]), *reasons_of(run)]}
