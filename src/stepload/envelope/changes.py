"""Possible changes of a plan against a refusal or a warning, the mildest first.

Every figure is rounded as it is printed before it is tried: what is tried is what is printed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from stepload.contact.limit_doubt import doubted_limits
from stepload.envelope.bounds import LOAD_TIMEOUTS
from stepload.envelope.reason import Reason
from stepload.envelope.theory import theory_of
from stepload.estimators.identifiability import gauge_resolution_for
from stepload.plan.changed import follows, rederived
from stepload.plan.checks_between import least_touch_force
from stepload.plan.model import DisplacementSpec, Plan, SecondForce, SecondForceSource
from stepload.units import format_quantity, parse_quantity

DOWN = (0.999, 0.95, 0.9, 0.75, 0.5, 0.3, 0.2, 0.1)
UP = (1.1, 1.25, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
FINER = (0.5, 0.2, 0.1, 0.03)
KNOWN = (0.04, 0.03, 0.02, 0.01)
"""Relative standard uncertainties of a yield strength that was measured."""
AGREE_N = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2)
"""Absolute tolerances of a second force channel; the relative one is `AGREE`."""
AGREE = 0.02


DEPTH_POWERS = {"deep_contact": 1.5, "tip_exceeded": 1.5, "thin_payload": 3.0}
"""Exponents of force over deformation, and over contact radius, of a sphere."""


@dataclass(frozen=True, slots=True)
class Change:
    """One change: what to do, in words, and how the plan after it is made."""

    text: str
    make: Callable[[], Plan]


Family = Callable[[Plan, Reason], Iterator[Change]]
"""Changes of one kind, the mildest first."""


def _floor(value: float) -> float:
    """`value` rounded down to three significant digits."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / digit * (1.0 + 1e-12)) * digit


def _written(value: float, unit: str) -> tuple[str, float]:
    """`value` to three digits as it is printed, and what it is when it is read back."""
    text = format_quantity(value, unit)
    return text, parse_quantity(text, unit)


def _changed(plan: Plan, section: str, **values: Any) -> Callable[[], Plan]:
    part = getattr(plan, section)
    return lambda: rederived(plan, replace(plan, **{section: replace(part, **values)}))


def _on_rig(plan: Plan, part: str, **values: Any) -> Callable[[], Plan]:
    return _changed(plan, "rig", **{part: replace(getattr(plan.rig, part), **values)})


def with_top(plan: Plan, top_n: float) -> Change:
    """The plan with another top force; step, levels and secant force are adapted, and named."""
    text, top_n = _written(top_n, "N")
    procedure, identify = plan.procedure, plan.identify
    verb = "reduce" if top_n < procedure.top_force_n else "raise"
    values: dict[str, Any] = {"top_force_n": top_n}
    words = [f"{verb} top_force to {text}"]
    if follows(plan, "procedure", "levels_n"):
        if procedure.step_n > top_n:
            step, values["step_n"] = _written(_floor(top_n / 2.0), "N")
            words.append(f"step to {step}")
    else:
        below = (level for level in procedure.levels_n if level < top_n)
        values["levels_n"] = (*below, top_n)
        words.append(f"end the levels with {text}")
    if not follows(plan, "identify", "secant_force_n") and identify.secant_force_n > top_n:
        plan = replace(plan, identify=replace(identify, secant_force_n=top_n))
        words.append(f"identify.secant_force to {text}")
    return Change(" and ".join(words), _changed(plan, "procedure", **values))


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
        if 0.0 < _floor(share * most_n) < top_n:
            yield with_top(plan, _floor(share * most_n))


