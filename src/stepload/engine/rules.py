"""The rules of the supervisor in one table: which channel, what stops, what to do, share of limit.

`explain`, docs/codes.md, docs/safety.md, the live view and its layout follow from `RULES`; values
and sources of the thresholds are those of `RunLimits`. The supervisor alone judges.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple

from stepload.engine.motion import SEARCHING
from stepload.engine.supervisor import Supervisor
from stepload.feasibility.limits import RunLimits
from stepload.record.rows import Phase

SAFETY = "safety.md"
SHOWN_NAMES = 3


class Look(NamedTuple):
    """A supervisor after it has judged the tick of `now_s`, the thresholds in use, the phase."""

    sup: Supervisor
    limits: RunLimits
    now_s: float
    phase: int


class Rule(NamedTuple):
    """A rule: its code, a name of a few words, the channels that it judges, and its texts.

    `means` says what stops the run, `do` what to do then, `page` is a page of docs/. `used` gives
    the share of its limit that is used, 1 where it trips, None where it does not judge now; R9 and
    R10 judge single samples and have none.
    """

    code: str
    name: str
    channel: str
    means: str
    do: str
    used: Callable[[Look], float | None] | None = None
    page: str = SAFETY

    @property
    def thresholds(self) -> dict[str, list[str]]:
        """The names of its thresholds, by their source."""
        found: dict[str, list[str]] = {}
        for each in fields(RunLimits):
            if self.code in each.metadata.get("rule", "").split(", "):
                found.setdefault(each.metadata["source"], []).append(each.name)
        return found


def margins(
    supervisor: Supervisor, limits: RunLimits, now_s: float, phase: int
) -> dict[str, float]:
    """The share of its limit that each rule has used, by its code, of those that judge now.

    R5 and R6 also wait for a time: they may stay at 1 or above for that long without a stop.
    """
    look = Look(supervisor, limits, now_s, phase)
    shares = {code: rule.used(look) for code, rule in RULES.items() if rule.used}
    return {code: share for code, share in shares.items() if share is not None}


def _share(value: float, limit: float) -> float:
    """Used share of a limit; where the limit is not positive, any positive value is 1."""
    return _largest(value / limit if limit > 0.0 else float(value > 0.0))


def _largest(*shares: float) -> float:
    """The largest share that is a number and positive, 0 where there is none."""
    return max((share for share in shares if share > 0.0), default=0.0)


def _force(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if not sup.tared:
        return None
    return _largest(
        math.hypot(sup.force_n, sup.force.across_n) / limits.force_limit_n,
        math.hypot(sup.force_n, sup.arm_across_n) / limits.force_limit_n,
        math.hypot(sup.second_n, sup.second.across_n) / limits.force_limit_n if sup.second else 0.0,
        abs(sup.second_n) / limits.second_limit_n if limits.cross_check else 0.0,
    )


def _predicted(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if not sup.tared:
        return None
    across_n = max(sup.force.across_n, sup.arm_across_n)
    return _largest(
        math.hypot(sup.predicted_n, across_n) / limits.force_limit_n,
        sup.second_predicted_n / limits.second_limit_n if limits.cross_check else 0.0,
    )


def _age(look: Look) -> float:
    sup, limits, now_s = look.sup, look.limits, look.now_s
    return _largest(
        (now_s - sup.force.receive_s) / limits.stale_force_s,
        (now_s - sup.arm.receive_s) / limits.stale_arm_s,
        (now_s - sup.second.receive_s) / limits.stale_second_s if sup.second else 0.0,
    )


def _frozen(look: Look) -> float:
    sup, limits = look.sup, look.limits
    return _largest(
        _share(sup.force.same, limits.identical_counts or math.inf),
        _share(sup.second.same, limits.second_identical_counts or math.inf) if sup.second else 0.0,
    )


def _difference(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if not (sup.tared and limits.cross_check):
        return None
    return _share(abs(sup.difference_n), limits.cross_limit_n(sup.smooth_n))


def _travel(look: Look) -> float | None:
    sup = look.sup
    if not sup.tared or look.phase != Phase.LOAD:
        return None
    return _share(sup.travel_m, sup.answers.limit_m())


def _position(look: Look) -> float:
    limits, motion, position_m = look.limits, look.sup.motion, look.sup.arm.position_m
    tolerance_m = limits.model_tolerance_m + limits.model_lag_s * motion.recent_m_s
    return _largest(
        _share(abs(position_m - motion.model_m), tolerance_m),
        motion.still_share(position_m),
        motion.waited_share(look.now_s),
    )


def _search(look: Look) -> float | None:
    if look.phase not in SEARCHING:
        return None
    return _largest(look.sup.arm.position_m / look.limits.search_end_m)


def _wrong_way(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if look.phase not in SEARCHING:
        return None
    return _largest(
        -sup.force_n / limits.touch_force_n,
        sup.force.smooth_across_n / sup.across_limit_n,
        sup.second.smooth_across_n / sup.second_across_limit_n if sup.second else 0.0,
    )


def _lateral(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if not (sup.tared and limits.lateral_share) or look.phase in SEARCHING:
        return None
    return _share(max(sup.wrench.share, sup.arm_wrench.share), limits.lateral_share)


def _overload(look: Look) -> float | None:
    if not look.limits.overload_named:
        return None
    return _largest(look.sup.overload.used, look.sup.second_overload.used)


def _eccentricity(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if not (sup.tared and limits.eccentricity_m) or look.phase in SEARCHING:
        return None
    return _share(sup.wrench.off_m, limits.eccentricity_m)


def _speed(look: Look) -> float | None:
    sup, limits = look.sup, look.limits
    if not sup.tared or look.phase != Phase.LOAD:
        return None
    return _share(sup.motion.speed_m_s * limits.contact_n_s_per_m, limits.cap_n(sup.smooth_n))


RULES = {
    rule.code: rule
    for rule in (
        Rule(
            "R1", "force", "both force channels, lateral force",
            "The force of a channel, lateral force included, exceeded its limit.",
            "Check the report: a spike without motion is the sensor;"
            " otherwise the payload is stiffer.",
            _force,
        ),
        Rule(
            "R2", "predicted peak", "both force channels, lateral force",
            "The predicted force of a channel would have passed its limit before the arm could"
            " stop.",
            "Press more slowly (load_rate), or correct the stiffness in the plan.",
            _predicted,
        ),
        Rule(
            "R3", "age of samples", "each sensor, arm",
            "A device sent no new sample within its age limit.",
            "Check cables, power, network and computer load; run `stepload doctor`.",
            _age,
        ),
        Rule(
            "R4", "frozen readings", "each sensor, arm",
            "Samples were not finite, beyond full scale, flagged by the device, or frozen.",
            "Check the sensor and its supply; state the noise that it has.",
            _frozen,
        ),
        Rule(
            "R5", "channels differ", "both force channels",
            "The two force channels disagreed for longer than the plan allows.",
            "Find the wrong one by a push by hand (`stepload setup`) before changing a sign.",
            _difference,
        ),
        Rule(
            "R6", "no force response", "force, target",
            "The arm moved on without the rise in force that the softest payload stated would"
            " give.",
            "Check for other contact and a dead sensor; state the piece's true modulus.",
            _travel,
        ),
        Rule(
            "R7", "arm off its model", "arm position",
            "The arm's measured position does not follow its commands.",
            "Check the arm's display, the speed slider, and obstacles.",
            _position,
        ),
        Rule(
            "R8", "search distance", "arm position",
            "The search ended and no surface was found.",
            "Check surface_distance, search_distance, the start pose and the tool's direction.",
            _search, "plan.md",
        ),
        Rule(
            "R9", "force jump", "force",
            "The force jumped, or fell or rose in contact with one channel, without a motion that"
            " explains it.",
            "Check the cable and the grip, then repeat.",
        ),
        Rule(
            "R10", "sequence and clock", "each sensor, arm",
            "Samples came out of order, from the future, or with a clock that ran away.",
            "Look at the device and its link; report it if it happens again.",
        ),
        Rule(
            "R11", "wrong way", "force, lateral force",
            "In the approach the force grew the wrong way: wrong sign, wrong axis, or a pull on"
            " the tool.",
            "Push by hand on the tool with `stepload setup` and correct axis and sign.",
            _wrong_way, "setup.md",
        ),
        Rule(
            "R12", "lateral force", "lateral force, the arm's own wrench",
            "The lateral force was too large a share of the force, or too large for the payload.",
            "Align tool and plate, reduce friction, or choose a pose with `stepload pose`.",
            _lateral,
        ),
        Rule(
            "R13", "sensor overload", "wrench of each force sensor",
            "A force or torque of the sensor reached 80 % of its rating.",
            "Use a shorter tool, a larger sensor, or a lower top force.",
            _overload,
        ),
        Rule(
            "R14", "contact off the axis", "torques of the force sensor",
            "The plate was touched too far from the pressing axis of the force sensor.",
            "Check how payload and tool are mounted, the start pose, and rig.force.lever.",
            _eccentricity,
        ),
        Rule(
            "CAP", "speed in contact", "target",
            "The arm was faster in contact than a hidden hard stop would allow.",
            "Report it: the controller should never command that.",
            _speed,
        ),
    )
}  # fmt: skip
"""Every rule by its code, in the order of their numbers."""


def table() -> str:
    """The table of docs/safety.md, as Markdown."""
    lines = ["| rule | channel | what stops the run | threshold: from |", "|---|---|---|---|"]
    for rule in RULES.values():
        origins = []
        for source, names in rule.thresholds.items():
            shown = names if len(names) <= SHOWN_NAMES else (names[0], "…", names[-1])
            told = ", ".join(name if name == "…" else f"`{name}`" for name in shown)
            origins.append(f"{told}: {source}")
        lines.append(f"| {rule.code} | {rule.channel} | {rule.means} | {'<br>'.join(origins)} |")
    return "\n".join(lines)


def with_table(text: str) -> str:
    """A page with its table of rules made anew."""
    return re.sub(
        "(<!-- rules -->\n).*?(\n<!-- end -->)", lambda m: m[1] + table() + m[2], text,
        flags=re.DOTALL,
    )  # fmt: skip


if __name__ == "__main__":
    page = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/safety.md")
    page.write_text(with_table(page.read_text(encoding="utf-8")), encoding="utf-8")
