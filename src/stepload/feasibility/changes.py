"""Possible changes of a plan against a refusal or a warning, the mildest first.

Every figure is rounded as it is printed before it is tried: what is tried is what is printed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from stepload.contact.limit_uncertainty import doubted_limits
from stepload.contact.materials import BluntTip, Sphere
from stepload.feasibility.bounds import LOAD_TIMEOUTS
from stepload.feasibility.reason import Reason
from stepload.feasibility.theory import theory_of
from stepload.identification.identifiability import gauge_resolution_for
from stepload.plan.checks import least_touch_force
from stepload.plan.derived import follows, rederived
from stepload.plan.model import DisplacementSpec, Plan, SecondForce, SecondForceSource
from stepload.units import format_quantity, parse_quantity, percent, rounded_down

DOWN = (1.0, 0.999, 0.95, 0.9, 0.75, 0.5, 0.3, 0.2, 0.1)
UP = (1.1, 1.25, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
KNOWN = (0.04, 0.03, 0.02, 0.01)
"""Relative standard uncertainties of a yield strength that was measured."""
AGREE_N = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2)
"""Absolute tolerances of a second force channel; the relative one is `AGREE`."""
AGREE = 0.02


DEPTH_POWERS = {"deep_contact": 1.5, "tip_exceeded": 1.5, "thin_payload": 3.0}
"""Exponents of force over deformation, and over contact radius, of a sphere."""


@dataclass(frozen=True, slots=True)
class Change:
    """One change: what to do, how the plan after it is made, the plan's key that it changes."""

    text: str
    make: Callable[[], Plan]
    key: str = ""


Family = Callable[[Plan, Reason], Iterator[Change]]
"""Changes of one kind, the mildest first."""


def _ceil(value: float) -> float:
    """`value` rounded up to two significant digits."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / digit * (1.0 - 1e-12)) * digit


def _written(value: float, unit: str) -> tuple[str, float]:
    """`value` to three digits as it is printed, and what it is when it is read back."""
    text = format_quantity(value, unit)
    return text, parse_quantity(text, unit)


def _changed(plan: Plan, section: str, **values: Any) -> Callable[[], Plan]:
    part = getattr(plan, section)
    return lambda: rederived(plan, replace(plan, **{section: replace(part, **values)}))


def _of_procedure(plan: Plan, key: str, unit: str, value: float) -> Change:
    """The plan with another value of a key of its procedure, rounded as it is printed."""
    text, value = _written(value, unit)
    make = _changed(plan, "procedure", **{f"{key}_{unit.lower()}": value})
    return Change(f"{key}: {text}", make, f"procedure.{key}")


def with_top(plan: Plan, top_n: float) -> Change:
    """The plan with another top force; step, levels and secant force are adapted, and named."""
    text, top_n = _written(top_n, "N")
    procedure, identify = plan.procedure, plan.identify
    values: dict[str, Any] = {"top_force_n": top_n}
    words = [f"top_force: {text}"]
    if follows(plan, "procedure", "levels_n"):
        if procedure.step_n > top_n:
            step, values["step_n"] = _written(rounded_down(top_n / 2.0), "N")
            words.append(f"step: {step}")
    else:
        below = (level for level in procedure.levels_n if level < top_n)
        values["levels_n"] = (*below, top_n)
        words.append(f"levels up to {text}")
    if not follows(plan, "identify", "secant_force_n") and identify.secant_force_n > top_n:
        plan = replace(plan, identify=replace(identify, secant_force_n=top_n))
        words.append(f"secant_force: {text}")
    key = "procedure.top_force"
    return Change(", ".join(words), _changed(plan, "procedure", **values), key)


def lower_top(plan: Plan, reason: Reason) -> Iterator[Change]:
    """Top forces below what the reason says is too much."""
    top_n = plan.procedure.top_force_n
    most_n = top_n
    if reason.unit == "N":
        most_n = reason.limit if reason.limit > 0.0 else theory_of(plan.payload).counted.lower_n
    if reason.code in DEPTH_POWERS:
        most_n = top_n * (reason.limit / reason.value) ** DEPTH_POWERS[reason.code]
    # No line of advice names a force above the part of F_c that may be counted on.
    most_n = min(most_n, theory_of(plan.payload).counted.lower_n)
    for share in DOWN:
        if 0.0 < rounded_down(share * most_n) < top_n:
            yield with_top(plan, rounded_down(share * most_n))


def higher_top(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in UP:
        yield with_top(plan, rounded_down(factor * plan.procedure.top_force_n))


def touch(plan: Plan, reason: Reason) -> Iterator[Change]:
    """A touch force that noise does not reach, or one that leaves more of the force budget."""
    now_n, least_n = plan.procedure.touch_force_n, least_touch_force(plan.rig.force.noise_n)
    for touch_n in (1.02 * least_n, 1.5 * least_n, 0.75 * now_n, 0.5 * now_n, 0.3 * now_n):
        if least_n <= _written(touch_n, "N")[1] != now_n:
            yield _of_procedure(plan, "touch_force", "N", touch_n)


def second_channel(plan: Plan, reason: Reason) -> Iterator[Change]:
    """The arm's own force as a second channel, or one that is measured to agree more closely."""
    now = plan.rig.second_force
    for tolerance_n in AGREE_N:
        text, tolerance_n = _written(tolerance_n, "N")
        if now.source is not SecondForceSource.NONE:
            if tolerance_n < now.tolerance_n:
                yield Change(
                    f"second_force.tolerance: {text}, if both channels agree within that",
                    _changed(plan, "rig", second_force=replace(now, tolerance_n=tolerance_n)),
                    "rig.second_force.tolerance",
                )
            continue
        ratio = percent(AGREE, 2)
        second = SecondForce(SecondForceSource.ARM, tolerance_n, AGREE, noise_n=0.1 * tolerance_n)
        yield Change(
            f"the arm's own force as second_force, if it agrees within {text} + {ratio}",
            _changed(plan, "rig", second_force=second),
            "rig.second_force",
        )