def higher_top(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in UP:
        yield with_top(plan, _floor(factor * plan.procedure.top_force_n))


def touch(plan: Plan, reason: Reason) -> Iterator[Change]:
    """A touch force that noise does not reach, or one that leaves more of the force budget."""
    now_n, least_n = plan.procedure.touch_force_n, least_touch_force(plan.rig.force.noise_n)
    for touch_n in (1.02 * least_n, 1.5 * least_n, 0.75 * now_n, 0.5 * now_n, 0.3 * now_n):
        text, value_n = _written(touch_n, "N")
        if value_n >= least_n and value_n != now_n:
            verb = "raise" if value_n > now_n else "lower"
            yield Change(
                f"{verb} touch_force to {text}",
                _changed(plan, "procedure", touch_force_n=value_n),
            )


def quieter_sensor(plan: Plan, reason: Reason) -> Iterator[Change]:
    force = plan.rig.force
    for share in FINER:
        noise, noise_n = _written(share * force.noise_n, "N")
        fine, fine_n = _written(share * force.resolution_n, "N")
        yield Change(
            f"use a force sensor with a noise of {noise} and a resolution of {fine}",
            _on_rig(plan, "force", noise_n=noise_n, resolution_n=fine_n),
        )


def second_channel(plan: Plan, reason: Reason) -> Iterator[Change]:
    """A second force channel, or one that agrees better with the first."""
    second = plan.rig.second_force
    has_second = second.source is not SecondForceSource.NONE
    for tolerance_n in AGREE_N:
        if has_second and tolerance_n >= second.tolerance_n:
            continue
        text, tolerance_n = _written(tolerance_n, "N")
        words = "use a second force channel" if has_second else "declare a second force channel"
        better = (
            replace(second, tolerance_n=tolerance_n)
            if has_second
            else SecondForce(SecondForceSource.ARM, tolerance_n, AGREE, noise_n=0.1 * tolerance_n)
        )
        relative = better.tolerance_relative
        yield Change(
            f"{words} that agrees with the first within {text} + {relative * 100.0:.2g} %",
            _changed(plan, "rig", second_force=better),
        )


def fuse(plan: Plan, reason: Reason) -> Iterator[Change]:
    if plan.rig.mechanical_fuse_n is None:
        text, fuse_n = _written(1.2 * plan.procedure.top_force_n, "N")
        yield Change(
            f"declare a mechanical fuse that opens at {text}",
            _changed(plan, "rig", mechanical_fuse_n=fuse_n),
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
            f"measure the yield strength of {names} to ± {share * 100.0:g} % and write it so",
            _changed(plan, "payload", **known),
        )


def stronger_arm(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in (1.05, *UP[:6]):
        text, push_n = _written(factor * plan.procedure.top_force_n, "N")
        if push_n > plan.rig.arm.max_push_n:
            yield Change(f"use an arm that pushes {text}", _on_rig(plan, "arm", max_push_n=push_n))


def larger_sensor(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in UP[:6]:
        text, range_n = _written(factor * plan.procedure.top_force_n, "N")
        if range_n > plan.rig.force.range_n:
            yield Change(
                f"use a force sensor with a range of {text} that is as quiet",
                _on_rig(plan, "force", range_n=range_n),
            )


def finer_arm(plan: Plan, reason: Reason) -> Iterator[Change]:
    for share in FINER:
        text, fine_m = _written(share * plan.rig.arm.position_resolution_m, "m")
        yield Change(
            f"use an arm with a position resolution of {text}",
            _on_rig(plan, "arm", position_resolution_m=fine_m),
        )


def softer_arm(plan: Plan, reason: Reason) -> Iterator[Change]:
    system = plan.rig.system_stiffness
    for share in FINER:
        text, value = _written(share * system.stiffness_n_per_m, "N/m")
        softer = replace(
            system,
            stiffness_n_per_m=value,
            sigma_n_per_m=system.sigma_n_per_m * value / system.stiffness_n_per_m,
        )
        yield Change(
            f"use an arm with a system stiffness of {text}",
            _changed(plan, "rig", system_stiffness=softer),
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
        text, fine_m = _written(_floor(share * just_m), "m")
        now = plan.rig.displacement
        driver = now.driver if now else plan.rig.arm.driver
        rate_hz = now.rate_hz if now else plan.rig.arm.rate_hz
        yield Change(
            f"use a displacement gauge across the contact with a resolution of {text}",
            _changed(
                plan, "rig", displacement=DisplacementSpec(driver, rate_hz, fine_m, 0.2 * fine_m)
            ),
        )


def accept(plan: Plan, reason: Reason) -> Iterator[Change]:
    yield Change(
        "accept it in writing with identify.accept_unidentifiable",
        _changed(plan, "identify", accept_unidentifiable="accepted"),
    )


def longer_search(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in (1.2, 1.5):
        text, value_m = _written(factor * reason.value, "m")
        yield Change(
            f"raise search_distance to {text}",
            _changed(plan, "procedure", search_distance_m=value_m),
        )


def more_patience(plan: Plan, reason: Reason) -> Iterator[Change]:
    for factor in (3.0, 5.0):
        text, value_s = _written(factor * reason.value / LOAD_TIMEOUTS, "s")
        yield Change(
            f"raise settle_timeout to {text}",
            _changed(plan, "procedure", settle_timeout_s=value_s),
        )


FAMILIES: dict[str, tuple[Family, ...]] = {
    "top_force_above_safe_limit": (
        lower_top, known_strength, second_channel, quieter_sensor, stronger_arm, larger_sensor,
    ),
    "no_safe_way_to_press": (
        touch, higher_top, quieter_sensor, second_channel, fuse, finer_arm, softer_arm, lower_top,
    ),
    "arm_too_weak": (lower_top, stronger_arm),
    "sensor_range": (lower_top, larger_sensor),
    "unidentifiable": (gauge, higher_top, lower_top, finer_arm, accept),
    "close_to_k_max": (gauge, higher_top, lower_top, finer_arm),
    "unidentifiable_accepted": (gauge, higher_top, lower_top, finer_arm),
    "deep_contact": (lower_top,),
    "tip_exceeded": (lower_top,),
    "thin_payload": (lower_top,),
    "search_short": (longer_search,),
    "slow_steps": (more_patience,),
    "one_channel_soft": (second_channel,),
    "one_force_channel": (second_channel,),
}  # fmt: skip
"""Families of changes that could help, by the code of a reason; the easiest first."""
