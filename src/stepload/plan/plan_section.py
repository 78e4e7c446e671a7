"""The keys of a plan: procedure, identification, record, and the plan as a whole."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from stepload.plan.fields import (
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
    Number,
    Quantity,
    Remark,
    Temperature,
)
from stepload.plan.introspect import default_text, sections_below
from stepload.plan.payload_section import PayloadSection, Section
from stepload.plan.rig_section import RigSection


class ProcedureSection(Section):
    """The load steps. Inline, or the path of a file that holds these keys."""

    top_force: Force = Field(description="Highest load.")
    step: Force | None = Field(default=None, description="Load step; give this or `levels`.")
    levels: list[Force] | None = Field(
        default=None, description="Every load level, rising, the last one `top_force`."
    )
    load_rate: ForceRate | None = Field(
        default=None,
        description="How fast the force rises and falls at the most; default: the largest step in "
        "one second. Lag and damping spoil data of faster ramps.",
    )
    hold: Duration = Field(
        default=3.0, description="How long each level is held once it has settled."
    )
    unload: Flag = Field(
        default=True, description="Whether the levels are also held on the way down."
    )
    cycles: Annotated[int, Number(1, 1000, integer=True)] = Field(
        default=1, description="How often the payload is loaded and unloaded."
    )
    lift_off: Flag = Field(
        default=True,
        description="Whether cycles part the contact (seating), or unload to `unload_fraction` "
        "only (shakedown).",
    )
    unload_fraction: Annotated[float, Quantity("%", 0.01, 0.5)] = Field(
        default=0.05, description="Share of `top_force` kept between cycles without lift-off."
    )
    surface_distance: Length = Field(
        description="Travel from the start pose to where the surface is expected."
    )
    surface_uncertainty: Length = Field(
        default=1e-3, description="How wrong `surface_distance` may be, either way."
    )
    search_distance: Length | None = Field(
        default=None,
        description="Travel beyond the nearest possible surface after which the search ends; "
        "default: 1.5 times the width of the uncertain band, and twice the travel from the surface "
        "to `touch_force`.",
    )
    touch_force: Force | None = Field(
        default=None,
        description="Force that counts as contact; default: 1 % of `top_force`, at least 1 N, two "
        "force resolutions and six times the force noise, quantisation included.",
    )
    touches: Annotated[int, Number(1, 100, integer=True)] = Field(
        default=3, description="How often the surface is touched before loading."
    )
    retract: Length | None = Field(
        default=None,
        description="Distance to move away from the contact; default: 0.5 mm, or twice the "
        "elastic travel at `top_force` where that is more.",
    )
    tare: Duration = Field(default=10.0, description="Time over which the force zero is taken.")
    warm_up: DurationOrZero = Field(default=2.0, description="Wait before the first tare.")
    max_drift: Force | None = Field(
        default=None,
        description="Shift of the force zero over the run that flags it; default: 1 % of "
        "`top_force`, at least 1 N and three force resolutions.",
    )
    settle_timeout: Duration = Field(
        default=10.0, description="Longest wait for a level to settle."
    )


class IdentifySection(Section):
    """How the data become a result."""

    kind: Annotated[str, Choice(("payload", "system"))] = Field(
        default="payload",
        description="Identify the payload (K, n), or the system stiffness of the rig.",
    )
    secant_force: Force | None = Field(
        default=None,
        description="Force at which the secant is reported; default: 300 N or `top_force`.",
    )
    p: Annotated[float, Number(1.0, 100.0)] = Field(
        default=2.0, description="Multiple of the position resolution lost at the zero (29)."
    )
    s: Annotated[float, Number(1.0, 1000.0)] = Field(
        default=20.0, description="Quality of the compensation of K_s: known to 1/s (30)."
    )
    t: Annotated[float, Number(1.0, 1000.0)] = Field(
        default=5.0, description="Accuracy asked for: deformation to 1/t (31)."
    )
    accept_unidentifiable: Remark = Field(
        default="", description="A reason, in words, to run a payload that is beyond K_max."
    )
    temperature: Temperature | None = Field(
        default=None, description="Temperature of the run; compared with the calibration record."
    )


class RecordSection(Section):
    """Where the record goes and what it says."""

    directory: FilePath = Field(default="runs", description="Directory of the runs, no `..` in it.")
    notes: Note = Field(default="", description="Anything worth keeping with the record.")
    operator: Remark = Field(default="", description="Who runs it.")


class PlanSection(Section):
    """A plan: one experiment."""

    stepload: Literal[1] = Field(description="Version of the plan format.")
    name: Name | None = Field(
        default=None, description="Name of the experiment; default: the file's."
    )
    payload: PayloadSection = Field(description="What is pressed: a mapping or a path.")
    rig: RigSection = Field(description="With what: a mapping, a path, or a profile's name.")
    procedure: ProcedureSection = Field(description="How: a mapping or a path.")
    identify: IdentifySection = Field(
        default_factory=IdentifySection, description="How the data become a result."
    )
    record: RecordSection = Field(
        default_factory=RecordSection, description="Where the record goes."
    )


def json_schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a plan file, for editors.

    It knows keys, types and units; what only `load_plan` can see (files, other keys) it does not.
    Since a rig may take any key from a profile, no key of a rig is required here.
    """
    schema = PlanSection.model_json_schema()
    definitions = schema["$defs"]
    for model in sections_below(PlanSection):
        properties = definitions.get(model.__name__, schema)["properties"]
        for name, field in model.model_fields.items():
            properties[name].pop("title", None)
            properties[name].pop("default", None)
            if (default := default_text(field)) is not None:
                properties[name]["default"] = default
    for name in ("Rig", "Arm", "Force", "Displacement"):
        definitions[f"{name}Section"].pop("required", None)
    for key in ("payload", "rig", "procedure"):
        inline = schema["properties"][key]
        note = inline.pop("description")
        path = {"type": "string", "minLength": 1}
        schema["properties"][key] = {"anyOf": [inline, path], "description": note}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