def known_strength(plan: Plan, reason: Reason) -> Iterator[Change]:
    """The yield strengths measured, where a handbook's uncertainty was assumed."""
    payload = plan.payload
    bodies = {"material": payload.material, "plate": payload.plate}
    assumed = {
        key: body
        for key, body in bodies.items()
        if body.yield_strength_pa is not None and body.yield_strength_sigma_pa is None
    }
    if not assumed or not doubted_limits(payload.geometry, payload.material, payload.plate):
        return
    for share in KNOWN:
        known: dict[str, Any] = {
            key: replace(body, yield_strength_sigma_pa=share * (body.yield_strength_pa or 0.0))
            for key, body in assumed.items()
        }
        names = " and ".join(dict.fromkeys(body.name for body in assumed.values()))
        yield Change(
            f"measure the yield strength of {names} to ± {share * 100.0:g} %",
            _changed(plan, "payload", **known),
        )


def gauge(plan: Plan, reason: Reason) -> Iterator[Change]:
    """A gauge across the contact that takes K_s out of the chain (36)."""
    identify = plan.identify
    just_m = gauge_resolution_for(
        reason.value,
        plan.procedure.top_force_n,
        p=identify.resolution_multiple_p,
        t=identify.accuracy_t,
    )
    for share in (0.8, 0.4):
        text, fine_m = _written(rounded_down(share * just_m), "m")
        now = plan.rig.displacement
        of = now or plan.rig.arm
        finer = DisplacementSpec(
            driver=of.driver, options=of.options, rate_hz=of.rate_hz,
            resolution_m=fine_m, noise_m=0.2 * fine_m,
        )  # fmt: skip
        yield Change(
            f"a displacement gauge across the contact, resolution {text}",
            _changed(plan, "rig", displacement=finer),
            "rig.displacement",
        )


def accept(plan: Plan, reason: Reason) -> Iterator[Change]:
    yield Change(
        "accept it in writing: identify.accept_unidentifiable",
        _changed(plan, "identify", accept_unidentifiable="accepted"),
        "identify.accept_unidentifiable",
    )


def longer_search(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in (1.2, 1.5):
        yield _of_procedure(plan, "search_distance", "m", factor * reason.value)


def more_patience(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in (3.0, 5.0):
        yield _of_procedure(plan, "settle_timeout", "s", factor * reason.value / LOAD_TIMEOUTS)


def blunter(plan: Plan, reason: Reason) -> Iterator[Change]:
    """A larger radius: F_c grows with its square, and theory holds up to more force."""
    geometry = plan.payload.geometry
    if not isinstance(geometry, (Sphere, BluntTip)):
        return
    used_n, least = theory_of(plan.payload).counted.lower_n, 1.0
    if reason.unit == "N" and used_n > 0.0:
        least = max(1.0, math.sqrt(plan.procedure.top_force_n / used_n))
    for factor in UP:
        text, radius_m = _written(_ceil(least * factor * geometry.radius_m), "m")
        kind = getattr(geometry, "kind", "sphere").removesuffix("_tip")
        yield Change(
            f"a blunter {kind}, radius {text}",
            _changed(plan, "payload", geometry=replace(geometry, radius_m=radius_m)),
            "payload.geometry.radius",
        )


FAMILIES: dict[str, tuple[Family, ...]] = {
    "top_force_above_safe_limit": (lower_top, known_strength, second_channel, blunter),
    "no_safe_way_to_press": (touch, higher_top, second_channel, lower_top),
    "arm_too_weak": (lower_top,),
    "sensor_range": (lower_top,),
    "unidentifiable": (gauge, higher_top, lower_top, accept),
    "close_to_k_max": (gauge, higher_top, lower_top),
    "unidentifiable_accepted": (gauge, higher_top, lower_top),
    "deep_contact": (lower_top, blunter),
    "tip_exceeded": (lower_top, blunter),
    "thin_payload": (lower_top,),
    "search_short": (longer_search,),
    "slow_steps": (more_patience,),
    "one_channel_soft": (second_channel,),
}
"""Families of changes that could help, by the code of a reason; the easiest first."""
