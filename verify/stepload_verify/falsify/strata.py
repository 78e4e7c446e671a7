"""The strata of a search: each fault × phase in which it begins × class of rig."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from stepload.errors import BadInputError
from stepload_verify.campaign.mishaps import FIRST_DAY
from stepload_verify.campaign.scenario import SIX_AXES, known_kinds
from stepload_verify.campaign.truth import MISTAKES, SIX_MISTAKES

START, FREE, TOUCH, LOAD, HOLD, BACK = PHASES = "start", "free", "touch", "load", "hold", "back"
"""Where a fault begins: before the run, in free air, about the touch, at a force of a load step, in
a hold, or while the arm retracts."""
ONLY_START = (*MISTAKES, *SIX_MISTAKES, *FIRST_DAY, "arm_turned", "common_gain")
SECOND, ARMS_OWN, COMMON = ("second_", "link_aged"), ("arm_force_",), ("link_", "common_supply")
"""Beginnings of the faults of a second sensor, of an arm that feels force, of either."""
ANY = ""
"""Of a pair: both faults begin in any phase."""
SEPARATOR = "+"


@dataclass(frozen=True, slots=True)
class Stratum:
    """Rigs of a class with these faults, one or two, which begin in this phase.

    `axes` is "one" or "six", `channels` 1 or 2.
    """

    axes: str
    channels: int
    wrong: tuple[str, ...]
    phase: str

    @property
    def six(self) -> bool:
        """Whether the rigs have six axes."""
        return self.axes == SIX_AXES

    @property
    def name(self) -> str:
        """As in "six axes, 2 channels: force_gain, load"."""
        axes = "six axes" if self.six else "one axis"
        channels = "2 channels" if self.channels == 2 else "1 channel"
        return f"{axes}, {channels}: {' + '.join(self.wrong)}, {self.phase or 'any phase'}"


def kinds_for(axes: str, channels: int) -> tuple[str, ...]:
    """All faults that such rigs can have, sorted; gauges are left out: no rule reads them."""
    absent = ("gauge_", *(() if channels == 2 else (*SECOND, *ARMS_OWN, *COMMON)))
    return tuple(sorted(k for k in known_kinds(axes == SIX_AXES) if not k.startswith(absent)))


def phases_of(kind: str) -> tuple[str, ...]:
    """The phases in which a fault of this kind can begin."""
    return (START,) if kind in ONLY_START else (FREE, TOUCH, LOAD, HOLD, BACK)


def strata(axes: tuple[str, ...], channels: tuple[int, ...] = (2, 1), at_once: int = 1,
           wrong: tuple[str, ...] = ()) -> list[Stratum]:  # fmt: skip
    """Every stratum in a fixed order.

    Args:
        axes: of the rigs.
        channels: force channels of the rigs.
        at_once: faults in a run; pairs begin in any phase.
        wrong: only these: a kind, or two as in "force_gain+second_freeze".

    Raises:
        BadInputError: a kind that is none, or that no such rig has.
    """
    _check(wrong)
    named = {tuple(sorted(text.split(SEPARATOR))) for text in wrong}
    found = []
    for one in axes:
        for count in channels:
            kinds = kinds_for(one, count)
            groups = set(combinations(kinds, at_once)) if not named else {
                kinds_of for kinds_of in named if set(kinds_of) <= set(kinds)
            }  # fmt: skip
            for group in sorted(groups):
                if not _together(group):
                    continue
                phases = phases_of(group[0]) if len(group) == 1 else (ANY,)
                found += [Stratum(one, count, group, phase) for phase in phases]
    if not found:
        raise BadInputError(
            f"no rig has {', '.join(wrong)}",
            hint="second_* needs a second sensor, arm_force_* an arm that feels force; not both",
        )
    return found


def _check(wrong: tuple[str, ...]) -> None:
    known = known_kinds(six=True)
    for text in wrong:
        for kind in text.split(SEPARATOR):
            if kind not in known:
                raise BadInputError(
                    f"unknown kind {kind!r} in {text!r}", hint=f"one of {', '.join(known)}"
                )


def _together(kinds: tuple[str, ...]) -> bool:
    """Whether a rig can have both: its second channel is one of two."""
    return not all(any(k.startswith(prefix) for k in kinds) for prefix in (SECOND, ARMS_OWN))
