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
from stepload.declaration.quantities import (
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
from stepload.declaration.sections import DERIVED, INTERNAL, SECTION, key
from stepload.estimators.conditions import BRANCHES
from stepload.plan.aligning import Alignment, Nulling
from stepload.plan.payload import Payload
from stepload.plan.problems import PlanError, Problem
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
        tuple[Force, ...], key("All load levels, rising; the last is `top_force`.")
    ] = DERIVED
    load_rate_n_per_s: Annotated[
        ForceRate,
        key("Largest rate of the force; default: the largest step in one second."),
    ] = DERIVED
    until: Annotated[
        Accuracy | None,
        key('Half width of the interval at which the first loading may end, as in "±5 %".'),
    ] = None
    hold_s: Annotated[Duration, key("Time at each level after it has settled.")] = 3.0
    unload: Annotated[Flag, key("Whether the levels are also held during unloading.")] = True
    cycles: Annotated[
        int,
        number(1, 1000),
        key("Number of loadings; the second shows set, creep and drift."),
    ] = 2
    lift_off: Annotated[
        Flag,
        key("Whether the contact opens between cycles, or unloads to `unload_fraction` only."),
    ] = True
    unload_fraction: Annotated[
        float,
        Quantity("%", 0.01, 0.5),
        key("Share of the highest load kept between cycles without `lift_off`."),
    ] = 0.05
    surface_distance_m: Annotated[
        Length, key("Travel from the start pose to the expected surface.")
    ]
    surface_uncertainty_m: Annotated[
        Length, key("Largest error of `surface_distance`, of either sign.")
    ] = 1e-3
    search_distance_m: Annotated[
        Length,
        key(
            "Length of the search beyond the nearest possible surface; default: from the "
            "two keys above."
        ),
    ] = DERIVED
    touch_force_n: Annotated[
        Force,
        key(
            "Force that counts as contact; default: from `top_force`, noise and resolution,"
            " at least 1 N."
        ),
    ] = DERIVED
    touches: Annotated[int, number(1, 100), key("Number of touches before loading.")] = 3
    retract_m: Annotated[
        Length,
        key("Travel away from the contact; default: 0.5 mm, or twice the elastic travel."),
    ] = DERIVED
    tare_s: Annotated[Duration, key("Time over which the force zero is measured.")] = 10.0
    warm_up_s: Annotated[DurationOrZero, key("Wait before the first tare.")] = 2.0
    max_drift_n: Annotated[
        Force,
        key("Zero shift within a cycle that ends the run; default: at least 1 % of `top_force`."),
    ] = DERIVED
    settle_timeout_s: Annotated[Duration, key("Longest wait for a level to settle.")] = 10.0
    max_lateral_share: Annotated[
        float,
        Quantity("%", 0.01, 0.5),
        key("Largest lateral force, share of the axial force (rule R12)."),
    ] = 0.3
    max_eccentricity_m: Annotated[
        Length,
        key("Largest distance of the contact from the sensor axis (R14); needs `rig.force.lever`."),
    ] = 0.01
    alignment: Annotated[
        Alignment | None,
        key("Measures the plate tilt by three touches on a circle; `{}`: all defaults; none: off."),
    ] = None
    nulling: Annotated[
        Nulling | None,
        key("Removes lateral force before each hold; `{}`: all defaults; none: off."),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class IdentifyPlan:
    """How the data become a result."""

    kind: Annotated[
        str,
        Choice(("payload", "system")),
        key("What is identified: the payload (K, n) or the system stiffness."),
    ] = "payload"
    secant_force_n: Annotated[
        Force,
        key("Force of the secant; default: 300 N or `top_force`."),
    ] = DERIVED
    branch: Annotated[
        str,
        Choice(BRANCHES),
        key("Branch whose chord is the result; reloading: the second loading."),
    ] = "loading"
    laws: Annotated[
        tuple[Annotated[str, Choice(tuple(LAW_NAMES))], ...],
        key("Contact laws that may be fitted; default: all that apply."),
    ] = ()
    resolution_multiple_p: Annotated[
        float,
        number(1.0, 100.0),
        key("Multiple of the position resolution lost at the zero (29).", alias="p"),
    ] = 2.0
    compensation_quality_s: Annotated[
        float,
        number(1.0, 1000.0),
        key("Quality of the compensation: K_s is known to 1/s (30).", alias="s"),
    ] = 20.0
    accuracy_t: Annotated[
        float,
        number(1.0, 1000.0),
        key("Accuracy wanted: deformation to 1/t (31).", alias="t"),
    ] = 5.0
    accept_unidentifiable: Annotated[Remark, key("Reason to run a payload stiffer than K_max.")] = (
        ""
    )
    temperature_c: Annotated[
        Temperature | None,
        key("Temperature of the run; compared with the calibration record."),
    ] = None
    temperature_uncertainty_k: Annotated[
        float,
        Quantity("K", 0.0, 20.0),
        key("Standard uncertainty of the temperature, drift during the run included."),
    ] = 0.0


@dataclass(frozen=True, slots=True, config=SECTION)
class RecordPlan:
    """Where the record goes and what it says."""

    directory: Annotated[FilePath, key("Directory of the runs, no `..` in it.")] = Path("runs")
    notes: Annotated[Note, key("Notes to keep with the record.")] = ""
    operator: Annotated[Remark, key("Who runs it.")] = ""
    specimen: Annotated[Remark, key("Number or name of the piece.")] = ""
    batch: Annotated[Remark, key("Batch of the specimen.")] = ""
    tags: Annotated[
        tuple[Tag, ...],
        key("Words to find the run by, such as `surface=polished`; `--tag` adds more."),
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
    name: Annotated[Name, key("Name of the experiment; default: the file's name.")] = DERIVED
    path: Annotated[Path, INTERNAL] = Path()
    payload: Annotated[Payload, key("What is pressed: a mapping or a path.")]
    rig: Annotated[Rig, key("The rig: a mapping, a path or a profile's name.")]
    procedure: Annotated[Procedure, key("The load steps: a mapping or a path.")]
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
