"""How axis and sign of each force channel are proven: by its inertia, by a push, or not."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.envelope.reason import Reason, Severity
from stepload.envelope.shake import HALF_WIDTH, LONGEST_S, Shake
from stepload.plan.model import ForceSpec, Plan, SecondForce, SecondForceSource
from stepload.units import format_quantity


def shake_reasons(plan: Plan, shake: Shake | None) -> Iterator[Reason]:
    """Why a shake cannot measure the masses that a plan states, or how it moves if it can."""
    if shake is None:
        return
    yield from _heavy(plan)
    if shake.tells:
        behind_m = 2.0 * plan.procedure.retract_m + shake.travel_m
        yield Reason(
            "shake", Severity.NOTE,
            f"before the approach the arm shakes by {format_quantity(shake.travel_m, 'm')} behind"
            f" the place of the zero, {shake.cycles} cycles that count at"
            f" {1.0 / shake.period_s:.3g} Hz: each force channel whose tool_mass is stated must"
            " feel it",
            f"keep {format_quantity(behind_m, 'm')} behind the start pose free",
        )  # fmt: skip
        for other in shake.untold:
            yield from _useless(other)
    else:
        yield from _useless(shake)


def _heavy(plan: Plan) -> Iterator[Reason]:
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


def _useless(shake: Shake) -> Iterator[Reason]:
    """Warnings for channels whose mass a shake cannot measure."""
    for channel, half_width in zip(shake.channels, shake.half_widths, strict=True):
        inertia_n = channel.mass_kg * shake.acceleration_m_s2
        if half_width <= 0.5 * HALF_WIDTH and shake.visible(channel):
            continue
        if not shake.visible(channel):
            why = f"its resolution is {format_quantity(channel.resolution_n, 'N')}"
        elif half_width < float("inf"):
            why = (
                f"beside a noise of {format_quantity(channel.noise_n, 'N')} a shake of"
                f" {LONGEST_S:g} s would tell the mass to ±{half_width:.0%}, and"
                f" ±{0.5 * HALF_WIDTH:.0%} are planned for"
            )
        else:
            why = (
                f"a travel of {format_quantity(shake.travel_m, 'm')} is lost in the arm's positions"
            )
        yield Reason(
            "shake_tells_nothing", Severity.WARN,
            f"no shake proves the {channel.name}: {format_quantity(channel.mass_kg, 'kg')} at the"
            f" {format_quantity(shake.acceleration_m_s2, 'm/s^2')} that the arm may make are"
            f" {format_quantity(inertia_n, 'N')}; {why}",
            f"push by hand on the tool (stepload setup), and state {channel.key}.pushed_on",
            inertia_n, channel.noise_n, "N",
        )  # fmt: skip


def unproven(plan: Plan, shake: Shake | None) -> list[str]:
    """Force channels whose axis and sign are not proven, each with the reason, in words.

    A second channel needs no proof of its own where the run itself proves the first: it is compared
    with that one from the touch on (R5).
    """
    shaken = {c.second for c in shake.channels} if shake is not None and shake.tells else set()
    force, second = plan.rig.force, plan.rig.second_force
    found = []
    if False not in shaken and not pushed(force):
        found.append(f"rig.force: {_why(force)}")
    has_second = second.source is not SecondForceSource.NONE
    if has_second and not shaken and not pushed(second):
        found.append(f"rig.second_force: {_why(second)}")
    return found


def pushed(channel: ForceSpec | SecondForce) -> bool:
    """Whether a push by hand has proven the channel, and is not too old."""
    return channel.pushed_on is not None and not channel.push_problem


def _why(channel: ForceSpec | SecondForce) -> str:
    return channel.push_problem or (
        "no push by hand has proven its axis and sign"
        + ("" if channel.tool_mass_kg is None else ", and no shake can")
    )
