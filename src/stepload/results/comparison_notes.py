"""Notes of a comparison: which errors were taken as shared, and what was left out."""

from __future__ import annotations

from collections.abc import Sequence

from stepload.evidence.difference import LEAST_DEGREES
from stepload.results.comparison_curve import CurveGiven
from stepload.results.comparison_runs import ComparedRun
from stepload.results.origins import origin_of
from stepload.rig.pose import differences


def group_notes(groups: Sequence[Sequence[int]], sizes: Sequence[int] | None) -> list[str]:
    """Notes on the repeats of a comparison."""
    notes: list[str] = []
    if len(groups) < 2:
        return notes
    if min(len(groups[0]) + len(group) for group in groups[1:]) < 2 + LEAST_DEGREES:
        notes.append(
            "too few repeats to show how well runs repeat: the difference rests on the budget "
            "alone; three runs of each show it"
        )
    if sizes is not None:
        return notes
    if max(map(len, groups)) > 1:
        notes.append("runs of one plan and payload count as repeats; part them otherwise with `vs`")
    elif len(groups) > 2:
        notes.append("every run is compared with the first by itself; name repeats with `vs`")
    return notes


def run_notes(runs: Sequence[ComparedRun], given: CurveGiven | None, at_n: float) -> list[str]:
    """Notes on a comparison of `runs` at the force `at_n`."""
    notes = []
    if len({each.run.simulated for each in runs}) > 1:
        simulated = ", ".join(each.run.name for each in runs if each.run.simulated)
        notes.append(f"a simulated run is compared with a measured one; simulated: {simulated}")
    notes += [f"{each.run.name} did not come to its end: {each.run.cut}"
              for each in runs if each.run.cut]  # fmt: skip
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
    if given is not None and given.modulus_pa is None and given.plate_pa is None:
        notes.append("the curve is compared as it is: no modulus was given to correct it by (V-A)")
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
    elif not all(each.calibration for each in origins) and origins[0].stiffness_n_per_m:
        notes.append(
            "the records are older and do not name their calibration: taken as one where rig, arm, "
            "axis, K_s and its uncertainty are the same"
        )
    stood = [each.run.stood for each in runs]
    apart = [
        f"{each.run.name}: {'; '.join(found)}"
        for each, other in zip(runs[1:], stood[1:], strict=True)
        if stood[0] is not None and other is not None and (found := differences(stood[0], other))
    ]
    if apart:
        notes.append(
            f"the arm stood elsewhere than in {runs[0].run.name}, and its stiffness is another "
            f"there: {', '.join(apart)}"
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
