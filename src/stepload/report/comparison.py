"""Comparison of runs and curves from elsewhere with each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stepload.errors import BadInputError
from stepload.identification.difference import LEAST_DEGREES, SAME_FORCE, Difference
from stepload.identification.quantity import Quantity
from stepload.report.comparison_curve import AgainstCurve, CurveGiven, against_curve
from stepload.report.comparison_runs import (
    ComparedRun,
    chords,
    compared_run,
    differences,
    grouped,
    origin_of,
)
from stepload.report.run_record import SavedRun, labelled
from stepload.rig import pose

TOLERANCE = 0.2
"""Where no run states the accuracy that its plan needs."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Everything that was compared; secants are at `secant_force_n`.

    `given` are the curves, `curve` each of them against each run. `chords` are those of the runs
    between their common forces; none where one has none. `groups` are the indices into `runs` of
    repeats, `differences` those of every group from the first; `tolerance` is the relative
    difference that matters.
    """

    secant_force_n: float
    runs: tuple[ComparedRun, ...]
    chords: tuple[Quantity, ...]
    given: tuple[CurveGiven, ...]
    curve: tuple[AgainstCurve, ...]
    notes: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]
    differences: tuple[Difference, ...]
    tolerance: float


def compare(
    runs: Sequence[SavedRun],
    *,
    secant_force_n: float | None = None,
    given: Sequence[CurveGiven] = (),
    sizes: Sequence[int] | None = None,
    tolerance: float | None = None,
) -> Comparison:
    """Compare payload runs and curves with each other.

    Args:
        runs: records, in the order of the tests; the first is test 1.
        secant_force_n: where all secants are taken. None: the lowest of the runs' own secant
            forces, or the highest force that all have reached if that is lower.
        given: curves, each with a name of its own; without a run they are listed, not judged.
        sizes: number of runs in each group of repeats; None: grouped by plan and payload.
        tolerance: the relative difference that matters; None: the accuracy 1/t of the plans.

    Raises:
        BadInputError: fewer than two things to compare, a run given twice or one with nothing to
            identify, curves of one name, or an invalid tolerance.
    """
    if len(runs) + len(given) < 2:
        raise BadInputError(
            "there is nothing to compare with", hint="give a second run, or a curve with --curve"
        )
    if len({each.name for each in given}) < len(given):
        raise BadInputError("two curves of one name", hint="--curve NAME=FILE")
    for run in runs:
        if run.conditions.kind != "payload":
            raise BadInputError(
                f"{run.path}: a system-stiffness run", hint="pool such runs: stepload calibrate"
            )
    if tolerance is None:
        tolerance = min((1.0 / run.conditions.t for run in runs), default=TOLERANCE)
    if not 0.0 < tolerance <= 1.0:
        raise BadInputError(
            f"a tolerance of {tolerance:g}; it must be above 0 and at most 100 %",
            hint='--tolerance "5 %": the smallest difference of stiffness that matters',
        )
    groups, runs = grouped(runs, sizes), labelled(runs)
    if both := sorted({run.name for run in runs} & {each.name for each in given}):
        raise BadInputError(f"a run and a curve are called {both[0]!r}", hint="--curve NAME=FILE")
    tops_n = [*map(reached_secant_force_n, runs)] or [each.curve.force_n.max() for each in given]
    at = secant_force_n or float(min(tops_n))
    compared = tuple(compared_run(run, at) for run in runs)
    figures = chords(compared)
    against = (against_curve(r, g, tolerance, len(given)) for g in given for r in compared)
    return Comparison(
        secant_force_n=at,
        runs=compared,
        chords=figures,
        given=tuple(given),
        curve=tuple(against),
        notes=(*_group_notes(groups, sizes), *_run_notes(compared, given, at)),
        groups=groups,
        differences=differences(compared, figures, groups, tolerance),
        tolerance=tolerance,
    )


def reached_secant_force_n(run: SavedRun) -> float:
    """The plan's secant force, or the highest force of the first loading if that is lower."""
    wanted_n = run.conditions.secant_force_n
    peak_n = float(run.data.force_n[run.data.first_loading()].max(initial=0.0))
    return wanted_n if not 0.0 < peak_n < (1.0 - SAME_FORCE) * wanted_n else peak_n


