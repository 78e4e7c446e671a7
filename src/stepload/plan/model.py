"""The declaration of a plan, its procedure, identification and record; checked and in SI units.

Other rooms import every part of a plan from here.
"""

import dataclasses
import hashlib
from pathlib import Path
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from stepload.contact.law_names import LAW_NAMES
from stepload.estimators.conditions import BRANCHES
from stepload.plan.aligning import Alignment, Nulling
from stepload.plan.payload import Payload
from stepload.plan.problems import PlanError, Problem
from stepload.plan.quantities import (
    Accuracy,
    Choice,
    Duration,
    DurationOrZero,
    FilePath,
    Flag,
    Force,
    ForceRate,
    Length,
    Name,
    Note,
    Quantity,
    Remark,
    Tag,
    Temperature,
    Version,
    number,
)
from stepload.plan.rig import (
    ArmSpec,
    DeviceSpec,
    DisplacementSpec,
    ForceSpec,
    Provenance,
    RecordPolicy,
    Rig,
    SecondForce,
    SecondForceSource,
    Structure,
    SystemStiffness,
)
from stepload.plan.sections import DERIVED, INTERNAL, SECTION, key
from stepload.plan.simulation import Simulation

__all__ = [
    "Alignment", "ArmSpec", "DeviceSpec", "DisplacementSpec", "ForceSpec", "IdentifyPlan",
    "Nulling", "Payload", "Plan", "Procedure", "Provenance", "RecordPlan", "RecordPolicy", "Rig",
    "SecondForce", "SecondForceSource", "Simulation", "SourceFile", "Structure", "SystemStiffness",
]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Procedure:
    """The load steps. Inline, or the path of a file that holds these keys."""

    top_force_n: Annotated[Force, key("Highest load.")]
    step_n: Annotated[Force, key("Load step; give this or `levels`.")] = DERIVED
    levels_n: Annotated[
        tuple[Force, ...], key("Every load level, rising, the last one `top_force`.")
    ] = DERIVED
    load_rate_n_per_s: Annotated[
        ForceRate,
        key(
            "How fast the force rises and falls at the most; default: the largest step in one "
            "second. Lag and damping spoil data of faster ramps.",
        ),
    ] = DERIVED
    until: Annotated[
        Accuracy | None,
        key(
            'Half width of the interval that is enough, as in "±5 %": the first loading ends at '
            "the first level that is expected to give it, and the run stops where even `top_force` "
            "cannot give it. Left out, every run goes up to `top_force`."
        ),
    ] = None
    hold_s: Annotated[Duration, key("How long each level is held once it has settled.")] = 3.0
    unload: Annotated[Flag, key("Whether the levels are also held on the way down.")] = True
    cycles: Annotated[
        int,
        number(1, 1000),
        key(
            "How often the payload is loaded and unloaded; the second time shows what set, crept "
            "or drifted."
        ),
    ] = 2
    lift_off: Annotated[
        Flag,
        key(
            "Whether cycles part the contact (seating; the touch tells set, and the force is "
            "zeroed again), or unload to `unload_fraction` only (shakedown)."
        ),
    ] = True
    unload_fraction: Annotated[
        float,
        Quantity("%", 0.01, 0.5),
        key(
            "Share of the highest load that is kept between cycles without lift-off: of "
            "`top_force`, or of the level that `until` ended at."
        ),
    ] = 0.05
    surface_distance_m: Annotated[
        Length, key("Travel from the start pose to where the surface is expected.")
    ]
    surface_uncertainty_m: Annotated[
        Length, key("How wrong `surface_distance` may be, either way.")
    ] = 1e-3
    search_distance_m: Annotated[
        Length,
        key(
            "Travel beyond the nearest possible surface after which the search ends; default: 1.5 "
            "times the width of the uncertain band, and twice the travel from the surface to "
            "`touch_force`.",
        ),
    ] = DERIVED
    touch_force_n: Annotated[
        Force,
        key(
            "Force that counts as contact; default: 1 % of `top_force`, at least 1 N, two force "
            "resolutions, six times the force noise, quantisation included, and 1.5 times what the "
            "tool takes to be accelerated.",
        ),
    ] = DERIVED
    touches: Annotated[
        int, number(1, 100), key("How often the surface is touched before loading.")
    ] = 3
    retract_m: Annotated[
        Length,
        key(
            "Distance to move away from the contact; default: 0.5 mm, or twice the elastic travel "
            "at `top_force` where that is more.",
        ),
    ] = DERIVED
    tare_s: Annotated[Duration, key("Time over which the force zero is taken.")] = 10.0
    warm_up_s: Annotated[DurationOrZero, key("Wait before the first tare.")] = 2.0
    max_drift_n: Annotated[
        Force,
        key(
            "Shift of the force zero within a cycle that ends the run, and over the run that flags "
            "it; default: 1 % of `top_force`, at least 1 N, three force resolutions and what the "
            "stated drift of the sensor may come to in a cycle.",
        ),
    ] = DERIVED
    settle_timeout_s: Annotated[Duration, key("Longest wait for a level to settle.")] = 10.0
    max_lateral_share: Annotated[
        float,
        Quantity("%", 0.01, 0.5),
        key(
            "Largest force across the pressing axis, as a share of the force along it, at which a "
            "run goes on (rule R12). A payload that is dragged sideways yields earlier."
        ),
    ] = 0.3
    max_eccentricity_m: Annotated[
        Length,
        key(
            "How far beside the force sensor's pressing axis the plate may be touched (rule R14); "
            "known where `rig.force.lever` is stated and the sensor has torques."
        ),
    ] = 0.01
    alignment: Annotated[
        Alignment | None,
        key(
            "Three touches on a circle before loading tell how the plate is tilted; `{}` takes all "
            "defaults. The tool, not the plate, must carry what is round; none: not asked."
        ),
    ] = None
    nulling: Annotated[
        Nulling | None,
        key(
            "Takes lateral force off before a level is held; `{}` takes all defaults. For "
            "lowering that force only, it biases the result of a tool that is not aligned; none: "
            "not done."
        ),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class IdentifyPlan:
    """How the data become a result."""

    kind: Annotated[
        str,
        Choice(("payload", "system")),
        key("Identify the payload (K, n), or the system stiffness of the rig."),
    ] = "payload"
    secant_force_n: Annotated[
        Force,
        key("Force at which the secant is reported; default: 300 N or `top_force`."),
    ] = DERIVED
    branch: Annotated[
        str,
        Choice(BRANCHES),
        key("Branch whose chord is the result; reloading: the second loading, after the first."),
    ] = "loading"
    laws: Annotated[
        tuple[Annotated[str, Choice(tuple(LAW_NAMES))], ...],
        key("Laws that the figures may rest on: an assumption; left out, all that can be tried."),
    ] = ()
    resolution_multiple_p: Annotated[
        float,
        number(1.0, 100.0),
        key("Multiple of the position resolution lost at the zero (29).", alias="p"),
    ] = 2.0
    compensation_quality_s: Annotated[
        float,
        number(1.0, 1000.0),
        key("Quality of the compensation of K_s: known to 1/s (30).", alias="s"),
    ] = 20.0
    accuracy_t: Annotated[
        float,
        number(1.0, 1000.0),
        key("Accuracy asked for: deformation to 1/t (31).", alias="t"),
    ] = 5.0
    accept_unidentifiable: Annotated[
        Remark, key("A reason, in words, to run a payload that is beyond K_max.")
    ] = ""
    temperature_c: Annotated[
        Temperature | None,
        key("Temperature of the run; compared with the calibration record."),
    ] = None
    temperature_uncertainty_k: Annotated[
        float,
        Quantity("K", 0.0, 20.0),
        key("Standard uncertainty of the temperature, its drift during the run included."),
    ] = 0.0


@dataclass(frozen=True, slots=True, config=SECTION)
class RecordPlan:
    """Where the record goes and what it says."""

    directory: Annotated[FilePath, key("Directory of the runs, no `..` in it.")] = Path("runs")
    notes: Annotated[Note, key("Anything worth keeping with the record.")] = ""
    operator: Annotated[Remark, key("Who runs it.")] = ""
    specimen: Annotated[Remark, key("Which piece is pressed: its number or name.")] = ""
    batch: Annotated[Remark, key("Which batch the specimen is of.")] = ""
    tags: Annotated[
        tuple[Tag, ...],
        key("Free words to find the run by, such as `surface=polished`; `--tag` adds more."),
    ] = ()


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

    stepload: Annotated[Version, key("Version of the plan format.")]
    name: Annotated[Name, key("Name of the experiment; default: the file's.")] = DERIVED
    path: Annotated[Path, INTERNAL] = Path()
    payload: Annotated[Payload, key("What is pressed: a mapping or a path.")]
    rig: Annotated[Rig, key("With what: a mapping, a path, or a profile's name.")]
    procedure: Annotated[Procedure, key("How: a mapping or a path.")]
    identify: Annotated[IdentifyPlan, key("How the data become a result.")] = Field(
        default_factory=IdentifyPlan
    )
    record: Annotated[RecordPlan, key("Where the record goes.")] = Field(default_factory=RecordPlan)
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

    @property
    def digest(self) -> str:
        """SHA-256 of every file it was made from, payload, rig and profile among them."""
        sums = " ".join(source.sha256 for source in self.sources)
        return hashlib.sha256(sums.encode()).hexdigest()
