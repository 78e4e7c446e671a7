"""The declaration of a plan, its procedure, identification and record; checked and in SI units.

Other rooms import every part of a plan from here.
"""

import dataclasses
from collections.abc import Iterator
from itertools import pairwise
from math import radians
from pathlib import Path
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from stepload.declaration import quantities as q
from stepload.declaration.sections import CHECKED, DERIVED, INTERNAL, SECTION, Contradiction
from stepload.identification.conditions import BRANCHES
from stepload.plan.payload import Payload
from stepload.plan.problems import PlanError, Problem
from stepload.plan.rig import (
    ArmSpec,
    DeviceSpec,
    DisplacementSpec,
    ForceSpec,
    Rig,
    SecondForce,
    SecondForceSource,
    Structure,
)
from stepload.plan.simulation import Simulation
from stepload.plan.system_stiffness import Provenance, RecordPolicy, SystemStiffness
from stepload.rig.device import LARGEST_SHIFT_M

__all__ = [
    "Acceptance", "Alignment", "ArmSpec", "DeviceSpec", "DisplacementSpec", "ForceSpec",
    "IdentifyPlan", "Payload", "Plan", "Procedure", "Provenance", "RecordPlan", "RecordPolicy",
    "Rig", "SecondForce", "SecondForceSource", "Simulation", "SourceFile", "Structure",
    "SystemStiffness",
]  # fmt: skip