def _group_notes(groups: Sequence[Sequence[int]], sizes: Sequence[int] | None) -> list[str]:
    """Notes on the repeats of a comparison."""
    notes: list[str] = []
    if len(groups) < 2:
        return notes
    if min(len(groups[0]) + len(group) for group in groups[1:]) < 2 + LEAST_DEGREES:
        notes.append(
            "too few repeats to show how well runs repeat: the difference rests on the budget "
            "alone; three runs of each show it"
        )
    if sizes is None and max(map(len, groups)) > 1:
        notes.append("runs of one plan and payload count as repeats; part them otherwise with `vs`")
    elif sizes is None and len(groups) > 2:
        notes.append("every run is compared with the first by itself; name repeats with `vs`")
    return notes


def _run_notes(runs: Sequence[ComparedRun], given: Sequence[CurveGiven], at_n: float) -> list[str]:
    """Notes on a comparison of `runs` at the force `at_n`."""
    notes = [f"{each.name}: {'; '.join(each.curve.notes)}" for each in given if each.curve.notes]
    if uncorrected := [each.name for each in given if not each.corrects and not each.payload]:
        notes.append(f"compared as it is, without a modulus (V-A): {', '.join(uncorrected)}")
    if not runs:
        return notes
    if len({each.run.simulated for each in runs}) > 1:
        simulated = ", ".join(each.run.name for each in runs if each.run.simulated)
        notes.append(f"a simulated run is compared with a measured one; simulated: {simulated}")
    notes += [
        f"{each.run.name} did not come to its end: {each.run.cut}" for each in runs if each.run.cut
    ]
    payloads = sorted({each.run.metadata.get("payload", "") for each in runs})
    if len(payloads) > 1:
        notes.append(f"different payloads: {', '.join(payloads)}")
    wanted_n = min(each.run.conditions.secant_force_n for each in runs)
    if at_n < wanted_n:
        notes.append(
            f"compared at {at_n:.4g} N instead of {wanted_n:.4g} N: not all runs have reached that"
        )
    notes += [
        f"{each.run.name} has reached {each.found.peak_force_n:.4g} N only: its secant at "
        f"{at_n:.4g} N is extrapolated"
        for each in runs
        if not each.reached(at_n)
    ]
    if len(runs) > 1:
        notes += _sharing_notes(runs)
    return notes


def _sharing_notes(runs: Sequence[ComparedRun]) -> list[str]:
    """Notes on the errors that the runs may share, according to their records."""
    origins = [origin_of(each.run) for each in runs]
    notes = []
    chains = {
        (each.rig, each.arm, each.axis, each.pose, each.stiffness_n_per_m) for each in origins
    }
    if len(chains) > 1 or len({each.calibration for each in origins} - {""}) > 1:
        notes.append(
            "different rigs, poses or calibrations: the error of K_s is not taken as common"
        )
    first = runs[0].run
    apart = [
        f"{each.run.name}: {'; '.join(found)}"
        for each in runs[1:]
        if first.stood is not None
        and each.run.stood is not None
        and (found := pose.differences(first.stood, each.run.stood))
    ]
    if apart:
        notes.append(
            f"the arm stood elsewhere than in {first.name}, and its stiffness is another there: "
            f"{', '.join(apart)}"
        )
    if len({each.force_sensor for each in origins}) > 1:
        notes.append("different force sensors: the error of the gain is not taken as common")
    if not all(each.arm and each.force_sensor for each in origins):
        notes.append(
            "a serial number of arm or force sensor is not known: what hangs on it is looked at "
            "both ways, shared and not"
        )
    if len({each.kinematics for each in origins}) > 1:
        notes.append(
            "dry runs of different seeds: each seed is a rig with another smooth error of travel"
        )
    elif not all(each.pose for each in origins) and origins[0].reach_m is not None:
        notes.append(
            "the plans name no pose (rig.arm.pose): whether the smooth error of travel, and of an "
            "arm what friction does, is shared is not known and looked at both ways"
        )
    return notes
