"""From a vector to a run of a stratum: rig, truth, stance, faults, and when they begin.

The vector has one part for each of these, so that a step in one shifts nothing in another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stepload.feasibility.preflight import Preflight, derive
from stepload.plan.model import Plan, SecondForceSource
from stepload_verify.campaign.mounts import Stance, any_stance, fits, told
from stepload_verify.campaign.plants import ARM_CLASSES, plan_from
from stepload_verify.campaign.scenario import Scenario, expected_times, scenario_of
from stepload_verify.falsify.onset import NUMBERS, Look, Tape, placed, starts_of
from stepload_verify.falsify.strata import ARMS_OWN, SECOND, START, Stratum

RIG, TRUTH, STANCE, WRONG = 36, 13, 19, 10
"""Numbers that a rig with its plan, its truth, how a rig with six axes holds its tip, and each
fault read."""
LONGEST_S = 5.0
"""Longest run; slow rigs are safe, and cost time."""


def rig_length(stratum: Stratum) -> int:
    """How many numbers make the rig and its truth; the others make its faults."""
    return RIG + TRUTH + (STANCE if stratum.six else 0)


def length(stratum: Stratum) -> int:
    """How many numbers a run of this stratum is made of."""
    return rig_length(stratum) + (WRONG + NUMBERS) * len(stratum.wrong)


@dataclass(slots=True)
class Bench:
    """The runs of a stratum; what does not change from one point to the next is not done again.

    Attributes:
        template: order, times and distances of the runs.
        stratum: what is searched.
    """

    template: Plan
    stratum: Stratum
    _rig: tuple[float, ...] = ()
    _preflight: Preflight | None = None
    _look: Look | None = None

    def scenario(self, index: int, point: Sequence[float]) -> Scenario | None:
        """The run at a point of the unit cube; None where there is none within the time.

        Raises:
            DomainError: the point is too short.
        """
        stratum, count = self.stratum, rig_length(self.stratum)
        rig = tuple(point[:count])
        if rig != self._rig:
            self._rig, self._look = rig, None
            self._preflight = expected(self.template, stratum, rig)
        preflight = self._preflight
        if preflight is None:
            return None
        parts = [
            point[count + (WRONG + NUMBERS) * i : count + (WRONG + NUMBERS) * (i + 1)]
            for i in range(len(stratum.wrong))
        ]
        tapes = [Tape(part[:WRONG], kind) for part, kind in zip(parts, stratum.wrong, strict=True)]
        truth = Tape(rig[RIG : RIG + TRUTH], "truth")
        stance = _stance(stratum, rig)
        scenario = scenario_of(stratum.name, index, preflight, stance, stratum.wrong, tapes, truth)
        times = expected_times(scenario.plan, scenario.limits, scenario.truth.surface_m)
        if times.end_s > LONGEST_S:
            return None
        if stratum.phase == START:
            return scenario
        return self._placed(scenario, parts)

    def _placed(self, scenario: Scenario, parts: Sequence[Sequence[float]]) -> Scenario | None:
        if self._look is None or len(self.stratum.wrong) > 1:
            self._look = Look(scenario)
        moved = {}
        hold_s = scenario.plan.procedure.hold_s
        onsets = [Tape(part[WRONG:], "onset") for part in parts]
        for start_s, tape in zip(starts_of(scenario), onsets, strict=False):
            if start_s > 0.0 or self.stratum.phase:
                moved[start_s] = self._look.onset_s(self.stratum.phase, tape, hold_s)
        if any(start_s > self._look.end_s for start_s in moved.values()):
            return None
        return placed(scenario, moved)


def expected(template: Plan, stratum: Stratum, rig: Sequence[float]) -> Preflight | None:
    """The rig at a point, with what follows from it; None where it cannot press, or takes long."""
    stance = _stance(stratum, rig)
    if stance is not None and not stance.sound:
        return None
    tape = Tape(rig[:RIG], "rig")
    plan = plan_from(tape, template, tape.choice(ARM_CLASSES), _source(stratum))
    if plan is None:
        return None
    preflight = derive(told(plan, stance) if stance else plan)
    if preflight.limits is None or (stance is not None and not fits(preflight, stance)):
        return None
    nearest_m = plan.procedure.surface_distance_m - plan.procedure.surface_uncertainty_m
    times = expected_times(preflight.plan, preflight.limits, nearest_m)
    return preflight if times.end_s <= LONGEST_S else None


def _source(stratum: Stratum) -> SecondForceSource | None:
    """The second force channel that the faults are about; None: either."""
    if stratum.channels == 1:
        return SecondForceSource.NONE
    if any(kind.startswith(ARMS_OWN) for kind in stratum.wrong):
        return SecondForceSource.ARM
    if any(kind.startswith(SECOND) for kind in stratum.wrong):
        return SecondForceSource.SENSOR
    return None


def _stance(stratum: Stratum, rig: Sequence[float]) -> Stance | None:
    """How the rig at a point holds its tip; None where it has one axis."""
    if not stratum.six:
        return None
    arm_class = Tape(rig[:1], "rig").choice(ARM_CLASSES)
    return any_stance(Tape(rig[-STANCE:], "stance"), arm_class == "UR")
