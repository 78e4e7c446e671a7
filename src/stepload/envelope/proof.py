"""Whether the inertia of the tool passes for a touch."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan
from stepload.units import format_quantity


def heavy_tool_reasons(plan: Plan) -> Iterator[Reason]:
    """A warning where the tool's inertia may be mistaken for a touch, or for a pull (R11)."""
    mass_kg, touch_n = plan.rig.force.tool_mass_kg, plan.procedure.touch_force_n
    inertia_n = (mass_kg or 0.0) * plan.rig.arm.max_acceleration_m_s2
    if inertia_n >= touch_n:
        yield Reason(
            "tool_inertia", Severity.WARN,
            f"Accelerating the tool of {format_quantity(mass_kg or 0.0, 'kg')} may read"
            f" {format_quantity(inertia_n, 'N')}; {format_quantity(touch_n, 'N')} is a touch.",
            "raise procedure.touch_force above it, or leave it out",
            inertia_n, touch_n, "N", inertia_n / plan.procedure.top_force_n,
            "procedure.touch_force",
        )  # fmt: skip
