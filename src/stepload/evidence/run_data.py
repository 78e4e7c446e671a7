"""A run in the form that the evidence is computed from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from stepload.estimators.conditions import Conditions
from stepload.evidence.lateral import ContactAlignment, Sideways
from stepload.evidence.loops import Track


class Touch(NamedTuple):
    """One point of touch: when, at which travel in m, at which force in N.

    `blur_m` is the arm's travel between two samples: force and travel of a touch may be that much
    apart in time.
    """

    time_s: float
    travel_m: float
    force_n: float
    blur_m: float = 0.0


@dataclass(frozen=True, slots=True)
class RunData:
    """A run in the form that the evidence is computed from.

    Attributes:
        tracks: number, loading and unloading (or None) of each cycle in the order of time; one
            zero of travel for all.
        conditions: what is known besides the data.
        touches: the first point of touch and the last; None without two.
        zero_step_n: largest change of the force's zero from one tare to the next; None without two.
        sideways: the lateral force, and the uncertainty that it causes.
        alignment: how the contact was made, and how well rig and plate are aligned.
        arm_drift_m_per_s: drift of the arm's position from the first touch to the last, beside a
            gauge; None where it is not known.
        adhesive: whether the force was negative near the touch.
        between_n: forces of the chord; None: 10 % of the top force, and the top.
        looked: whether the loading might have ended at an earlier level because of its deformation.
        timed: whether the times of the tracks are times, not rows.
        notes: sentences to be reported with the figures.
        doubts: sentences that block every figure.
        law_doubts: sentences that block figures that rest on a law, and so on the zero of the
            force.
    """

    tracks: Sequence[tuple[int, Track, Track | None]]
    conditions: Conditions
    touches: tuple[Touch, Touch] | None = None
    zero_step_n: float | None = None
    sideways: Sideways = field(default_factory=lambda: Sideways("guided"))
    alignment: ContactAlignment = field(default_factory=ContactAlignment)
    arm_drift_m_per_s: float | None = None
    adhesive: bool = False
    between_n: tuple[float, float] | None = None
    looked: bool = False
    timed: bool = True
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    law_doubts: tuple[str, ...] = ()
