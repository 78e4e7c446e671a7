"""The strata of a search: every possible fault, alone and in pairs, per rig."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from stepload.errors import BadInputError
from stepload.plan.model import SecondForceSource
from stepload.rig.world import load_world
from stepload_verify.campaign.mishaps import INCIDENTS, SIX_FAULTS, WIDER_FAULTS
from stepload_verify.campaign.scenario import ONE_AXIS, SIX_AXES
from stepload_verify.campaign.truth import ALL_ANOMALIES, SIX_ANOMALIES, WIDER_ANOMALIES

SOURCES = (SecondForceSource.SENSOR, SecondForceSource.ARM)
SEPARATOR = "+"
ANY = "any"


@dataclass(frozen=True, slots=True)
class Stratum:
    """Rigs with this second force channel and these simultaneous faults."""

    source: SecondForceSource
    wrong: tuple[str, ...]
    axes: str = ONE_AXIS

    @property
    def six(self) -> bool:
        """Whether the rigs have six axes."""
        return self.axes == SIX_AXES

    @property
    def name(self) -> str:
        """As in "sensor: force_gain + second_freeze", and "six axes, sensor: plate_slips"."""
        axes = "six axes, " if self.six else ""
        return f"{axes}{self.source.value}: {f' {SEPARATOR} '.join(self.wrong)}"


def kinds_for(source: SecondForceSource, *, wider: bool, axes: str = ONE_AXIS) -> tuple[str, ...]:
    """All faults that are possible on a rig with this second channel, sorted; gauges are left out.

    Args:
        source: of the second force channel.
        wider: also what is beyond the claim of the campaign.
        axes: of the rigs; those with one axis lack some kinds.
    """
    absent = "arm_force_" if source is SecondForceSource.SENSOR else "second_"
    beyond = (
        *(() if axes == SIX_AXES else (*SIX_FAULTS, *SIX_ANOMALIES)),
        *(() if wider else (*WIDER_FAULTS, *WIDER_ANOMALIES)),
    )
    kinds = (*load_world().faults, *INCIDENTS, *ALL_ANOMALIES)
    return tuple(
        sorted(k for k in kinds if not k.startswith((absent, "gauge_")) and k not in beyond)
    )


def strata(*, wider: bool, at_once: int = 2, axes: str = ONE_AXIS) -> list[Stratum]:
    """Every stratum of up to two things at once, in a fixed order.

    Args:
        wider: also what is beyond the claim of the campaign; then only strata with something of it.
        at_once: 1 or 2.
        axes: of the rigs.
    """
    beyond = {*WIDER_FAULTS, *WIDER_ANOMALIES}
    found = []
    for source in SOURCES:
        kinds = kinds_for(source, wider=wider, axes=axes)
        for count in range(1, at_once + 1):
            found += [Stratum(source, wrong, axes) for wrong in combinations(kinds, count)]
    return [one for one in found if not wider or beyond.intersection(one.wrong)]


def named(text: str, axes: str = ONE_AXIS) -> list[Stratum]:
    """The strata of "force_gain+second_freeze": on every rig that has what can go wrong.

    "plate_slips+any" are those with each other thing of the claim beside it.

    Raises:
        BadInputError: a kind that is none, or that no rig has together.
    """
    wrong = {part.strip() for part in text.split(SEPARATOR)}
    known = {source: kinds_for(source, wider=True, axes=axes) for source in SOURCES}
    everything = sorted({kind for kinds in known.values() for kind in kinds})
    for kind in sorted(wrong - {ANY}):
        if kind not in everything:
            raise BadInputError(
                f"unknown kind {kind!r} in {text!r}", hint=f"one of {', '.join(everything)}, {ANY}"
            )
    found = []
    for source in SOURCES:
        others = kinds_for(source, wider=False, axes=axes) if ANY in wrong else ()
        ways = [{other} for other in others if other not in wrong] or [set()]
        together = [tuple(sorted((wrong - {ANY}) | way)) for way in ways]
        found += [Stratum(source, ks, axes) for ks in together if set(ks) <= set(known[source])]
    if not found:
        raise BadInputError(
            f"no rig has all of {text!r}",
            hint="second_* needs a second sensor, arm_force_* an arm that feels force; not both",
        )
    return found
