"""What is searched one by one: everything that can go wrong, alone and two at once, per rig."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

from stepload.errors import BadInputError
from stepload.plan.model import SecondForceSource
from stepload.rig.world import load_world
from stepload_verify.campaign.mishaps import INCIDENTS, SIX_FAULTS, WIDER_FAULTS
from stepload_verify.campaign.truth import ANOMALIES, WIDER_ANOMALIES

SOURCES = (SecondForceSource.SENSOR, SecondForceSource.ARM)
SEPARATOR = "+"


@dataclass(frozen=True, slots=True)
class Stratum:
    """Rigs with this second force channel on which these kinds of things go wrong at once."""

    source: SecondForceSource
    wrong: tuple[str, ...]

    @property
    def name(self) -> str:
        """As in "sensor: force_gain + second_freeze"."""
        return f"{self.source.value}: {f' {SEPARATOR} '.join(self.wrong)}"


def kinds_for(source: SecondForceSource, *, wider: bool) -> tuple[str, ...]:
    """All that can go wrong on a rig with this second channel, sorted; gauges are left out.

    Args:
        source: of the second force channel.
        wider: also what is beyond the claim of the campaign.
    """
    absent = "arm_force_" if source is SecondForceSource.SENSOR else "second_"
    beyond = (*SIX_FAULTS, *(() if wider else (*WIDER_FAULTS, *WIDER_ANOMALIES)))
    kinds = (*load_world().faults, *INCIDENTS, *ANOMALIES, *WIDER_ANOMALIES)
    return tuple(
        sorted(k for k in kinds if not k.startswith((absent, "gauge_")) and k not in beyond)
    )


def strata(*, wider: bool, at_once: int = 2) -> list[Stratum]:
    """Every stratum of up to two things at once, in a fixed order.

    Args:
        wider: also what is beyond the claim of the campaign; then only strata with something of it.
        at_once: 1 or 2.
    """
    beyond = {*WIDER_FAULTS, *WIDER_ANOMALIES}
    found = []
    for source in SOURCES:
        kinds = kinds_for(source, wider=wider)
        for count in range(1, at_once + 1):
            found += [Stratum(source, wrong) for wrong in combinations(kinds, count)]
    return [one for one in found if not wider or beyond.intersection(one.wrong)]


def named(text: str) -> list[Stratum]:
    """The strata of "force_gain+second_freeze": on every rig that has what can go wrong.

    Raises:
        BadInputError: a kind that is none, or that no rig has together.
    """
    wrong = tuple(sorted(part.strip() for part in text.split(SEPARATOR)))
    known = {source: kinds_for(source, wider=True) for source in SOURCES}
    everything = sorted({kind for kinds in known.values() for kind in kinds})
    for kind in wrong:
        if kind not in everything:
            raise BadInputError(
                f"unknown kind {kind!r} in {text!r}", hint=f"one of {', '.join(everything)}"
            )
    found = [Stratum(source, wrong) for source in SOURCES if _all_in(wrong, known[source])]
    if not found:
        raise BadInputError(
            f"no rig has all of {text!r}",
            hint="second_* needs a second sensor, arm_force_* an arm that feels force; not both",
        )
    return found


def _all_in(wrong: Iterable[str], kinds: Sequence[str]) -> bool:
    return all(kind in kinds for kind in wrong)