MAX_LEVELS = 1000


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Alignment:
    """Three touches on a circle before anything is loaded tell how the plate is tilted."""

    radius_m: Annotated[float, q.Quantity("m", 1e-3, LARGEST_SHIFT_M)] = LARGEST_SHIFT_M
    """Radius of the circle; the plate must be flat and free there."""
    max_tilt_rad: Annotated[float, q.Quantity("rad", radians(0.05), radians(3.0))] = radians(1.0)
    """Largest tilt, its uncertainty included, at which the run goes on."""
    touch_error_m: q.Length = 20e-6
    """Standard uncertainty of one touch; raised where resolution and speed need more."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Procedure:
    """The load steps. Inline, or the path of a file that holds these keys."""

    top_force_n: q.Force
    """Highest load."""
    step_n: q.Force = DERIVED
    """Load step; give this or `levels`."""
    levels_n: tuple[q.Force, ...] = DERIVED
    """All load levels, rising; the last is `top_force`."""
    load_rate_n_per_s: q.ForceRate = DERIVED
    """Largest rate of the force; default: the largest step in one second."""
    until: q.Accuracy | None = None
    """Half width of the interval at which the first loading may end, as in "±5 %"."""
    hold_s: q.Duration = 3.0
    """Time at each level after it has settled."""
    unload: q.Flag = True
    """Whether the levels are also held during unloading."""
    cycles: Annotated[int, q.number(1, 1000)] = 2
    """Number of loadings; the second shows set, creep and drift."""
    lift_off: q.Flag = True
    """Whether the contact opens between cycles, or unloads to `unload_fraction` only."""
    unload_fraction: Annotated[float, q.Quantity("%", 0.01, 0.5)] = 0.05
    """Share of the highest load kept between cycles without `lift_off`."""
    surface_distance_m: q.Length
    """Travel from the start pose to the expected surface."""
    surface_uncertainty_m: q.Length = 1e-3
    """Largest error of `surface_distance`, of either sign."""
    search_distance_m: q.Length = DERIVED
    """Length of the search beyond the nearest possible surface; default: from the two keys above.
    """
    touch_force_n: q.Force = DERIVED
    """Force that counts as contact; default: from `top_force`, noise and resolution, at least 1 N.
    """
    touches: Annotated[int, q.number(1, 100)] = 3
    """Number of touches before loading."""
    retract_m: q.Length = DERIVED
    """Travel away from the contact; default: 0.5 mm, or twice the elastic travel."""
    tare_s: q.Duration = 10.0
    """Time over which the force zero is measured."""
    warm_up_s: q.DurationOrZero = 2.0
    """Wait before the first tare."""
    max_drift_n: q.Force = DERIVED
    """Zero shift within a cycle that ends the run; default: at least 1 % of `top_force`."""
    settle_timeout_s: q.Duration = 10.0
    """Longest wait for a level to settle."""
    max_lateral_share: Annotated[float, q.Quantity("%", 0.01, 0.5)] = 0.3
    """Largest lateral force, share of the axial force (rule R12)."""
    max_eccentricity_m: q.Length = 0.01
    """Largest distance of the contact from the sensor axis (R14); needs `rig.force.lever`."""
    alignment: Alignment | None = None
    """Measures the plate tilt by three touches on a circle; `{}`: all defaults; none: off."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        yield from self._of_levels()
        distance, uncertainty = self.surface_distance_m, self.surface_uncertainty_m
        if uncertainty > distance:
            yield (
                "surface_uncertainty",
                f"{q.metre(uncertainty)} is more than the surface_distance {q.metre(distance)}: "
                "the payload might touch already at the start",
                "start farther away, or measure the distance better",
            )
        search = self.search_distance_m
        if search is not DERIVED and search < 2.0 * uncertainty:
            yield (
                "search_distance",
                f"the search ends after {q.metre(search)}, within the uncertain band of "
                f"2 x {q.metre(uncertainty)}",
                f"search at least {q.metre(2.0 * uncertainty)}",
            )

    def _of_levels(self) -> Iterator[Contradiction]:
        step, levels, top = self.step_n, self.levels_n, self.top_force_n
        if step is DERIVED and levels is DERIVED:
            yield "", "missing key 'step'", "give the load step, or every level in `levels`"
        elif levels is DERIVED and step > top:
            yield (
                "top_force",
                f"top force {q.newton(top)} is below one step of {q.newton(step)}",
                "raise top_force or lower step",
            )
        elif levels is DERIVED and top / step > MAX_LEVELS:
            hint = f"at most {MAX_LEVELS}: use a larger step"
            yield "step", f"{top / step:.0f} load levels", hint
        if levels is DERIVED:
            return
        if step is not DERIVED:
            yield "levels", "both `step` and `levels`", "give one of the two"
        elif not 1 <= len(levels) <= MAX_LEVELS:
            yield "levels", f"{len(levels)} levels", f"expected 1 to {MAX_LEVELS} levels"
        elif bad := next((pair for pair in pairwise(levels) if pair[1] <= pair[0]), None):
            yield "levels", f"{q.newton(bad[1])} after {q.newton(bad[0])}", "levels must rise"
        elif levels[-1] != top:
            yield (
                "levels",
                f"the last level {q.newton(levels[-1])} is not the top force {q.newton(top)}",
                "end the levels with top_force",
            )


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Acceptance:
    """Limits of a batch: what a sound specimen keeps."""

    chord_min_n_per_m: q.Stiffness | None = None
    """Smallest chord stiffness of a sound specimen."""
    chord_max_n_per_m: q.Stiffness | None = None
    """Largest chord stiffness of a sound specimen."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        low, high = self.chord_min_n_per_m, self.chord_max_n_per_m
        if low is None and high is None:
            yield "", "no limit", "give chord_min, chord_max or both"
        elif low is not None and high is not None and not low < high:
            yield "chord_max", "chord_max is not above chord_min", "exchange the two limits"


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class IdentifyPlan:
    """How the data become a result."""

    kind: Annotated[str, q.Choice(("payload", "system"))] = "payload"
    """What is identified: the payload (K, n) or the system stiffness."""
    secant_force_n: q.Force = DERIVED
    """Force of the secant; default: 300 N or `top_force`."""
    branch: Annotated[str, q.Choice(BRANCHES)] = "loading"
    """Branch whose chord is the result; reloading: the second loading."""
    resolution_multiple_p: Annotated[float, q.number(1.0, 100.0), Field(alias="p")] = 2.0
    """Multiple of the position resolution lost at the zero (29)."""
    compensation_quality_s: Annotated[float, q.number(1.0, 1000.0), Field(alias="s")] = 20.0
    """Quality of the compensation: K_s is known to 1/s (30)."""
    accuracy_t: Annotated[float, q.number(1.0, 1000.0), Field(alias="t")] = 5.0
    """Accuracy wanted: deformation to 1/t (31)."""
    accept_unidentifiable: q.Remark = ""
    """Reason to run a payload stiffer than K_max."""
    temperature_c: q.Temperature | None = None
    """Temperature of the run; compared with the calibration record."""
    temperature_uncertainty_k: Annotated[float, q.Quantity("K", 0.0, 20.0)] = 0.0
    """Standard uncertainty of the temperature, drift during the run included."""
    acceptance: Acceptance | None = None
    """Limits that `stepload batch` judges specimens by; none: none are stated."""


@dataclass(frozen=True, slots=True, config=SECTION)
class RecordPlan:
    """Where the record goes and what it says."""

    directory: q.FilePath = Path("runs")
    """Directory of the runs, no `..` in it."""
    notes: q.Note = ""
    """Notes to keep with the record."""
    operator: q.Remark = ""
    """Who runs it."""
    specimen: q.Remark = ""
    """Number or name of the piece."""
    batch: q.Remark = ""
    """Batch of the specimen."""
    tags: tuple[q.Tag, ...] = ()
    """Words to find the run by, such as `surface=polished`; `--tag` adds more."""


@dataclasses.dataclass(frozen=True, slots=True)
class SourceFile:
    """One file the plan was made from; goes into the record."""

    name: str
    text: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Plan:
    """A plan: one experiment, complete and checked.

    `path` is the plan's file, `sources` the text of every file it was made from, the plan first.
    `payload_file` is what was given in place of the plan's own payload, None where nothing was.
    `missing` are the options, such as addresses, that opening its devices needs and it lacks.
    """

    stepload: q.Version
    """Version of the plan format."""
    name: q.Name = DERIVED
    """Name of the experiment; default: the file's name."""
    path: Annotated[Path, INTERNAL] = Path()
    payload: Payload
    """What is pressed: a mapping or a path."""
    rig: Rig
    """The rig: a mapping, a path or a profile's name."""
    procedure: Procedure
    """The load steps: a mapping or a path."""
    identify: IdentifyPlan = Field(default_factory=IdentifyPlan)
    """How the data become a result."""
    record: RecordPlan = Field(default_factory=RecordPlan)
    """Where the record goes."""
    sources: Annotated[tuple[SourceFile, ...], INTERNAL] = ()
    payload_file: Annotated[Path | None, INTERNAL] = None
    missing: Annotated[tuple[Problem, ...], INTERNAL] = ()

    def refuse_missing(self) -> None:
        """Refuse to open devices that the plan gives no address of.

        Raises:
            PlanError: with the place at which each option is to be written.
        """
        if self.missing:
            first, *others = self.missing
            first = dataclasses.replace(first, hint=f"{first.hint}; or add --dry-run to rehearse")
            raise PlanError((first, *others))
