"""What the keys of a written plan mean and where their values are found, as comments."""

from __future__ import annotations

from collections.abc import Mapping

from stepload.declaration.sections import keys as keys_of
from stepload.plan.model import IdentifyPlan, Procedure, RecordPlan

_BODY = {
    "youngs_modulus": "E: data sheet; where it is not known a range, 1 GPa to 5 GPa",
    "poisson_ratio": "ν: data sheet; metals 0.27 to 0.35, plastics 0.3 to 0.45, rubber 0.49",
    "yield_strength": "Y: data sheet. F_c goes with its third power: write ± what it is known to",
}
NOTES: dict[str, str] = {
    "stepload": "Version of the plan format. All keys: docs/plan.md, or `stepload schema`",
    "payload": "What is pressed, and against what",
    "payload.name": "What it is called in reports; one piece of many: record.specimen below",
    "payload.geometry": "Shape where it touches the plate",
    "payload.geometry.radius": "At the contact: drawing, radius gauge, or half the diameter",
    "payload.material": "Of the payload: the numbers of its data sheet, with ± where it tells it",
    **{f"payload.material.{key}": note for key, note in _BODY.items()},
    "payload.plate": "What it is pressed onto: stiff, flat, and strong enough not to be marked",
    "payload.force_limit": "F_c: the maker's figure, or what a twin bore before it yielded",
    "rig": "A rig file (`stepload setup`) or a profile (`stepload profiles`)",
    "procedure": "How it is pressed",
    "procedure.surface_distance": "From the start pose to the payload's touch: lead the arm there,"
    " or a ruler",
    "procedure.surface_uncertainty": "How wrong that may be: what the ruler and the mounting leave",
    "procedure.step": "Each level is this much above the one before",
    "procedure.top_force": "The highest level; preflight refuses what F_c does not allow",
}
"""Comments by dotted key."""

_SECTIONS = {"procedure": Procedure, "identify": IdentifyPlan, "record": RecordPlan}
_OFFERED = ("hold", "cycles", "unload", "touches", "secant_force", "specimen", "batch", "operator")
_EXAMPLES = {
    "secant_force": "100 N", "specimen": '"A-17"', "batch": '"2025-03"', "operator": "A. Tester",
}  # fmt: skip


def offered(given: Mapping[str, object]) -> list[str]:
    """Comments with keys that a plan leaves out and that are often wanted."""
    lines = ["", "# Often wanted, with what is taken otherwise or an example; take the # away:"]
    for section, kind in _SECTIONS.items():
        offer = [key for key in keys_of(kind) if key.name in _OFFERED]
        keys = [key for key in offer if f"{section}.{key.name}" not in given]
        here = section in {each.partition(".")[0] for each in given}
        lines += [f"# {section}:" + (" (above)" if here else "")] if keys else []
        for key in keys:
            default = key.default_text
            shown = str(default).lower() if isinstance(default, bool) else default
            value = _EXAMPLES.get(key.name, shown)
            lines.append(f"#   {key.name}: {value}  # {key.meaning}")
    return lines
