"""How axis and sign of each force channel were checked: by a push by hand, or not."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import ForceSpec, Plan, SecondForce, SecondForceSource
from stepload.units import format_quantity


def heavy_tool_reasons(plan: Plan) -> Iterator[Reason]:
    """A warning where the tool's inertia may be mistaken for a touch, or for a pull (R11)."""
    mass_kg, touch_n = plan.rig.force.tool_mass_kg, plan.procedure.touch_force_n
    inertia_n = (mass_kg or 0.0) * plan.rig.arm.max_acceleration_m_s2
    if inertia_n >= touch_n:
        yield Reason(
            "tool_inertia", Severity.WARN,
            f"accelerating the tool of {format_quantity(mass_kg or 0.0, 'kg')} may take"
            f" {format_quantity(inertia_n, 'N')}, and {format_quantity(touch_n, 'N')} count as a"
            " touch, or as a pull that stops the run (R11)",
            "raise procedure.touch_force above it, or leave it out",
            inertia_n, touch_n, "N",
        )  # fmt: skip


def unproven(plan: Plan) -> list[str]:
    """Force channels whose axis and sign no push by hand has checked, each with the reason."""
    force, second = plan.rig.force, plan.rig.second_force
    found = [] if pushed(force) else [f"rig.force: {_why(force)}"]
    if second.source is not SecondForceSource.NONE and not pushed(second):
        found.append(f"rig.second_force: {_why(second)}")
    return found


def pushed(channel: ForceSpec | SecondForce) -> bool:
    """Whether a push by hand has proven the channel, and is not too old."""
    return channel.pushed_on is not None and not channel.push_problem


def _why(channel: ForceSpec | SecondForce) -> str:
    return channel.push_problem or "no push by hand has checked its axis and sign"
